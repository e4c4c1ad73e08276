"""The kinds “modbus”: an amplifier, or a sensor of any quantity, whose registers a map describes."""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from bufferstand.drivers.amplifiers.modbus.amplifier import ModbusAmplifier
from bufferstand.drivers.amplifiers.modbus.settings import (
    ModbusAmplifierSettings,
    ModbusSensorSettings,
    RegisterEntry,
)
from bufferstand.drivers.instruments import (
    InstrumentSite,
    NumberForm,
    Place,
    SerialAddress,
    SignalKind,
    TcpAddress,
)
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.modbus import ModbusLink, RtuWire, TcpWire, Wire
from bufferstand.drivers.register_maps import DTYPES, WHOLE_RANGES, AmplifierMap, load_amplifier_map

OVER_RANGE = 1.05
"""Where an amplifier ends whose values are no whole numbers, as a share of its range."""
MEASURED_PER_VALUE = 4
"""Measurements that one with registers makes between two requests: each finds a new one."""
EntryT = TypeVar("EntryT", bound=RegisterEntry)


class _RegisterKind(SignalKind[EntryT]):
    name = "modbus"
    sources = ("the register map that the entry names",)

    def driver(self, settings: EntryT, site: InstrumentSite) -> Sensor:
        """Return its driver, not started yet."""
        modbus, address = settings.modbus, self.wire(settings, site.folder)
        if isinstance(address, TcpAddress):
            wire: Wire = TcpWire(address.host, address.port)
        else:
            wire = RtuWire(
                address.path, baud=address.baud, parity=address.parity, stop_bits=address.stop_bits
            )
        link = ModbusLink(wire, device_id=modbus.device_id, timeout_s=modbus.timeout_s, name=site.stream)
        return ModbusAmplifier(link, self.registers(settings, site.folder), settings, site.clock, site.stream)

    def form(self, settings: EntryT, folder: Path) -> NumberForm:
        """Return its numbers: those of the map's value register."""
        registers = self.registers(settings, folder)
        rate_Hz, dtype = MEASURED_PER_VALUE * settings.rate_Hz, DTYPES[registers.value.type]
        ends = registers.saturation
        if ends is not None:
            return NumberForm(*ends, True, dtype, rate_Hz, MEASURED_PER_VALUE)
        if registers.value.type == "u32":
            return NumberForm(0, 0xFFFFFFFF, True, dtype, rate_Hz, MEASURED_PER_VALUE)
        return NumberForm(*self.reach(settings), False, dtype, rate_Hz, MEASURED_PER_VALUE)

    @abstractmethod
    def reach(self, settings: EntryT) -> tuple[float, float]:
        """Return between which counts it measures, where its register is a float."""

    def ends(self, settings: EntryT, folder: Path) -> tuple[float, float] | None:
        """Return what the value register can hold; None of floats."""
        return WHOLE_RANGES.get(self.registers(settings, folder).value.type)

    def wire(self, settings: EntryT, folder: Path) -> SerialAddress | TcpAddress:
        """Return its port of a host, or its serial device."""
        modbus = settings.modbus
        if modbus.host is not None:
            return TcpAddress(modbus.host, modbus.tcp_port)
        return SerialAddress(folder / settings.port, settings.baud, modbus.parity, modbus.stop_bits)

    def moved(self, settings: EntryT, place: Place, timeout_s: float | None = None) -> EntryT:
        """Return its settings with its wire ending elsewhere."""
        if isinstance(place, Path):
            return cast(EntryT, settings.model_copy(update={"port": str(place.absolute())}))
        where: dict[str, Any] = {"host": place.host, "tcp_port": place.port}
        patient = {} if timeout_s is None else {"timeout_s": timeout_s}
        modbus = settings.modbus.model_copy(update=where | patient)
        return cast(EntryT, settings.model_copy(update={"modbus": modbus}))

    def unit(self, settings: EntryT) -> int:
        """Return its unit."""
        return settings.modbus.device_id

    def registers(self, settings: EntryT, folder: Path) -> AmplifierMap:
        """Return the map that the entry names."""
        return load_amplifier_map(settings.modbus.map, folder)


class ModbusAmplifierKind(_RegisterKind[ModbusAmplifierSettings]):
    """An amplifier on a load cell."""

    table = "amplifier"
    settings = ModbusAmplifierSettings

    def reach(self, settings: ModbusAmplifierSettings) -> tuple[float, float]:
        """Return a little more than the nominal range of the load cell."""
        reach_kN = OVER_RANGE * settings.range_kN
        counts = settings.channel.calibration.counts_of(np.array([-reach_kN, reach_kN]))
        return float(min(counts)), float(max(counts))


class ModbusSensorKind(_RegisterKind[ModbusSensorSettings]):
    """A sensor of any quantity."""

    table = "sensor"
    settings = ModbusSensorSettings

    def reach(self, settings: ModbusSensorSettings) -> tuple[float, float]:
        """Return what a float can be: no range is stated."""
        del settings
        most = float(np.finfo(np.float32).max)
        return -most, most


KIND = (ModbusAmplifierKind(), ModbusSensorKind())
