"""The kind “modbus-io”."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from bufferstand.drivers.acquisition.kind import AcquisitionKind
from bufferstand.drivers.acquisition.modbus_io.description import load_description, shipped_descriptions
from bufferstand.drivers.acquisition.modbus_io.driver import ModbusIoDriver, scan_reads
from bufferstand.drivers.acquisition.modbus_io.likeness import likeness
from bufferstand.drivers.acquisition.modbus_io.points import Point, resolved_points
from bufferstand.drivers.acquisition.modbus_io.settings import ModbusIoSettings
from bufferstand.drivers.instruments import InstrumentSite, SerialAddress, TcpAddress
from bufferstand.drivers.modbus import Candidate, ModbusLink, RtuWire, TcpWire, Wire
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import nearest_key

_START_AND_DATA_BITS = 9
"""Bits of a character on the line before parity and stop bits."""


class ModbusIoKind(AcquisitionKind[ModbusIoSettings]):
    """Modbus I/O, weighing transmitters and gateways by a description file."""

    name = "modbus-io"
    settings = ModbusIoSettings
    sources = (
        "the description that the entry names",
        "Modbus application protocol 1.1b3; serial line guide 1.02",
    )

    def driver(self, settings: ModbusIoSettings, site: InstrumentSite) -> ModbusIoDriver:
        """Return its driver, not started yet.

        Raises
        ------
        BadInput
            As :meth:`demand`.
        """
        self.demand(settings, site.folder)
        found = load_description(settings.description, site.folder)
        address = self.wire(settings, site.folder)
        if isinstance(address, TcpAddress):
            wire: Wire = TcpWire(address.host, address.port)
        else:
            wire = RtuWire(
                address.path, baud=address.baud, parity=address.parity, stop_bits=address.stop_bits
            )
        link = ModbusLink(wire, device_id=settings.device_id, timeout_s=settings.timeout_s, name=site.stream)
        points = self._points(settings, site.folder)
        return ModbusIoDriver(link, settings, found, points, site.clock, site.stream)

    def wire(self, settings: ModbusIoSettings, folder: Path) -> TcpAddress | SerialAddress:
        """Return its Modbus port, or its serial device."""
        if settings.host:
            return TcpAddress(settings.host, settings.port)
        return SerialAddress(folder / settings.serial, settings.baud, settings.parity, settings.stop_bits)

    def demand(self, settings: ModbusIoSettings, folder: Path) -> None:
        """Refuse an entry that its description does not fit.

        Raises
        ------
        BadInput
            If the description cannot be read, asks what is not answered, has no such point or wire, or the
            rate is more than device or line can do.
        """
        found = load_description(settings.description, folder)
        if settings.serial and "rtu" not in found.wires:  # one on RTU may well lie behind a gateway
            raise BadInput(
                f"description “{found.id}” is of a device on Modbus TCP",
                place="serial",
                remedy="write host, or name another description",
            )
        points = self._points(settings, folder)
        if found.fastest_Hz is not None and settings.rate_Hz > found.fastest_Hz:
            raise BadInput(
                f"rate_Hz = {settings.rate_Hz:g}: the device has {found.fastest_Hz:g} new values a second, "
                "others would come twice",
                place="rate_Hz",
                remedy=f"write rate_Hz = {found.fastest_Hz:g} or less",
            )
        if settings.serial:
            reads = scan_reads(points, most_registers=found.most_registers, bridge=found.bridge)
            characters = sum(read.line_characters() for read in (*reads[0], *reads[1]))
            bits = _START_AND_DATA_BITS + (settings.parity != "none") + settings.stop_bits
            most_Hz = settings.baud / (bits * characters)
            if settings.rate_Hz > most_Hz:
                raise BadInput(
                    f"rate_Hz = {settings.rate_Hz:g}: {settings.baud} baud carries {most_Hz:.3g} polls a "
                    f"second of {len(reads[0]) + len(reads[1])} requests",
                    place="rate_Hz",
                    remedy="write a smaller rate_Hz, or a larger baud in device and stand file",
                )

    def candidates(self) -> Iterator[Candidate]:
        """Yield every shipped description."""
        for name in shipped_descriptions():
            found = load_description(name, Path())
            yield Candidate("description", name, found.title, partial(likeness, found))

    def _points(self, settings: ModbusIoSettings, folder: Path) -> list[Point]:
        found = load_description(settings.description, folder)
        points = resolved_points(found, settings.answers)
        wanted = []
        for number, one in enumerate(settings.input):
            if one.point not in points:
                near = nearest_key(one.point, list(points))
                raise BadInput(
                    f"description “{found.id}” has no point “{one.point}”",
                    place=f"input.{number}.point",
                    remedy=f"did you mean {near}?" if near else f"it has {', '.join(points)}",
                )
            wanted.append(points[one.point])
        return wanted


KIND = ModbusIoKind()
