"""DS18B20 sensors behind a DS2480B adapter: all convert at once, then each is read by its ROM."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import serial

from bufferstand.drivers.serial_line import SerialLine, open_port
from bufferstand.drivers.thermometers.bus import TemperatureBus
from bufferstand.drivers.thermometers.ds18b20 import (
    SCRATCHPAD_BYTES,
    ReadingFault,
    TemperatureReading,
    decode_scratchpad,
)
from bufferstand.drivers.thermometers.ds18b20_sensor import DS18B20
from bufferstand.drivers.thermometers.ds18b20_settings import OneWireSettings
from bufferstand.drivers.thermometers.ds2480b.adapter import (
    BAUD,
    MATCH_ROM,
    SKIP_ROM,
    Ds2480b,
    Presence,
    rom_bytes,
    rom_name,
)
from bufferstand.foundation import Clock, DeviceFault

CONVERT, READ_SCRATCHPAD, READ_POWER = 0x44, 0xBE, 0xB4
CONVERSION_MOST_S = 1.0
"""Longest wait for a conversion at 12 bit [s of the wall]: 0.75 s by the data sheet."""
PARASITE_CONVERSION_S = 0.75
"""Duration of a conversion under the strong pull-up, where its end cannot be asked for [s]."""
_BREAK_S = 0.01
_POLL_S = 0.01


class Ds2480bReader:
    """A serial adapter as a bus.

    Parameters
    ----------
    port : Path
        Serial device.
    clock : Clock
        Its wall time bounds the waits.
    parasite : bool
        Whether sensors without a supply wire hang on it.
    sleep : callable
        Waits for a time [s].
    """

    def __init__(
        self, port: Path, clock: Clock, *, parasite: bool = False, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._path = port
        self._clock = clock
        self._parasite = parasite
        self._sleep = sleep
        self._port: serial.Serial | None = None
        self._adapter: Ds2480b | None = None
        self._notes: list[str] = []

    def check(self) -> None:
        """Open the port and wake the adapter, if not done.

        Raises
        ------
        DeviceFault
            If the port cannot be opened, or no DS2480B answers.
        """
        self._opened()

    def roms(self) -> tuple[str, ...]:
        """Return every device on the bus by name, in order.

        Raises
        ------
        DeviceFault
            If the adapter fails.
        """
        return tuple(sorted(rom_name(rom) for rom in self._opened().search()))

    def read(self, roms: Sequence[str]) -> Iterator[tuple[str, TemperatureReading | ReadingFault]]:
        """Convert all sensors at once and yield the reading of each, or why there is none.

        Raises
        ------
        DeviceFault
            If the adapter fails; it is opened anew with the next round.
        """
        try:
            was_open = self._adapter is not None
            adapter = self._opened()
            if not was_open:
                self._note_strangers(adapter, roms)
            fault = self._convert(adapter)
            for rom in roms:
                yield rom, fault or self._scratchpad(adapter, rom)
        except (DeviceFault, OSError) as error:
            self.close()
            if isinstance(error, DeviceFault):
                raise
            raise DeviceFault(
                f"1-Wire adapter at {self._path}: its line failed ({error.strerror or error}); "
                "look at plug and power"
            ) from None

    def notes(self) -> list[str]:
        """Get (and forget) what is remarkable about the bus since the last call."""
        notes, self._notes = self._notes, []
        return notes

    def close(self) -> None:
        """Let go of the port; never raises."""
        port, self._port, self._adapter = self._port, None, None
        if port is not None:
            with suppress(OSError):
                port.close()

    def _opened(self) -> Ds2480b:
        if self._adapter is not None:
            return self._adapter
        name = f"1-Wire adapter at {self._path}"
        self._port = port = open_port(self._path, BAUD, name)
        line = SerialLine(port, self._clock, name)
        adapter = Ds2480b(line, lambda: port.send_break(_BREAK_S))
        try:
            adapter.begin()
        except DeviceFault:
            self.close()
            raise
        self._adapter = adapter
        return adapter

    def _note_strangers(self, adapter: Ds2480b, roms: Sequence[str]) -> None:
        """Tell which devices on the bus nobody asked for: an exchanged sensor shows so."""
        strangers = sorted({rom_name(rom) for rom in adapter.search()} - set(roms))
        if strangers:
            self._notes.append(
                f"also on the bus, and not in the stand file: {', '.join(strangers)}; "
                "a sensor that was exchanged?"
            )

    def _convert(self, adapter: Ds2480b) -> ReadingFault | None:
        """Let all sensors convert; return what keeps them all from it."""
        presence = adapter.reset()
        if presence is Presence.SHORTED:
            return ReadingFault.SHORTED
        if presence is Presence.NOBODY:
            return ReadingFault.ABSENT
        if self._parasite:
            adapter.write(bytes((SKIP_ROM,)))
            adapter.power_while(CONVERT)
            self._sleep(PARASITE_CONVERSION_S)
            adapter.end_power()
            return None
        adapter.write(bytes((SKIP_ROM, READ_POWER)))
        if not adapter.bit():
            return ReadingFault.UNPOWERED
        adapter.reset()
        adapter.write(bytes((SKIP_ROM, CONVERT)))
        deadline_s = self._clock.wall_s() + CONVERSION_MOST_S
        while not adapter.bit():  # every sensor holds the line low until it is done
            if self._clock.wall_s() >= deadline_s:
                return ReadingFault.UNFINISHED
            self._sleep(_POLL_S)
        return None

    @staticmethod
    def _scratchpad(adapter: Ds2480b, rom: str) -> TemperatureReading | ReadingFault:
        presence = adapter.reset()
        if presence is not Presence.PRESENT:
            return ReadingFault.SHORTED if presence is Presence.SHORTED else ReadingFault.ABSENT
        adapter.write(bytes((MATCH_ROM,)) + rom_bytes(rom) + bytes((READ_SCRATCHPAD,)))
        scratchpad = adapter.read(SCRATCHPAD_BYTES)
        if scratchpad == b"\xff" * SCRATCHPAD_BYTES:
            return ReadingFault.ABSENT  # nobody pulled the line down: this ROM does not answer
        return decode_scratchpad(scratchpad)


class Ds2480bBus(TemperatureBus):
    """A DS2480B adapter and the one thread that reads its sensors.

    Parameters
    ----------
    port : Path
        Serial device.
    settings : OneWireSettings
        Sensors, period, power.
    clock : Clock
        Stand time for period and stamps, wall time for the waits.
    """

    def __init__(self, port: Path, settings: OneWireSettings, clock: Clock) -> None:
        super().__init__(Ds2480bReader(port, clock, parasite=settings.parasite), settings, clock, DS18B20)
