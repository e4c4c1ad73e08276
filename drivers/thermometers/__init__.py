"""Thermometers.

A folder for each kind, beside the DS18B20 sensor that ours share and the bus that reads sensors in turn.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.thermometers.bus import (
        BusReader,
        TemperatureBus,
    )
    from bufferstand.drivers.thermometers.ds18b20 import (
        CELSIUS_PER_COUNT,
        TemperatureReading,
    )
    from bufferstand.drivers.thermometers.settings import (
        ThermometerSensor,
        ThermometerSettings,
    )

__all__ = [
    "CELSIUS_PER_COUNT",
    "BusReader",
    "TemperatureBus",
    "TemperatureReading",
    "ThermometerSensor",
    "ThermometerSettings",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
