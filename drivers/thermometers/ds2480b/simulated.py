"""A simulated DS2480B adapter on a serial line, with a simulated 1-Wire bus behind it.

By the data sheet's command set, bit by bit: pulses and their durations only as far as an answer shows them.
"""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.drivers.instruments import SensorFaults, SimulatedSensor
from bufferstand.drivers.thermometers.ds18b20 import CONVERSION_S
from bufferstand.drivers.thermometers.ds2480b.adapter import rom_bytes
from bufferstand.drivers.thermometers.ds2480b.simulated_bus import FAULT_STATES, OneWireBus, OneWireSensor

_DATA_MODE, _COMMAND_MODE, _END_PULSE = 0xE1, 0xE3, 0xF1
_SINGLE_BIT, _SEARCH, _RESET, _PULSE = 0x80, 0xA0, 0xC0, 0xE0
_ARMED = 0x02


class Ds2480bDevice:
    """The adapter: takes bytes from the serial line, gives the answers.

    Parameters
    ----------
    bus : OneWireBus
    """

    def __init__(self, bus: OneWireBus) -> None:
        self.bus = bus
        self.mute = False
        """Whether it answers nothing: unplugged, or something else on the port."""
        self._awake = False
        self._mode = "command"
        self._accelerator = False
        self._search = bytearray()
        self._parameters: dict[int, int] = {}
        self._armed = False
        self._pulsing = False

    def obey(self, data: bytes) -> bytes:
        """Take bytes; return what comes back."""
        answers = b"".join(self._take(byte) for byte in data)
        return b"" if self.mute else answers

    def _take(self, byte: int) -> bytes:
        if not self._awake:
            self._awake = True  # the timing byte after power-on
            return b""
        if self._mode == "data":
            if byte != _COMMAND_MODE:
                return self._data(byte)
            self._mode = "check"
            return b""
        if self._mode == "check" and byte == _COMMAND_MODE:
            self._mode = "data"
            return self._data(byte)
        self._mode = "command"
        return self._command(byte)

    def _data(self, byte: int) -> bytes:
        if self._accelerator:
            self._search.append(byte)
            return self._searched() if len(self._search) == 16 else b""
        read = self.bus.byte(byte)
        if self._armed:
            self._pulsing = True
            self.bus.pull_up()
        return bytes((read,))

    def _searched(self) -> bytes:
        """Search once: at a conflict the way that the request says."""
        answer = bytearray(16)
        for bit in range(64):
            one, zero = self.bus.slot(1), self.bus.slot(1)
            way = self._search[bit // 4] >> (bit % 4 * 2 + 1) & 1 if one == zero else one
            conflict = int(one == zero)
            if one and zero:
                way = 1
            self.bus.slot(way)
            answer[bit // 4] |= (way << 1 | conflict) << bit % 4 * 2
        self._search.clear()
        return bytes(answer)

    def _command(self, byte: int) -> bytes:
        if byte == _DATA_MODE:
            self._mode = "data"
            return b""
        if byte == _END_PULSE:
            was, self._pulsing = self._pulsing, False
            return b"\xec" if was else b""
        if byte & 0x81 == 0x81:
            return self._operate(byte)
        return self._configure(byte) if byte & 1 else b""

    def _operate(self, byte: int) -> bytes:
        kind = byte & 0xE0
        if kind == _SINGLE_BIT:
            read = self.bus.slot(byte >> 4 & 1)
            return bytes((byte & 0xFC | read << 1 | read,))
        if kind == _RESET:
            present = self.bus.reset()
            return bytes((0xCC if present is None else 0xCD if present else 0xCF,))
        if kind == _SEARCH:
            self._accelerator = bool(byte & 0x10)
            self._search.clear()
        elif kind == _PULSE:
            self._armed = bool(byte & _ARMED)
            self._pulsing = True
        return b""

    def _configure(self, byte: int) -> bytes:
        """Take a parameter, or (parameter 0) tell one."""
        parameter, value = byte >> 4 & 7, byte & 0x0E
        if parameter:
            self._parameters[parameter] = value
            return bytes((byte & 0xFE,))
        return bytes((self._parameters.get(value >> 1, 0),))


class SimulatedDs2480b:
    """An adapter with a bus behind it, as the simulated stand's sensors and faults are.

    Parameters
    ----------
    sensors : sequence of SimulatedSensor
        They are known by their ROM.
    faults : SensorFaults
    """

    def __init__(self, sensors: Sequence[SimulatedSensor], faults: SensorFaults) -> None:
        self._names = [one.settings.name for one in sensors]
        self._faults = faults
        self._now_s = 0.0
        self._bus = OneWireBus([self._sensor(one) for one in sensors])
        self._adapter = Ds2480bDevice(self._bus)

    def update(self, now_s: float) -> bytes:
        """Let the bus be as it is at stand time ``now_s`` [s]; nothing is sent by itself."""
        self._now_s = now_s
        shown = [self._faults.at(name, now_s) for name in self._names]
        self._bus.shorted = "shorted" in shown
        for sensor, fault in zip(self._bus.sensors, shown, strict=True):
            sensor.state = FAULT_STATES.get(fault or "", "ok")
            sensor.external_power = fault != "unpowered"
        return b""

    def obey(self, data: bytes) -> bytes:
        """Take bytes; return what comes back."""
        return self._adapter.obey(data)

    def close(self) -> None:
        """Nothing was made."""

    def _sensor(self, one: SimulatedSensor) -> OneWireSensor:
        return OneWireSensor(
            rom_bytes(one.settings.address),
            lambda: one.count,
            lambda: self._now_s,
            conversion_s=0.8 * CONVERSION_S,
        )
