"""The kind “w1”."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

from bufferstand.drivers.instruments import (
    FolderAddress,
    InstrumentSite,
    Place,
    SensorFaults,
    SimulatedSensor,
    SimulatedThermometers,
    ThermometerNote,
)
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.thermometers.ds18b20_kind import Ds18b20Kind
from bufferstand.drivers.thermometers.w1.settings import W1Settings
from bufferstand.drivers.thermometers.w1.simulated import W1Tree
from bufferstand.drivers.thermometers.w1.thermometer import W1Bus, roms_on_bus


class W1Kind(Ds18b20Kind[W1Settings]):
    """The kernel's 1-Wire folder."""

    name: ClassVar = "w1"
    sources: ClassVar = (
        "DS18B20 data sheet",
        "Linux, drivers/w1/slaves/w1_therm.c and its ABI documentation",
    )
    wire_name: ClassVar = "w1/devices"  # as below /sys/bus
    settings: ClassVar = W1Settings

    def drivers(self, settings: W1Settings, site: InstrumentSite) -> tuple[Sensor, ...]:
        """Return the driver of each sensor, not started yet."""
        return W1Bus(site.folder / settings.root, settings, site.clock).sensors

    def wire(self, settings: W1Settings, folder: Path) -> FolderAddress:
        """Return the folder of the devices."""
        return FolderAddress(folder / settings.root)

    def moved(self, settings: W1Settings, place: Place, timeout_s: float | None = None) -> W1Settings:
        """Return its settings with another folder."""
        del timeout_s
        assert isinstance(place, Path)
        return settings.model_copy(update={"root": str(place.absolute())})

    def simulated(
        self, settings: W1Settings, sensors: Sequence[SimulatedSensor], faults: SensorFaults, place: Path
    ) -> SimulatedThermometers:
        """Return a folder as the kernel makes it."""
        del settings
        return W1Tree(place, sensors, faults)

    def notes(self, settings: W1Settings, folder: Path) -> Iterator[ThermometerNote]:
        """Yield the sensors nobody asked for, and the clones."""
        wanted = {sensor.rom for sensor in settings.sensor}
        for rom in roms_on_bus(folder / settings.root):
            if rom not in wanted:
                remark = "on the bus but not in the stand file; a sensor that was exchanged?"
                yield ThermometerNote("1-wire", rom, "", remark)
        yield from super().notes(settings, folder)


KIND = W1Kind()
