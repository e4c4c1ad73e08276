"""A simulated device on a network: Modbus TCP, every request answered in order.

An own responder, since the server of pymodbus (3.16) answers only the first of several requests that come
together and costs four times the processor time. Source: Modbus messaging on TCP/IP 1.0b.
"""

from __future__ import annotations

import asyncio
import struct
from functools import partial
from typing import cast

from bufferstand.drivers.simulated.imperfections import DelayedConnection
from bufferstand.drivers.simulated.wires.modbus_requests import NOT_THERE, Responder
from bufferstand.foundation import BadInput

HEADER = 7
"""Bytes before the function code: transaction, protocol, length, unit."""
LONGEST = 254
"""Largest length that a header can state: unit and PDU."""


class ModbusStandServer:
    """Serves a device's registers on a TCP port, to any number of clients.

    Parameters
    ----------
    responder : Responder
    device_id : int
        Unit identifier that it answers to; others get exception 0x0B.
    """

    def __init__(self, responder: Responder, device_id: int) -> None:
        self._responder = responder
        self._device_id = device_id
        self._connections: set[asyncio.Transport] = set()
        self._server: asyncio.Server | None = None

    async def start(self, host: str, port: int, place: str = "controller.port") -> int:
        """Listen; return the port (0 takes a free one).

        Parameters
        ----------
        host, port
            Where.
        place : str
            What of the stand file says so, for messages.

        Raises
        ------
        BadInput
            If the port cannot be had.
        """
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(
                lambda: _Connection(self._responder, self._device_id, self._connections), host, port
            )
        except (OSError, OverflowError):
            raise BadInput(
                f"cannot listen on {host}:{port}",
                place=place,
                remedy="another program may hold the port, or it is not one that you may take: "
                "end that program, or choose another port (0: a free one)",
            ) from None
        found: int = self._server.sockets[0].getsockname()[1]
        return found

    async def stop(self) -> None:
        """Close the port and every connection."""
        server, self._server = self._server, None
        if server is not None:
            server.close()
            for connection in tuple(self._connections):
                connection.abort()
            await server.wait_closed()
            await asyncio.sleep(0)  # the connections' sockets are closed in the next turn of the loop


class _Connection(asyncio.Protocol):
    """One client's connection."""

    def __init__(self, responder: Responder, device_id: int, connections: set[asyncio.Transport]) -> None:
        self._responder = responder
        self._device_id = device_id
        self._connections = connections
        self._transport: asyncio.Transport | None = None
        self._received = b""
        self._coming, self._going = DelayedConnection(responder.way_s), DelayedConnection(responder.way_s)

    @property
    def is_open(self) -> bool:
        """Whether the client still has it open."""
        return self._transport is not None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the connection."""
        self._transport = cast(asyncio.Transport, transport)
        self._connections.add(self._transport)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        """Forget the connection."""
        if self._transport is not None:
            self._connections.discard(self._transport)
        self._transport = None

    def data_received(self, data: bytes) -> None:
        """Answer every whole request in what has come."""
        if self._responder.cut():
            self._received = b""  # a pulled cable: what was under way never arrives
            return
        self._received += data
        while self._transport is not None and len(self._received) > HEADER:
            transaction, protocol, length, unit = struct.unpack(">HHHB", self._received[:HEADER])
            if protocol or not 2 <= length <= LONGEST:  # not Modbus: there is no next request to be found
                self._transport.close()
                return
            end = HEADER - 1 + length
            if len(self._received) < end:
                return
            request, self._received = self._responder.hear(self._received[HEADER:end]), self._received[end:]
            if request is not None:
                self._coming.send(partial(self._answer, transaction, unit, request))

    def _answer(self, transaction: int, unit: int, request: bytes) -> None:
        """Do a request that has arrived, and send the reply."""
        if unit == self._device_id:
            reply = self._responder.answer(request)
            self._responder.asker = self
        else:
            reply = bytes((request[0] | 0x80, NOT_THERE))
        if reply is not None:
            head = struct.pack(">HHHB", transaction, 0, len(reply) + 1, unit)
            self._responder.deliver(head + reply, self._send)

    def _send(self, data: bytes) -> None:
        self._going.send(partial(self._write, data))

    def _write(self, data: bytes) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(data)
