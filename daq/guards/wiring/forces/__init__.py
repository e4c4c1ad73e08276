"""Wiring checks of forces: both force channels against each other, and the force against what is expected."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.guards.wiring.forces.expected_band import (
        ForceJudge,
    )
    from bufferstand.daq.guards.wiring.forces.force_jump import (
        leap_of,
        leapt,
    )
    from bufferstand.daq.guards.wiring.forces.jumped_channel import (
        farther,
    )
    from bufferstand.daq.guards.wiring.forces.two_channels import (
        TwoForcesJudge,
    )
    from bufferstand.daq.guards.wiring.forces.zero_difference import (
        apart_at_rest,
        doubt_at_rest,
    )

__all__ = [
    "ForceJudge",
    "TwoForcesJudge",
    "apart_at_rest",
    "doubt_at_rest",
    "farther",
    "leap_of",
    "leapt",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
