"""Motions as data, when a step begins and ends, and the planned step made of them."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation import (
        Harmonic,
        RampTo,
        Release,
        StaticCycles,
    )
    from bufferstand.protocols.steps.conditions import (
        Heating,
        StartBand,
        Steadiness,
        Warmth,
    )
    from bufferstand.protocols.steps.motions import (
        ForceCycles,
        Hold,
        Motion,
        RampToForce,
        TouchOff,
        WaitUntilCool,
        motion_dict,
        motions_after,
    )
    from bufferstand.protocols.steps.planned import (
        ExpectedStop,
        PlannedStep,
    )
    from bufferstand.protocols.steps.turning import (
        ExpectedTurns,
        MotionEstimate,
        TurnChanges,
    )

__all__ = [
    "ExpectedStop",
    "ExpectedTurns",
    "ForceCycles",
    "Harmonic",
    "Heating",
    "Hold",
    "Motion",
    "MotionEstimate",
    "PlannedStep",
    "RampTo",
    "RampToForce",
    "Release",
    "StartBand",
    "StaticCycles",
    "Steadiness",
    "TouchOff",
    "TurnChanges",
    "WaitUntilCool",
    "Warmth",
    "motion_dict",
    "motions_after",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
