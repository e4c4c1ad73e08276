"""Every kind of thermometers, behind one face: three sensors whose readings and faults the test sets."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol, get_args

from bufferstand.drivers.instruments.catalogue import kinds
from bufferstand.drivers.instruments.kind import InstrumentSite
from bufferstand.drivers.instruments.thermometer_kind import SensorEntry, ThermometerKind
from bufferstand.drivers.instruments.wire_address import SerialAddress
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.wires.serial_pty import AnsweringPty
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.thermometers.ds18b20_settings import OneWireSettings
from bufferstand.drivers.thermometers.ds2480b.adapter import rom_bytes
from bufferstand.drivers.thermometers.ds2480b.simulated import Ds2480bDevice
from bufferstand.drivers.thermometers.ds2480b.simulated_bus import OneWireBus, OneWireSensor
from bufferstand.drivers.thermometers.ds2480b.thermometer import Ds2480bBus
from bufferstand.drivers.thermometers.w1.thermometer import TRIGGER, W1Bus
from bufferstand.foundation.clock import WallClock
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.pump import Pump
from tests.drivers.test_ds18b20 import scratchpad, w1_text
from tests.drivers.test_w1_folder import ROMS, put

PLACES = ("spring plate 3", "spring plate 5", "air beside the stand")


class Backend(Protocol):
    """Three sensors under test."""

    sensors: tuple[Sensor, ...]
    addresses: tuple[str, ...]
    faults: tuple[str, ...]
    """Of ``power-on`` and ``silence``, those that it has."""

    def show(self, index: int, shown_C: float) -> None:
        """Let a sensor feel a temperature, a whole number of its counts [°C]."""
        ...

    def power_on(self, index: int, *, lasts: bool) -> None:
        """Let a sensor lose its supply, and show its power-on value while it ``lasts``."""
        ...

    def silence(self, index: int, *, lasts: bool) -> None:
        """Let a sensor not answer."""
        ...

    def wait(self) -> None:
        """Let time pass: more than a period of reading."""
        ...

    def close(self) -> None:
        """Take the far end away."""
        ...


def temperature_settings(**more: object) -> OneWireSettings:
    """Return the settings of the three sensors, read every 50 ms."""
    sensors = [
        {"rom": rom, "name": f"temperature_{i}", "place": place}
        for i, (rom, place) in enumerate(zip(ROMS, PLACES, strict=True), 1)
    ]
    return OneWireSettings.model_validate({"kind": "w1", "period_s": 0.05, "sensor": sensors, **more})


class OneWire:
    """What ways to DS18B20 sensors have in common."""

    addresses = ROMS
    faults = ("power-on", "silence")


class InProcess(OneWire):
    """The simulated stand's thermometers in virtual time."""

    def __init__(self, folder: Path) -> None:
        del folder
        self._stand = open_in_process(load_stand(SAMPLE_STAND))
        self.sensors = self._stand.stand.sensors[1:]

    def show(self, index: int, shown_C: float) -> None:
        counts = round(16 * shown_C)
        thermometer = self._stand.device.thermometers[index]
        thermometer.look = lambda now_s, _: thermometer.readings.append((now_s, counts))  # type: ignore[method-assign]

    def power_on(self, index: int, *, lasts: bool) -> None:
        self._fault(index, "power-on", lasts)

    def silence(self, index: int, *, lasts: bool) -> None:
        self._fault(index, "silent", lasts)

    def wait(self) -> None:
        self._stand.clock.sleep(2.0)

    def close(self) -> None:
        self._stand.stand.close()

    def _fault(self, index: int, kind: str, lasts: bool) -> None:
        schedule = self._stand.device.faults
        schedule._faults.clear()
        if lasts:
            now_s = self._stand.clock.now_s()
            schedule.add(ScheduledFault(f"temperature_{index + 1}", kind, now_s))  # type: ignore[arg-type]


class Folder(OneWire):
    """A folder as the kernel's, in one of the three ways of reading it."""

    def __init__(self, folder: Path, access: str) -> None:
        self._root = folder
        self._pads = [scratchpad(336 + 16 * index) for index in range(3)]
        (folder / "w1_bus_master1").mkdir()
        self._bulk = folder / "w1_bus_master1" / "therm_bulk_read"
        self._bulk.write_text("0\n", encoding="ascii")
        for index in range(3):
            self._write(index)
        self.sensors: tuple[Sensor, ...] = W1Bus(
            folder, temperature_settings(access=access), WallClock()
        ).sensors
        self._pump = Pump(self._convert)

    def show(self, index: int, shown_C: float) -> None:
        self._pads[index] = scratchpad(round(16 * shown_C))
        self._write(index)

    def power_on(self, index: int, *, lasts: bool) -> None:
        self._pads[index] = scratchpad(0x0550, byte_6=0x0C) if lasts else scratchpad(336)
        self._write(index)

    def silence(self, index: int, *, lasts: bool) -> None:
        if lasts:
            put(self._root, ROMS[index], "")
            put(self._root, ROMS[index], "", "temperature")
        else:
            self._write(index)

    def wait(self) -> None:
        time.sleep(0.02)

    def close(self) -> None:
        self._pump.close()

    def _write(self, index: int) -> None:
        pad = self._pads[index]
        put(self._root, ROMS[index], w1_text(pad))
        shown = int.from_bytes(pad[:2], "little", signed=True) * 1000 // 16
        put(self._root, ROMS[index], f"{shown}\n", "temperature")

    def _convert(self) -> None:
        if self._bulk.read_bytes().startswith(TRIGGER):
            self._bulk.write_text("1\n", encoding="ascii")


class Adapter(OneWire):
    """A simulated DS2480B on a pty."""

    def __init__(self, folder: Path) -> None:
        self._counts = [336 + 16 * index for index in range(3)]
        self._devices = [
            OneWireSensor(rom_bytes(rom), lambda i=i: self._counts[i], time.monotonic, conversion_s=0.02)  # type: ignore[misc]
            for i, rom in enumerate(ROMS)
        ]
        self._pty = AnsweringPty(folder / "adapter", Ds2480bDevice(OneWireBus(self._devices)))
        settings = temperature_settings(kind="ds2480b", port="adapter")
        self.sensors: tuple[Sensor, ...] = Ds2480bBus(folder / "adapter", settings, WallClock()).sensors
        self._pump = Pump(self._pty.pump, 0.0005)

    def show(self, index: int, shown_C: float) -> None:
        self._counts[index] = round(16 * shown_C)

    def power_on(self, index: int, *, lasts: bool) -> None:
        self._devices[index].state = "power-on" if lasts else "ok"

    def silence(self, index: int, *, lasts: bool) -> None:
        self._devices[index].state = "absent" if lasts else "ok"

    def wait(self) -> None:
        time.sleep(0.02)

    def close(self) -> None:
        self._pump.close()
        self._pty.close()


@dataclass
class FeltSensor:
    """A sensor as a kind's simulated device sees it."""

    settings: SensorEntry
    count: int
    conversions: int = 1


class OfKind:
    """Any kind on its simulated device, as an entry of a stand file leads to it."""

    def __init__(self, folder: Path, kind: ThermometerKind[Any]) -> None:
        entry = self._entry(kind)
        settings = kind.settings.model_validate(entry)
        self._now_s = time.monotonic
        self._type = kind.sensor_type
        self._shown: dict[str, str] = {}
        self._felt = [FeltSensor(one, self._counts(21.0)) for one in settings.sensor]  # type: ignore[attr-defined]
        self.addresses = tuple(one.settings.address for one in self._felt)
        names = {"power-on": "power-on", "silent": "silence"}
        self.faults = tuple(told for name, told in names.items() if self._type.faults.get(name))
        place = folder / "wire"
        self._device = kind.simulated(settings, self._felt, self, place)
        on_line = isinstance(kind.wire(settings, folder), SerialAddress)
        self._line = AnsweringPty(place, self._device) if on_line else None
        self._pump = Pump(self._serve)
        self.sensors = kind.drivers(settings, InstrumentSite(folder, WallClock(), "thermometers"))

    @staticmethod
    def _entry(kind: ThermometerKind[Any]) -> dict[str, Any]:
        (schema,) = [
            one for one in get_args(kind.settings.model_fields["sensor"].annotation) if one is not ...
        ]
        examples = schema.model_fields[schema.ADDRESS].examples
        sensors = [
            {schema.ADDRESS: address, "name": f"temperature_{number}", "place": place}
            for number, (address, place) in enumerate(zip(examples, PLACES, strict=True), 1)
        ]
        wire = {"root": "wire"} if kind.name == "w1" else {"port": "wire"}
        return {"kind": kind.name, "period_s": 0.05, "sensor": sensors, **wire}

    def at(self, target: str, time_s: float) -> str | None:
        """Return the fault of a sensor, as the simulated device asks for it."""
        del time_s
        return self._shown.get(target)

    def show(self, index: int, shown_C: float) -> None:
        felt = self._felt[index]
        felt.count, felt.conversions = self._counts(shown_C), felt.conversions + 1

    def power_on(self, index: int, *, lasts: bool) -> None:
        self._fault(index, "power-on" if lasts else "")

    def silence(self, index: int, *, lasts: bool) -> None:
        self._fault(index, "silent" if lasts else "")

    def wait(self) -> None:
        time.sleep(0.02)

    def close(self) -> None:
        self._pump.close()
        if self._line is not None:
            self._line.close()
        self._device.close()

    def _counts(self, shown_C: float) -> int:
        return round(float(self._type.nominal.counts_of(shown_C)))

    def _fault(self, index: int, name: str) -> None:
        self._shown = {f"temperature_{index + 1}": name} if name else {}
        self._felt[index].conversions += 1

    def _serve(self) -> None:
        sent = self._device.update(20.0 * self._now_s())
        if self._line is not None:
            self._line.send(sent)
            self._line.pump()


BACKENDS: dict[str, Callable[[Path], Backend]] = {
    "in-process": InProcess,
    "folder-w1_slave": lambda folder: Folder(folder, "w1_slave"),
    "folder-temperature": lambda folder: Folder(folder, "temperature"),
    "folder-bulk": lambda folder: Folder(folder, "bulk"),
    "adapter": Adapter,
}
BACKENDS |= {kind.name: partial(OfKind, kind=kind) for kind in kinds() if isinstance(kind, ThermometerKind)}
