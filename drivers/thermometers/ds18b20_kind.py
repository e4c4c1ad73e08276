"""What both ways to DS18B20 sensors share as kinds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, TypeVar

from bufferstand.drivers.instruments import ThermometerKind, ThermometerNote
from bufferstand.drivers.thermometers.ds18b20 import looks_genuine
from bufferstand.drivers.thermometers.ds18b20_sensor import DS18B20
from bufferstand.drivers.thermometers.ds18b20_settings import OneWireSettings

OneWireT = TypeVar("OneWireT", bound=OneWireSettings)


class Ds18b20Kind(ThermometerKind[OneWireT]):
    """A 1-Wire bus of DS18B20 sensors."""

    sensor_type: ClassVar = DS18B20

    def notes(self, settings: OneWireT, folder: Path) -> Iterator[ThermometerNote]:
        """Yield the clones."""
        del folder
        for sensor in settings.sensor:
            if not looks_genuine(sensor.rom):
                remark = (
                    "its ROM is not of the maker's pattern: a clone; check its accuracy against a reference"
                )
                yield ThermometerNote(sensor.name, "rom", sensor.rom, remark)
