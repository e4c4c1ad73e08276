"""The simulated controller on a real wire: Modbus TCP, one snapshot of the device a request.

A server of our own, because pymodbus' takes several turns of the event loop (and a system call to wake
itself) for each request, answers only the first of pipelined ones, and cannot be deaf as a pulled cable is.
Its conformance is tested with two clients that are not ours.
Source: Modbus application protocol 1.1b3, Modbus messaging on TCP/IP 1.0b.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Sequence

from drivers.profile import Profile
from drivers.simulated.register_bank import RegisterBank
from foundation.errors import BadInput

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, NO_TARGET = 1, 2, 3, 11
"""Exception codes (application protocol, 7)."""
READ, WRITE_ONE, WRITE, READ_WRITE = 3, 6, 16, 23
"""Function codes that are served; everything lies in the holding table."""
MOST_READ, MOST_WRITTEN, MOST_WRITTEN_WITH_READ = 125, 123, 121
"""Registers of one request (application protocol, 6.3, 6.12, 6.17)."""

_HEADER = struct.Struct(">HHHB")  # transaction, protocol, length, unit


class _Refusal(Exception):  # noqa: N818 - it names the fact
    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


class RequestHandler:
    """Answers requests out of a register bank.

    Parameters
    ----------
    bank : RegisterBank
    profile : Profile
        Says which addresses exist and which of them can be written; those between are illegal.
    catch_up : callable
        Brings the device up to the present; called before each request, with whether it acts on the stand.
    """

    def __init__(self, bank: RegisterBank, profile: Profile, catch_up: Callable[[bool], object]) -> None:
        self._bank = bank
        self._catch_up = catch_up
        self._readable = bytearray(0x10000)
        self._writable = bytearray(0x10000)
        for register in profile.registers.values():
            span = slice(register.address, register.address + register.words)
            self._readable[span] = b"\x01" * register.words
            if register.access == "rw":
                self._writable[span] = b"\x01" * register.words
        ring = profile.ring
        self._readable[ring.address : ring.address + ring.registers] = b"\x01" * ring.registers

    def answer(self, request: bytes) -> bytes:
        """Return the reply to a request, both without header (function code first)."""
        function = request[0]
        try:
            if function == READ:
                return self._read(*_unpack(">HH", request))
            if function == WRITE_ONE:
                address, value = _unpack(">HH", request)
                self._write(address, [value])
                return request
            if function == WRITE:
                return self._write_many(request)
            if function == READ_WRITE:
                return self._read_write(request)
            raise _Refusal(ILLEGAL_FUNCTION)
        except _Refusal as refusal:
            return bytes((function | 0x80, refusal.code))

    def _read(self, address: int, count: int, function: int = READ) -> bytes:
        if not 1 <= count <= MOST_READ:
            raise _Refusal(ILLEGAL_VALUE)
        _demand(self._readable, address, count)
        if function == READ:
            self._catch_up(False)
        words = self._bank.read(address, count)
        return struct.pack(f">BB{count}H", function, 2 * count, *words)

    def _write(self, address: int, values: Sequence[int]) -> None:
        _demand(self._writable, address, len(values))
        self._catch_up(not self._bank.is_acknowledgement(address, len(values)))
        if code := self._bank.write(address, values):
            raise _Refusal(code)

    def _write_many(self, request: bytes) -> bytes:
        address, count, length = _unpack(">HHB", request[:6])
        self._write(address, _registers(request[6:], count, length, MOST_WRITTEN))
        return request[:5]

    def _read_write(self, request: bytes) -> bytes:
        read_address, read_count, address, count, length = _unpack(">HHHHB", request[:10])
        values = _registers(request[10:], count, length, MOST_WRITTEN_WITH_READ)
        if not 1 <= read_count <= MOST_READ:
            raise _Refusal(ILLEGAL_VALUE)
        _demand(self._readable, read_address, read_count)  # refused whole: nothing is written then
        self._write(address, values)
        return self._read(read_address, read_count, READ_WRITE)


def _unpack(layout: str, request: bytes) -> tuple[int, ...]:
    try:
        return struct.unpack(layout, request[1:])
    except struct.error:
        raise _Refusal(ILLEGAL_VALUE) from None


def _registers(data: bytes, count: int, length: int, most: int) -> tuple[int, ...]:
    if not 1 <= count <= most or length != 2 * count or len(data) != length:
        raise _Refusal(ILLEGAL_VALUE)
    return struct.unpack(f">{count}H", data)


def _demand(allowed: bytearray, address: int, count: int) -> None:
    if address + count > len(allowed) or allowed.find(0, address, address + count) >= 0:
        raise _Refusal(ILLEGAL_ADDRESS)


class _Connection(asyncio.Protocol):
    """One client: finds requests in the stream of bytes, answers each in turn."""

    def __init__(
        self,
        handler: RequestHandler,
        device_id: int,
        cut: Callable[[], bool],
        open_ones: set[asyncio.BaseTransport],
    ) -> None:
        self._handler = handler
        self._device_id = device_id
        self._cut = cut
        self._open_ones = open_ones
        self._buffer = b""
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if isinstance(transport, asyncio.Transport):
            self._transport = transport
            self._open_ones.add(transport)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio calls with it
        if self._transport is not None:
            self._open_ones.discard(self._transport)

    def data_received(self, data: bytes) -> None:
        if self._transport is None or self._cut():
            return
        self._buffer += data
        while len(self._buffer) > _HEADER.size:
            transaction, protocol, length, unit = _HEADER.unpack_from(self._buffer)
            if protocol != 0 or not 2 <= length <= 254:
                self._transport.close()  # not Modbus: there is no way to find the next request
                return
            end = 6 + length
            if len(self._buffer) < end:
                return
            request, self._buffer = self._buffer[_HEADER.size : end], self._buffer[end:]
            if unit == self._device_id:
                reply = self._handler.answer(request)
            else:
                reply = bytes((request[0] | 0x80, NO_TARGET))
            self._transport.write(_HEADER.pack(transaction, 0, len(reply) + 1, unit) + reply)


class ModbusStandServer:
    """Listens on a TCP port and answers any number of clients.

    Parameters
    ----------
    handler : RequestHandler
    device_id : int
        Unit identifier that it answers to; others get exception 0x0B.
    cut : callable
        Whether the link is cut at present: then nothing is heard and nothing answered.
    """

    def __init__(self, handler: RequestHandler, device_id: int, cut: Callable[[], bool]) -> None:
        self._handler = handler
        self._device_id = device_id
        self._cut = cut
        self._open_ones: set[asyncio.BaseTransport] = set()
        self._server: asyncio.Server | None = None

    async def start(self, host: str, port: int) -> int:
        """Listen; return the port (0 takes a free one).

        Raises
        ------
        BadInput
            If the port cannot be had.
        """
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(
                lambda: _Connection(self._handler, self._device_id, self._cut, self._open_ones), host, port
            )
        except OSError as error:
            raise BadInput(
                f"cannot listen on {host}:{port} ({error.strerror})",
                place="controller.port",
                remedy="another program may hold the port: end it, or choose another one (0: a free one)",
            ) from None
        found: int = self._server.sockets[0].getsockname()[1]
        return found

    async def stop(self) -> None:
        """Close the port and every connection."""
        if self._server is not None:
            self._server.close()
            for transport in list(self._open_ones):
                transport.close()
            await self._server.wait_closed()
            self._server = None
