"""Motions as data, when a step begins and ends, and the planned step made of them."""

from __future__ import annotations

from bufferstand.foundation.motions import Harmonic, RampTo, Release, StaticCycles
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
