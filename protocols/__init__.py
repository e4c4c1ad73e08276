"""What is to be done, as inspectable data: campaign files, limits, sweeps, and the plan made of them."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.protocols.limits import (
        Envelope,
        StandLimits,
        TestLimits,
        envelope,
    )

__all__ = [
    "Envelope",
    "StandLimits",
    "TestLimits",
    "envelope",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
