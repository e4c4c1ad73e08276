"""The wires of a simulated stand's instruments, as its stand file says: serial lines and folders.

An instrument behind Modbus is in ``modbus_amplifier``.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from bufferstand.drivers.instruments import (
    FolderAddress,
    Instrument,
    SerialAddress,
    SimulatedThermometers,
    Thermometers,
)
from bufferstand.drivers.simulated.faults import FrameFaults
from bufferstand.drivers.simulated.machine import SimulatedDevice, SimulatedInstrument, Thermometer
from bufferstand.drivers.simulated.wires.serial_pty import AnsweringPty, InstrumentPty
from bufferstand.drivers.stand_file import Endpoints, StandFile
from bufferstand.foundation import BadInput


class ThermometerWire:
    """A simulated device of thermometers: on a serial line, or as a folder that it keeps itself.

    Parameters
    ----------
    device : Thermometers
        Entry of the stand file.
    sensors : sequence of Thermometer
        Its sensors, in the simulated stand.
    stand : SimulatedDevice
        With the faults.
    folder : Path, optional
        Where to make the wire, instead of the stand file's path.

    Raises
    ------
    BadInput
        If the wire cannot be made, or the device is reached in another way.
    """

    def __init__(
        self,
        device: Thermometers,
        sensors: Sequence[Thermometer],
        stand: SimulatedDevice,
        folder: Path | None,
    ) -> None:
        wire = device.wire()
        if not isinstance(wire, SerialAddress | FolderAddress):
            raise BadInput(
                f"thermometers of kind “{device.kind.name}” have no simulated ones on their wire",
                place="temperature",
                remedy="leave them out of a stand that is simulated on its wires",
            )
        name = device.kind.wire_name if device.stream == "thermometers" else ""
        self.place = (wire.path if folder is None else folder / (name or device.stream)).absolute()
        """Where it is: the folder, or the serial device."""
        self._device: SimulatedThermometers = device.kind.simulated(
            device.settings, sensors, stand.faults, self.place
        )
        self.line = AnsweringPty(self.place, self._device) if isinstance(wire, SerialAddress) else None

    def serve(self, now_s: float) -> None:
        """Obey and send what has become due by stand time ``now_s`` [s]."""
        sent = self._device.update(now_s)
        if self.line is not None:
            self.line.send(sent)
            self.line.pump()

    def close(self) -> None:
        """Take it away."""
        if self.line is not None:
            self.line.close()
        self._device.close()


class SensorWires:
    """Serial lines and folders of the instruments, served from one loop.

    Parameters
    ----------
    stand_file : StandFile
    device : SimulatedDevice
    folder : Path, optional
        Where to make the wires, instead of the stand file's paths.

    Raises
    ------
    BadInput
        If a wire cannot be made; none stays open then.
    """

    def __init__(self, stand_file: StandFile, device: SimulatedDevice, folder: Path | None = None) -> None:
        self._device = device
        self._instruments: dict[str, InstrumentPty] = {}
        self._thermometers: dict[str, ThermometerWire] = {}
        try:
            self._open(stand_file, folder)
        except BaseException:
            self.close()
            raise

    def endpoints(self) -> Endpoints:
        """Return where the wires are."""
        instruments = {stream: wire.link for stream, wire in self._instruments.items()}
        thermometers = {name: wire.place for name, wire in self._thermometers.items()}
        return Endpoints(instruments=instruments | thermometers)

    def descriptors(self) -> list[int]:
        """Return the ends of the lines on which somebody asks, to serve when they can be read."""
        lines = (*self._instruments.values(), *(wire.line for wire in self._thermometers.values()))
        return [line.fileno() for line in lines if line is not None]

    def serve(self, now_s: float) -> None:
        """Obey and send what has become due by stand time ``now_s`` [s], with the faults of that time."""
        faults = self._device.faults
        for stream, wire in self._instruments.items():
            resyncs = faults.due(now_s, stream)
            wire.pump(
                silent=faults.find(stream, "silent", now_s) is not None,
                overload=faults.find(stream, "overload", now_s) is not None,
                drop=sum(int(fault.number("bytes")) for fault in resyncs),
            )
        for thermometers in self._thermometers.values():
            thermometers.serve(now_s)

    def close(self) -> None:
        """Take every wire away."""
        for line in self._instruments.values():
            line.close()
        for wire in self._thermometers.values():
            wire.close()
        self._instruments, self._thermometers = {}, {}

    def _open(self, file: StandFile, folder: Path | None) -> None:
        device = self._device
        for one, simulated in zip(file.instruments, device.instruments, strict=True):
            if simulated.registers is None:
                self._instruments[one.stream] = self._instrument(one, simulated, folder)
        sensors = iter(device.thermometers)
        for group in file.thermometers:
            own = tuple(islice(sensors, len(group.sensors)))
            self._thermometers[group.stream] = ThermometerWire(group, own, device, folder)

    def _instrument(
        self, one: Instrument, simulated: SimulatedInstrument, folder: Path | None
    ) -> InstrumentPty:
        """Open the serial line of an instrument."""
        device, place = self._device, f"{one.kind.table}.port"
        wire, end = one.wire(), one.kind.simulated_in(one.settings, one.folder)
        if end is None or not isinstance(wire, SerialAddress):
            raise BadInput(
                f"an instrument of kind “{one.kind.name}” has no simulated one on a serial line",
                place=place,
                remedy="leave it out of a stand that is simulated on its wires",
            )
        link = (wire.path if folder is None else folder / one.stream).absolute()
        trouble = FrameFaults(device.faults, one.stream, lambda: device.time_s)
        return InstrumentPty(link, simulated.frames, end, trouble, place)
