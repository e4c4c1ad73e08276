"""DS18B20 sensors behind a DS2480B serial adapter."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.thermometers.ds2480b.thermometer import (
        Ds2480bBus,
    )

__all__ = [
    "Ds2480bBus",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
