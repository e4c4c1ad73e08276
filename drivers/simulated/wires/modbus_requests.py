"""What a simulated device answers to a Modbus request: one snapshot of its registers each, no sockets.

Source: Modbus application protocol 1.1b3, 6.3, 6.4, 6.6, 6.12, 6.17 and 7.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

from bufferstand.drivers.modbus import Table
from bufferstand.drivers.register_maps import MAX_READ
from bufferstand.drivers.simulated.faults import FrameFaults
from bufferstand.drivers.simulated.wires.pace import Link

READ_HOLDING, READ_INPUT, WRITE_ONE, WRITE_SEVERAL, EXCHANGE = 3, 4, 6, 16, 23
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, NOT_THERE = 1, 2, 3, 0x0B
"""Exception codes."""
MOST_WRITTEN = {WRITE_SEVERAL: 123, EXCHANGE: 121}
"""Registers that one write can carry."""

_REMEMBERED = 256
"""Requests whose addresses need not be judged again; clients ask the same over and over."""


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


class Bank(Protocol):
    """The registers of a device."""

    @property
    def readable(self) -> Mapping[Table, frozenset[int]]:
        """Addresses that exist, by table; those between are illegal, a table without any unknown."""
        ...

    @property
    def writable(self) -> frozenset[int]:
        """Addresses of the holding table that can be written."""
        ...

    def read_packed(self, address: int, count: int, table: Table) -> bytes:
        """Return registers, as they are on the wire, as one snapshot of the device."""
        ...

    def write(self, address: int, values: Sequence[int]) -> int:
        """Write registers; return 0, or the exception code with which nothing has been changed."""
        ...

    def is_harmless(self, address: int, count: int) -> bool:
        """Return whether a write does nothing to the stand."""
        ...

    def is_momentary(self, addresses: range, table: Table) -> bool:
        """Return whether a read wants present values, not those of some milliseconds ago."""
        ...


class Responder:
    """Answers requests by a register bank.

    Parameters
    ----------
    bank : Bank
    catch_up : callable
        Brings the device up to the present; called once before a request is done, with whether the request
        acts on the stand or wants its momentary values. An acknowledgement of samples does neither.
    cut : callable
        Whether the link is cut at present: then nothing is heard, done or answered.
    trouble : FrameTrouble, optional
        What happens to the replies on their way, and with which exceptions requests are answered.
    read_write : bool
        Whether function 23 is known.
    way_s : callable, optional
        How long the next request or reply is on its way [s of the wall]; no time without it.
    most_read : int
        Registers of one reply where that is more than a frame can carry: on a wire in memory. Its byte count
        is modulo 256 then.
    """

    def __init__(
        self,
        bank: Bank,
        catch_up: Callable[[bool], object],
        cut: Callable[[], bool],
        trouble: FrameFaults | None = None,
        read_write: bool = True,
        way_s: Callable[[], float] = lambda: 0.0,
        most_read: int = 0,
    ) -> None:
        self.way_s = way_s
        self._most_read = max(MAX_READ, most_read)
        self._read_write = read_write
        self._bank = bank
        self._catch_up = catch_up
        self.cut = cut
        self.trouble = trouble
        self.asker: Link | None = None
        """The link of the last request that was answered."""
        self._needs_present = lru_cache(_REMEMBERED)(self._judge)

    def answer(self, request: bytes) -> bytes | None:
        """Do a request (function code and data); return the reply, None where the link is cut."""
        function = request[0]
        if self.trouble is not None and (code := self.trouble.exception()) is not None:
            return bytes((function | 0x80, code))
        try:
            return self._do(function, request, self._parse(function, request[1:]))
        except RefusedError as refused:
            return bytes((function | 0x80, refused.code))

    def hear(self, frame: bytes) -> bytes | None:
        """Return what arrives of a request that was sent, None where nothing does."""
        return frame if self.trouble is None else self.trouble.heard(frame)

    def arrivals(self, frame: bytes) -> list[tuple[float, bytes]]:
        """Return what arrives when a frame is sent: after how long [s of the wall], and its bytes."""
        return [(0.0, frame)] if self.trouble is None else self.trouble.arrivals(frame)

    def deliver(self, frame: bytes, write: Callable[[bytes], None]) -> None:
        """Send a frame by ``write``, or what a fault on the wire makes of it, in a running event loop."""
        for delay_s, piece in self.arrivals(frame):
            if delay_s > 0.0:
                asyncio.get_running_loop().call_later(delay_s, write, piece)
            else:
                write(piece)

    def _parse(self, function: int, data: bytes) -> _Request:
        match function:
            case 3 if self._bank.readable["holding"]:
                return _Request("holding", self._reading(data), range(0), ())
            case 4 if self._bank.readable["input"]:
                return _Request("input", self._reading(data), range(0), ())
            case 6 if self._bank.writable:
                if len(data) != 4:
                    raise RefusedError(ILLEGAL_VALUE)
                address, value = struct.unpack(">HH", data)
                return _Request("holding", range(0), range(address, address + 1), (value,))
            case 16 if self._bank.writable:
                return _Request("holding", range(0), *_writing(data, MOST_WRITTEN[function]))
            case 23 if self._bank.writable and self._read_write:
                return _Request(
                    "holding", self._reading(data[:4]), *_writing(data[4:], MOST_WRITTEN[function])
                )
            case _:
                raise RefusedError(ILLEGAL_FUNCTION)

    def _reading(self, data: bytes) -> range:
        """Return the addresses that are to be read."""
        if len(data) != 4:
            raise RefusedError(ILLEGAL_VALUE)
        address, count = struct.unpack(">HH", data)
        if not 1 <= count <= self._most_read:
            raise RefusedError(ILLEGAL_VALUE)
        return range(address, address + count)

    def _judge(self, table: Table, read: range, written: range) -> bool:
        """Refuse addresses that are not there; return whether the stand must be up to date for the rest."""
        bank = self._bank
        if not (bank.readable[table].issuperset(read) and bank.writable.issuperset(written)):
            raise RefusedError(ILLEGAL_ADDRESS)
        acts = len(written) > 0 and not bank.is_harmless(written.start, len(written))
        return acts or bank.is_momentary(read, table)

    def _do(self, function: int, request: bytes, wanted: _Request) -> bytes | None:
        bank, written = self._bank, wanted.written
        self._catch_up(self._needs_present(wanted.table, wanted.read, written))
        if self.cut():  # since the request came; the reply is held back too
            return None
        if len(written) and (code := bank.write(written.start, wanted.values)):
            raise RefusedError(code)
        if function == WRITE_ONE:
            return request
        if function == WRITE_SEVERAL:
            return request[:5]
        count = len(wanted.read)
        return bytes((function, 2 * count & 0xFF)) + bank.read_packed(wanted.read.start, count, wanted.table)


def _writing(data: bytes, most: int) -> tuple[range, tuple[int, ...]]:
    """Return the addresses that are to be written, and what."""
    if len(data) < 5:
        raise RefusedError(ILLEGAL_VALUE)
    address, count, size = struct.unpack(">HHB", data[:5])
    if not 1 <= count <= most or size != 2 * count or len(data) != 5 + size:
        raise RefusedError(ILLEGAL_VALUE)
    return range(address, address + count), struct.unpack(f">{count}H", data[5:])
