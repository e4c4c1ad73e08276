"""The kind “ds2480b”."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from bufferstand.drivers.instruments import (
    InstrumentSite,
    Place,
    SensorFaults,
    SerialAddress,
    SimulatedSensor,
    SimulatedThermometers,
)
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.thermometers.ds18b20_kind import Ds18b20Kind
from bufferstand.drivers.thermometers.ds2480b.adapter import BAUD
from bufferstand.drivers.thermometers.ds2480b.settings import Ds2480bSettings
from bufferstand.drivers.thermometers.ds2480b.simulated import SimulatedDs2480b
from bufferstand.drivers.thermometers.ds2480b.thermometer import Ds2480bBus


class Ds2480bKind(Ds18b20Kind[Ds2480bSettings]):
    """A serial adapter with a DS2480B (DS9097U)."""

    name: ClassVar = "ds2480b"
    sources: ClassVar = ("DS2480B data sheet", "Dallas public domain kit")
    wire_name: ClassVar = "onewire"
    settings: ClassVar = Ds2480bSettings

    def drivers(self, settings: Ds2480bSettings, site: InstrumentSite) -> tuple[Sensor, ...]:
        """Return the driver of each sensor, not started yet."""
        return Ds2480bBus(site.folder / settings.port, settings, site.clock).sensors

    def wire(self, settings: Ds2480bSettings, folder: Path) -> SerialAddress:
        """Return its serial device."""
        return SerialAddress(folder / settings.port, BAUD)

    def moved(
        self, settings: Ds2480bSettings, place: Place, timeout_s: float | None = None
    ) -> Ds2480bSettings:
        """Return its settings with another serial device."""
        del timeout_s
        assert isinstance(place, Path)
        return settings.model_copy(update={"port": str(place.absolute())})

    def simulated(
        self, settings: Ds2480bSettings, sensors: Sequence[SimulatedSensor], faults: SensorFaults, place: Path
    ) -> SimulatedThermometers:
        """Return an adapter with a bus behind it."""
        del settings, place
        return SimulatedDs2480b(sensors, faults)


KIND = Ds2480bKind()
