"""The wires of a simulated stand's sensors, as its stand file says: which instruments, which way to 1-Wire.

Those of bytes and folders; an instrument behind Modbus is in ``modbus_amplifier``.
"""

from __future__ import annotations

from pathlib import Path

from bufferstand.drivers.instruments import Instrument, SerialAddress
from bufferstand.drivers.simulated.faults import FrameFaults
from bufferstand.drivers.simulated.machine import (
    CONVERSION_S,
    SimulatedDevice,
    SimulatedInstrument,
    Thermometer,
)
from bufferstand.drivers.simulated.wires.ds2480b import Ds2480bDevice, Ds2480bPty
from bufferstand.drivers.simulated.wires.onewire import FAULT_STATES, OneWireBus, OneWireSensor
from bufferstand.drivers.simulated.wires.serial_pty import InstrumentPty
from bufferstand.drivers.simulated.wires.w1_tree import W1Tree
from bufferstand.drivers.stand_file import Endpoints, StandFile
from bufferstand.drivers.thermometers import rom_bytes
from bufferstand.foundation import BadInput


class SensorWires:
    """Serial lines and folder of the sensors, served from one loop.

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
        self._w1: W1Tree | None = None
        self._adapter: Ds2480bPty | None = None
        self._onewire: OneWireBus | None = None
        try:
            self._open(stand_file, folder)
        except BaseException:
            self.close()
            raise

    def endpoints(self) -> Endpoints:
        """Return where the wires are."""
        return Endpoints(
            instruments={stream: wire.link for stream, wire in self._instruments.items()},
            w1_root=None if self._w1 is None else self._w1.root,
            onewire_port=None if self._adapter is None else self._adapter.link,
        )

    def descriptors(self) -> list[int]:
        """Return the ends of the lines on which somebody asks, to serve when they can be read."""
        return [wire.fileno() for wire in (*self._instruments.values(), self._adapter) if wire is not None]

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
        if self._w1 is not None:
            self._w1.update(now_s)
        if self._adapter is not None and self._onewire is not None:
            shown = [faults.at(t.settings.name, now_s) for t in self._device.thermometers]
            self._onewire.shorted = "shorted" in shown
            for sensor, fault in zip(self._onewire.sensors, shown, strict=True):
                sensor.state = FAULT_STATES.get(fault or "", "ok")
                sensor.external_power = fault != "unpowered"
            self._adapter.pump()

    def close(self) -> None:
        """Take every wire away."""
        for wire in (*self._instruments.values(), self._w1, self._adapter):
            if wire is not None:
                wire.close()
        self._instruments = {}
        self._w1 = self._adapter = None

    def _open(self, file: StandFile, folder: Path | None) -> None:
        device = self._device
        for one, simulated in zip(file.instruments, device.instruments, strict=True):
            if simulated.registers is None:
                self._instruments[one.stream] = self._instrument(one, simulated, folder)
        root, adapter = file.w1_root(), file.onewire_port()
        if root is not None:
            root = root if folder is None else folder / "w1" / "devices"
            self._w1 = W1Tree(root.absolute(), device.thermometers, device.faults)
        if adapter is not None:
            adapter = adapter if folder is None else folder / "onewire"
            self._onewire = OneWireBus([self._sensor(one) for one in device.thermometers])
            self._adapter = Ds2480bPty(adapter.absolute(), Ds2480bDevice(self._onewire))

    def _instrument(
        self, one: Instrument, simulated: SimulatedInstrument, folder: Path | None
    ) -> InstrumentPty:
        """Open the serial line of an instrument."""
        device, place = self._device, f"{one.kind.table}.port"
        wire, end = one.kind.wire(one.settings, one.folder), one.kind.simulated(one.settings)
        if end is None or not isinstance(wire, SerialAddress):
            raise BadInput(
                f"an instrument of kind “{one.kind.name}” has no simulated one on a serial line",
                place=place,
                remedy="leave it out of a stand that is simulated on its wires",
            )
        link = (wire.path if folder is None else folder / one.stream).absolute()
        trouble = FrameFaults(device.faults, one.stream, lambda: device.time_s)
        return InstrumentPty(link, simulated.frames, end, trouble, place)

    def _sensor(self, thermometer: Thermometer) -> OneWireSensor:
        return OneWireSensor(
            rom_bytes(thermometer.settings.rom),
            lambda: thermometer.readings[-1][1],
            lambda: self._device.time_s,
            conversion_s=0.8 * CONVERSION_S,
        )
