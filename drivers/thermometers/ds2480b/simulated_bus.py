"""A 1-Wire bus of simulated DS18B20, slot by slot: what is read is what master and devices leave high."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

from bufferstand.drivers.thermometers.simulated_scratchpad import scratchpad

SensorState = Literal["ok", "absent", "power-on", "no-power", "all-zero", "crc", "hangs"]
"""How a sensor is: as it should be, off the bus, just powered on, without power for a conversion, showing
zeros or wrong bytes, or never done with its conversion."""
FAULT_STATES: Mapping[str, SensorState] = {
    "silent": "absent",
    "missing": "absent",
    "crc": "crc",
    "crc-mismatch": "crc",
    "all-zero": "all-zero",
    "power-on": "power-on",
    "no-power": "no-power",
    "unfinished": "hangs",
    "stale": "hangs",
}
"""State of a sensor by the name of its fault."""

_SEARCH, _MATCH, _SKIP = 0xF0, 0x55, 0xCC
_CONVERT, _READ_SCRATCHPAD, _READ_POWER = 0x44, 0xBE, 0xB4
_POWER_ON, _NO_POWER = 0x0550, 0x07FF


class OneWireSensor:
    """One DS18B20 as the bus sees it.

    Parameters
    ----------
    rom : bytes
        Eight bytes: family, serial number, CRC.
    measure : callable
        Present temperature [1/16 °C].
    now_s : callable
        Present time [s].
    conversion_s : float
        What a conversion takes [s].
    external_power : bool
        Whether it has a supply wire.
    """

    def __init__(
        self,
        rom: bytes,
        measure: Callable[[], int],
        now_s: Callable[[], float],
        *,
        conversion_s: float = 0.6,
        external_power: bool = True,
    ) -> None:
        self.rom = rom
        self.state: SensorState = "ok"
        self.external_power = external_power
        self.pulled_up = False
        self._measure = measure
        self._now_s = now_s
        self._conversion_s = conversion_s
        self._count: int | None = None  # None: no conversion since power-on
        self._done_s = 0.0
        self._take: Callable[[int], int] = self._idle
        self._bits: list[int] = []

    def reset(self) -> bool:
        """Hear a reset; return whether it answers with a presence pulse."""
        self._bits = []
        self._take = self._idle if self.state == "absent" else self._command
        return self.state != "absent"

    def slot(self, bit: int) -> int:
        """Take part in a time slot in which the master writes ``bit``; return what it leaves of the line."""
        return self._take(bit)

    def _idle(self, bit: int) -> int:
        del bit
        return 1

    def _command(self, bit: int) -> int:
        self._bits.append(bit)
        if len(self._bits) == 8:
            command = sum(value << place for place, value in enumerate(self._bits))
            self._bits = []
            self._take = {_SEARCH: self._search, _MATCH: self._match, _SKIP: self._function}.get(
                command, self._idle
            )
        return 1

    def _match(self, bit: int) -> int:
        place = len(self._bits)
        self._bits.append(bit)
        if bit != self._rom_bit(place):
            self._take = self._idle
        elif place == 63:
            self._bits = []
            self._take = self._function
        return 1

    def _search(self, bit: int) -> int:
        """Give each ROM bit, its complement, then hear which way the master goes."""
        place, phase = divmod(len(self._bits), 3)
        self._bits.append(bit)
        mine = self._rom_bit(place)
        if phase == 2 and (bit != mine or place == 63):
            self._take = self._idle
        return (mine, 1 - mine, 1)[phase]

    def _function(self, bit: int) -> int:
        self._bits.append(bit)
        if len(self._bits) < 8:
            return 1
        command = sum(value << place for place, value in enumerate(self._bits))
        self._bits = []
        if command == _CONVERT:
            self._convert()
            self._take = self._busy
        elif command == _READ_SCRATCHPAD:
            self._bits = [byte >> place & 1 for byte in self._scratchpad() for place in range(8)]
            self._take = self._give
        elif command == _READ_POWER:
            self._bits = [int(self.external_power)]
            self._take = self._give
        else:
            self._take = self._idle
        return 1

    def _convert(self) -> None:
        if self.state == "power-on":
            return  # it lost its supply meanwhile and has forgotten that it shall convert
        self._count = _NO_POWER if self.state == "no-power" else self._measure()
        self._done_s = self._now_s() + self._conversion_s

    def _busy(self, bit: int) -> int:
        """Hold the line low until the conversion is done; without a supply wire it cannot tell."""
        del bit
        if self.state == "hangs":
            return 0
        return int(not self.external_power or self._now_s() >= self._done_s)

    def _give(self, bit: int) -> int:
        del bit
        return self._bits.pop(0) if self._bits else 1

    def _scratchpad(self) -> bytes:
        if self.state == "all-zero":
            return bytes(9)
        starved = not self.external_power and not self.pulled_up and self._count is not None
        if self._count is None or self.state == "power-on":
            data = scratchpad(_POWER_ON, power_on=True)
        else:
            data = scratchpad(_NO_POWER if starved else self._count)
        if self.state == "crc":
            return bytes((data[0] ^ 0x04,)) + data[1:]
        return data

    def _rom_bit(self, place: int) -> int:
        return self.rom[place // 8] >> place % 8 & 1


class OneWireBus:
    """The line that all share.

    Parameters
    ----------
    sensors : sequence of OneWireSensor
    """

    def __init__(self, sensors: Sequence[OneWireSensor]) -> None:
        self.sensors = tuple(sensors)
        self.shorted = False
        """Whether the data line lies on ground."""

    def reset(self) -> bool | None:
        """Reset the bus; return whether anybody answers, None on a short circuit."""
        present = [sensor.reset() for sensor in self.sensors]
        return None if self.shorted else any(present)

    def slot(self, bit: int) -> int:
        """Make a time slot; return what can be read in it."""
        left = [sensor.slot(bit) for sensor in self.sensors]
        return 0 if self.shorted else bit & min(left, default=1)

    def byte(self, value: int) -> int:
        """Make eight slots, lowest bit first; return what was read."""
        return sum(self.slot(value >> place & 1) << place for place in range(8))

    def pull_up(self) -> None:
        """Hold the line up strongly: sensors without a supply wire can convert."""
        for sensor in self.sensors:
            sensor.pulled_up = True
