"""Modbus TCP as LabJack describes it: functions 3, 4, 6, 16 and 76, and packets that come by themselves.

Source: Protocol Details [Direct Modbus TCP]; packets of at most 1040 bytes on Ethernet.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from typing import cast

from tests.peers.labjack.device import DeviceError, LabJack

HEADER = 7
LARGEST = 1040
FEEDBACK = 76
ILLEGAL_FUNCTION = 1


def answer(device: LabJack, pdu: bytes) -> bytes:
    """Return the reply to a request, both without their header."""
    try:
        return _do(device, pdu)
    except DeviceError as error:
        device.fail(error)
        return bytes((pdu[0] | 0x80, error.exception))
    except (struct.error, IndexError):
        device.fail(DeviceError(2301))
        return bytes((pdu[0] | 0x80, 3))


def _do(device: LabJack, pdu: bytes) -> bytes:
    function = pdu[0]
    if function in (3, 4):
        address, count = struct.unpack(">HH", pdu[1:5])
        if not 1 <= count <= 127:  # one byte says how many bytes come
            raise DeviceError(2314, 3)
        found = device.read(address, count)
        return bytes((function, len(found))) + found
    if function == 6:
        (address,) = struct.unpack(">H", pdu[1:3])
        device.write(address, pdu[3:5])
        return pdu[:5]
    if function == 16:
        address, count, size = struct.unpack(">HHB", pdu[1:6])
        if size != 2 * count or len(pdu) != 6 + size:
            raise DeviceError(2313, 3)
        device.write(address, pdu[6:])
        return pdu[:5]
    if function == FEEDBACK:
        return bytes((FEEDBACK,)) + _feedback(device, pdu[1:])
    raise DeviceError(ILLEGAL_FUNCTION, ILLEGAL_FUNCTION)


def _feedback(device: LabJack, frames: bytes) -> bytes:
    """Do the frames of one feedback request in their order: 0 reads, 1 writes."""
    place, found = 0, b""
    while place < len(frames):
        kind, address, count = struct.unpack(">BHB", frames[place : place + 4])
        place += 4
        if kind == 0:
            found += device.read(address, count)
            continue
        device.write(address, frames[place : place + 2 * count])
        place += 2 * count
    if HEADER + 1 + len(found) > LARGEST:
        raise DeviceError(2300)
    return found


class CommandConnection(asyncio.Protocol):
    """One client on the port of commands.

    Parameters
    ----------
    device : LabJack
    deliver : callable
        Takes a reply and how to send it: it may come late, or never.
    opened : set
        Where open connections are kept.
    """

    def __init__(
        self,
        device: LabJack,
        deliver: Callable[[bytes, Callable[[bytes], None]], None],
        opened: set[asyncio.Transport],
    ) -> None:
        self._device, self._deliver, self._opened = device, deliver, opened
        self._transport: asyncio.Transport | None = None
        self._received = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the connection."""
        self._transport = cast(asyncio.Transport, transport)
        self._opened.add(self._transport)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        """Forget it."""
        if self._transport is not None:
            self._opened.discard(self._transport)
        self._transport = None

    def data_received(self, data: bytes) -> None:
        """Answer every whole request."""
        self._received += data
        while len(self._received) > HEADER:
            transaction, protocol, length, unit = struct.unpack(">HHHB", self._received[:HEADER])
            if protocol or not 2 <= length <= LARGEST:
                if self._transport is not None:
                    self._transport.close()
                return
            end = HEADER - 1 + length
            if len(self._received) < end:
                return
            pdu, self._received = self._received[HEADER:end], self._received[end:]
            reply = answer(self._device, pdu)
            head = struct.pack(">HHHB", transaction, 0, len(reply) + 1, unit)
            self._deliver(head + reply, self._send)

    def _send(self, data: bytes) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(data)


class StreamConnection(asyncio.Protocol):
    """One client on the port of spontaneous packets; what it sends is not looked at."""

    def __init__(self, opened: set[asyncio.Transport]) -> None:
        self._opened = opened
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the connection."""
        self._transport = cast(asyncio.Transport, transport)
        self._opened.add(self._transport)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        """Forget it."""
        if self._transport is not None:
            self._opened.discard(self._transport)
