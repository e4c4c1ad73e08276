"""HBM AED amplifiers: commands, and values in text and binary."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.amplifiers.aed.amplifier import (
        AedAmplifier,
    )

__all__ = [
    "AedAmplifier",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
