"""ME GSV-2 amplifiers: commands and the stream of frames."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.amplifiers.gsv2.amplifier import (
        Gsv2Amplifier,
    )

__all__ = [
    "Gsv2Amplifier",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
