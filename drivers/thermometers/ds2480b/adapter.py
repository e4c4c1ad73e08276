"""The DS2480B serial 1-Wire adapter (DS9097U): its commands, and the 1-Wire operations made of them.

9600 baud, 8N1. In command mode a byte is a command with an answer of one byte (some have none); in data mode
each byte is put onto the 1-Wire bus and the byte read there comes back. 0xE3 leads back to command mode, so
a data byte 0xE3 is sent twice.
Sources: Dallas/Maxim public domain kit (ds2480ut.c), DS2480B data sheet by a public transcript (tests); the
sequence for the strong pull-up is that of application note 192, from memory. See docs/sensors.md.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

from bufferstand.drivers.serial_line import SerialLine
from bufferstand.drivers.thermometers.ds18b20 import crc8
from bufferstand.foundation import DeviceFault

BAUD = 9600

TIMING = b"\xc1"
"""First byte after a break: the adapter measures its baud rate by it and does not answer."""
DATA_MODE, COMMAND_MODE = 0xE1, 0xE3
RESET = b"\xc5"
"""1-Wire reset at flexible speed."""
CONFIGURATION = bytes((0x17, 0x45, 0x5B, 0x0F, 0x91))
"""Slew rate, write-1 low time, sample offset, read the baud rate, one bit: each must be answered."""
PULSE_1_S = b"\x3b"
"""Duration of the strong pull-up: 1.05 s."""
ARM, DISARM, END_PULSE = b"\xef", b"\xed", b"\xf1"
SEARCH_ON, SEARCH_OFF = b"\xb1", b"\xa1"
WRITE_0, READ_BIT = b"\x85", b"\x95"
"""One bit at flexible speed: write 0; write 1, which is also reading."""

SEARCH_ROM, MATCH_ROM, SKIP_ROM = 0xF0, 0x55, 0xCC
ROM_BYTES = 8
_ROM_BITS = 64
_TIMING_WAIT_S = 0.05
_LOOK = "look at adapter, cable, and whether temperature.port is the right device"


class Presence(IntEnum):
    """What the bus shows after a reset: the two low bits of the answer."""

    SHORTED = 0
    PRESENT = 1
    ALARM = 2
    NOBODY = 3


class Ds2480b:
    """An adapter at the end of a serial line; not thread safe.

    Parameters
    ----------
    line : Line
        The open port.
    send_break : callable
        Holds the line low for some milliseconds.
    """

    def __init__(self, line: SerialLine, send_break: Callable[[], None]) -> None:
        self._line = line
        self._send_break = send_break
        self._data_mode = False

    def begin(self) -> None:
        """Wake the adapter and configure it.

        Raises
        ------
        DeviceFault
            If it does not answer like a DS2480B.
        """
        self._line.write(bytes((COMMAND_MODE,)))  # a gateway may pass no break on
        self._send_break()
        self._line.write(TIMING)
        self._line.read(1, _TIMING_WAIT_S)  # answered only by one that was awake before the break came
        self._line.quieten()
        self._data_mode = False
        slew, low, offset, baud, bit = CONFIGURATION
        answer = self._line.ask(CONFIGURATION, len(CONFIGURATION))
        if len(answer) < len(CONFIGURATION):
            raise DeviceFault(f"{self._line.name}: no answer like that of a DS2480B adapter; {_LOOK}")
        wanted = (slew & 0xFE, low & 0xFE, offset & 0xFE, 0x00)
        if tuple(answer[:4]) != wanted or answer[4] & 0xFC != bit & 0xFC:
            raise DeviceFault(
                f"{self._line.name}: it answers {answer.hex(' ')} to {CONFIGURATION.hex(' ')}: "
                f"this is no DS2480B adapter at {BAUD} baud ({baud:#04x}); {_LOOK}"
            )

    def reset(self) -> Presence:
        """Reset the 1-Wire bus; return whether somebody is there.

        Raises
        ------
        DeviceFault
            If the adapter does not answer.
        """
        answer = self._command(RESET, 1, "reset")
        if answer[0] & 0xDC != 0xCC:
            raise self._fault(f"it answers {answer[0]:#04x} to a 1-Wire reset")
        return Presence(answer[0] & 0x03)

    def touch(self, data: bytes) -> bytes:
        """Put bytes onto the bus; return what was read in the same time slots.

        Raises
        ------
        DeviceFault
            If as many bytes do not come back.
        """
        head = b"" if self._data_mode else bytes((DATA_MODE,))
        self._data_mode = True
        doubled = data.replace(bytes((COMMAND_MODE,)), bytes((COMMAND_MODE, COMMAND_MODE)))
        answer = self._line.ask(head + doubled, len(data))
        if len(answer) < len(data):
            raise self._fault(f"{len(answer)} of {len(data)} bytes came back")
        return answer

    def write(self, data: bytes) -> None:
        """Put bytes onto the bus and see that they stood there.

        Raises
        ------
        DeviceFault
            If other bytes were read back: somebody else pulls the line.
        """
        read = self.touch(data)
        if read != data:
            raise self._fault(
                f"{data.hex(' ')} was written and {read.hex(' ')} read back: the line is disturbed"
            )

    def read(self, count: int) -> bytes:
        """Read bytes from the bus (by writing ones).

        Raises
        ------
        DeviceFault
            If they do not come.
        """
        return self.touch(b"\xff" * count)

    def bit(self, value: int = 1) -> int:
        """Write one bit; return the bit read in the same slot.

        Raises
        ------
        DeviceFault
            If the adapter does not answer.
        """
        answer = self._command(READ_BIT if value else WRITE_0, 1, "bit")
        return answer[0] & 1

    def power_while(self, command: int) -> None:
        """Write a byte and hold the line up strongly after it, for sensors without a supply wire.

        Raises
        ------
        DeviceFault
            If the adapter does not obey.
        """
        answer = self._command(PULSE_1_S, 1, "duration of the strong pull-up")
        if answer[0] != PULSE_1_S[0] & 0xFE:
            raise self._fault("it does not take the duration of the strong pull-up")
        self._end_pulse(ARM)  # arming begins a pulse at once
        self.write(bytes((command,)))

    def end_power(self) -> None:
        """End the strong pull-up.

        Raises
        ------
        DeviceFault
            If the adapter does not answer.
        """
        self._end_pulse(DISARM)

    def search(self, *, accelerated: bool = True) -> list[bytes]:
        """Return the ROM of every device on the bus, family code first; only those with a right CRC.

        Parameters
        ----------
        accelerated : bool
            Let the adapter decide bits by itself; else bit by bit, for adapters without an accelerator.

        Raises
        ------
        DeviceFault
            If the adapter does not answer.
        """
        found: list[bytes] = []
        path, last_conflict = bytes(ROM_BYTES), -1
        while len(found) < 64:  # a disturbed bus shall not search forever
            if self.reset() is not Presence.PRESENT:
                return found
            wanted = _next_path(path, last_conflict)
            self.write(bytes((SEARCH_ROM,)))
            rom, conflicts = self._accelerated(wanted) if accelerated else self._bitwise(wanted)
            if crc8(rom[:7]) != rom[7] or not rom[0]:
                return found
            found.append(rom)
            zeros = [bit for bit in conflicts if not rom[bit // 8] >> bit % 8 & 1]
            if not zeros:
                return found
            path, last_conflict = rom, zeros[-1]
        return found

    def _accelerated(self, wanted: bytes) -> tuple[bytes, list[int]]:
        """Search once with the accelerator: two bits a ROM bit, the lower one for a conflict."""
        self._command(SEARCH_ON, 0, "search accelerator")
        request = bytearray(2 * ROM_BYTES)
        for bit in range(_ROM_BITS):
            if wanted[bit // 8] >> bit % 8 & 1:
                request[bit // 4] |= 2 << bit % 4 * 2
        answer = self.touch(bytes(request))
        self._command(SEARCH_OFF, 0, "search accelerator")
        rom, conflicts = bytearray(ROM_BYTES), []
        for bit in range(_ROM_BITS):
            pair = answer[bit // 4] >> bit % 4 * 2 & 3
            rom[bit // 8] |= (pair >> 1) << bit % 8
            if pair & 1:
                conflicts.append(bit)
        return bytes(rom), conflicts

    def _bitwise(self, wanted: bytes) -> tuple[bytes, list[int]]:
        """Search once bit by bit: read a bit and its complement, write the way to go."""
        rom, conflicts = bytearray(ROM_BYTES), []
        for bit in range(_ROM_BITS):
            ones, zeros = self.bit(), self.bit()
            if ones and zeros:
                return bytes(ROM_BYTES), []  # nobody answers any more
            way = wanted[bit // 8] >> bit % 8 & 1 if ones == zeros else ones
            if ones == zeros:
                conflicts.append(bit)
            self.bit(way)
            rom[bit // 8] |= way << bit % 8
        return bytes(rom), conflicts

    def _command(self, command: bytes, answers: int, name: str) -> bytes:
        head = bytes((COMMAND_MODE,)) if self._data_mode else b""
        self._data_mode = False
        if not answers:
            self._line.write(head + command)
            return b""
        answer = self._line.ask(head + command, answers)
        if len(answer) < answers:
            raise self._fault(f"no answer to a command ({name})")
        return answer

    def _end_pulse(self, command: bytes) -> None:
        answer = self._command(command + END_PULSE, 1, "strong pull-up")
        if answer[0] & 0xE0 != 0xE0:
            raise self._fault(f"it answers {answer[0]:#04x} to the end of the strong pull-up")

    def _fault(self, what: str) -> DeviceFault:
        return DeviceFault(f"{self._line.name}: {what}; {_LOOK}")


def rom_name(rom: bytes) -> str:
    """Return a ROM as the kernel names it: family, then the serial number with its highest byte first."""
    return f"{rom[0]:02x}-{rom[6:0:-1].hex()}"


def rom_bytes(name: str) -> bytes:
    """Return the eight bytes of a ROM from its name: undoes :func:`rom_name`, the CRC is computed."""
    body = bytes.fromhex(name[:2]) + bytes.fromhex(name[3:])[::-1]
    return body + bytes((crc8(body),))


def _next_path(path: bytes, last_conflict: int) -> bytes:
    """Return the way to go at conflicts: as before up to the last one, there the one branch, then zeros."""
    wanted = bytearray(ROM_BYTES)
    for bit in range(max(last_conflict, 0)):
        wanted[bit // 8] |= (path[bit // 8] >> bit % 8 & 1) << bit % 8
    if last_conflict >= 0:
        wanted[last_conflict // 8] |= 1 << last_conflict % 8
    return bytes(wanted)
