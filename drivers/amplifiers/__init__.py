"""Measuring amplifiers.

A folder for each kind, beside the time stamps and text values that they share.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.amplifiers.serial import (
        resync_text,
        with_saturation,
    )

__all__ = [
    "resync_text",
    "with_saturation",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
