"""DS18B20 sensors through the kernel's 1-Wire folder."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.thermometers.w1.thermometer import (
        W1Bus,
    )

__all__ = [
    "W1Bus",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
