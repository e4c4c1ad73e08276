"""What the simulated controller answers to a Modbus request: one snapshot of the device each, no sockets.

Source: Modbus application protocol 1.1b3, 6.3, 6.4, 6.6, 6.12, 6.17 and 7.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

from drivers.modbus_link import Table
from drivers.profile import MAX_READ, Profile
from drivers.simulated.faults_wire import FrameTrouble
from drivers.simulated.register_bank import RegisterBank

READ_HOLDING, READ_INPUT, WRITE_ONE, WRITE_SEVERAL, EXCHANGE = 3, 4, 6, 16, 23
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, NOT_THERE = 1, 2, 3, 0x0B
"""Exception codes."""
MOST_WRITTEN = {WRITE_SEVERAL: 123, EXCHANGE: 121}
"""Registers that one write can carry."""


class RefusedError(Exception):
    """A request that is answered with an exception; ``code`` is its number."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


@dataclass(frozen=True)
class _Request:
    """What is to be written, then read."""

    table: Table
    read: range
    written: range
    values: tuple[int, ...]


class Responder:
    """Answers requests by a register bank.

    Parameters
    ----------
    bank : RegisterBank
    profile : Profile
        Says which addresses exist and which of them can be written; those between are illegal.
    catch_up : callable
        Brings the device up to the present; called once before a request is done, with whether the request
        acts on the stand or wants its momentary values. An acknowledgement of samples does neither.
    cut : callable
        Whether the link is cut at present: then nothing is heard, done or answered.
    trouble : FrameTrouble, optional
        What happens to the replies on their way, and with which exceptions requests are answered.
    """

    def __init__(
        self,
        bank: RegisterBank,
        profile: Profile,
        catch_up: Callable[[bool], object],
        cut: Callable[[], bool],
        trouble: FrameTrouble | None = None,
    ) -> None:
        self._bank = bank
        self._catch_up = catch_up
        self.cut = cut
        self.trouble = trouble
        self._readable: dict[Table, frozenset[int]] = {}
        tables: tuple[Table, ...] = ("holding", "input")
        for table in tables:
            self._readable[table] = _addresses(profile, table, "r") | _addresses(profile, table, "rw")
        self._writable = _addresses(profile, "holding", "rw")
        if profile.window is not None:
            ring = profile.window
            self._readable["holding"] |= set(range(ring.address, ring.address + ring.registers))

    def answer(self, request: bytes) -> bytes | None:
        """Do a request (function code and data); return the reply, None where the link is cut."""
        function = request[0]
        if self.trouble is not None and (code := self.trouble.exception()) is not None:
            return bytes((function | 0x80, code))
        try:
            wanted = self._parse(function, request[1:])
            self._demand_addresses(wanted)
            return self._do(function, request, wanted)
        except RefusedError as refused:
            return bytes((function | 0x80, refused.code))

    def arrivals(self, frame: bytes) -> list[tuple[float, bytes]]:
        """Return what arrives of a frame that is sent: after how long [s of the wall], and its bytes."""
        return [(0.0, frame)] if self.trouble is None else self.trouble.arrivals(frame)

    def _parse(self, function: int, data: bytes) -> _Request:
        match function:
            case 3:
                return _Request("holding", _reading(data), range(0), ())
            case 4 if self._readable["input"]:
                return _Request("input", _reading(data), range(0), ())
            case 6:
                if len(data) != 4:
                    raise RefusedError(ILLEGAL_VALUE)
                address, value = struct.unpack(">HH", data)
                return _Request("holding", range(0), range(address, address + 1), (value,))
            case 16:
                return _Request("holding", range(0), *_writing(data, MOST_WRITTEN[function]))
            case 23:
                return _Request("holding", _reading(data[:4]), *_writing(data[4:], MOST_WRITTEN[function]))
            case _:
                raise RefusedError(ILLEGAL_FUNCTION)

    def _demand_addresses(self, wanted: _Request) -> None:
        if not (
            self._readable[wanted.table].issuperset(wanted.read) and self._writable.issuperset(wanted.written)
        ):
            raise RefusedError(ILLEGAL_ADDRESS)

    def _do(self, function: int, request: bytes, wanted: _Request) -> bytes | None:
        bank, written = self._bank, wanted.written
        acts = len(written) > 0 and not bank.is_harmless(written.start, len(written))
        self._catch_up(acts or bank.is_momentary(wanted.read, wanted.table))
        if self.cut():  # since the request came; the reply is held back too
            return None
        if len(written) and (code := bank.write(written.start, wanted.values)):
            raise RefusedError(code)
        if function == WRITE_ONE:
            return request
        if function == WRITE_SEVERAL:
            return request[:5]
        count = len(wanted.read)
        words = bank.read(wanted.read.start, count, wanted.table)
        return struct.pack(f">BB{count}H", function, 2 * count, *words)


def _reading(data: bytes) -> range:
    """Return the addresses that are to be read."""
    if len(data) != 4:
        raise RefusedError(ILLEGAL_VALUE)
    address, count = struct.unpack(">HH", data)
    if not 1 <= count <= MAX_READ:
        raise RefusedError(ILLEGAL_VALUE)
    return range(address, address + count)


def _writing(data: bytes, most: int) -> tuple[range, tuple[int, ...]]:
    """Return the addresses that are to be written, and what."""
    if len(data) < 5:
        raise RefusedError(ILLEGAL_VALUE)
    address, count, size = struct.unpack(">HHB", data[:5])
    if not 1 <= count <= most or size != 2 * count or len(data) != 5 + size:
        raise RefusedError(ILLEGAL_VALUE)
    return range(address, address + count), struct.unpack(f">{count}H", data[5:])


def _addresses(profile: Profile, table: Table, access: str) -> frozenset[int]:
    return frozenset(
        address
        for register in profile.registers.values()
        if register.table == table and register.access == access
        for address in range(register.address, register.address + register.words)
    )
