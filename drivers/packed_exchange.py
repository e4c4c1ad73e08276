"""FC23 over an open TCP connection in bytes, in two halves: asked now, collected later.

What reads the sample ring thousands of times a second. pymodbus does the same in four times the processor
time, and cannot send a request before somebody waits for its reply. Transaction numbers are drawn from the
same client, so that no two requests of one connection share one.
"""

from __future__ import annotations

import select
import struct
import time
from contextlib import suppress
from dataclasses import dataclass

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusIOException

FUNCTION = 23
"""Read/write multiple registers (Modbus application protocol 1.1b3, 6.17)."""
_HEAD = struct.Struct(">HHHBB")
_REQUEST = struct.Struct(">HHHBBHHHHB")
_PREFIX = 6
"""Bytes of a frame that its length does not count."""
_LONGEST = 254
_PIECE = 4096


@dataclass(frozen=True)
class Exchange:
    """One transaction: registers are written, then others are read.

    Parameters
    ----------
    read_address, read_count : int
        What is read.
    write_address : int
        Where is written.
    written : bytes
        The registers to write, as they are on the wire.
    what : str
        What is exchanged, for messages.
    """

    read_address: int
    read_count: int
    write_address: int
    written: bytes
    what: str

    def __str__(self) -> str:
        """Return what is asked, for messages."""
        return f"exchanging {self.what} (FC23, {self.read_count} registers from {self.read_address})"


@dataclass(frozen=True)
class PackedReply:
    """A reply as it came: function code and what follows it.

    Parameters
    ----------
    function_code : int
        With bit 7 set where it is an exception.
    data : bytes
        Byte count and registers, or the exception's code.
    """

    function_code: int
    data: bytes

    @property
    def exception_code(self) -> int:
        """Number of the exception; 0 where it has none."""
        return self.data[0] if self.data else 0

    def isError(self) -> bool:  # noqa: N802 - as pymodbus' replies have it
        """Return whether it is an exception."""
        return self.function_code > 0x7F

    def find_doubt(self, count: int) -> str:
        """Return what is wrong with its length, if ``count`` registers were asked for."""
        got = len(self.data) - 1
        if got == 2 * count == self.data[0]:
            return ""
        if got < 0 or self.data[0] != got:
            return f"the reply cannot be decoded (byte count {self.data[:1].hex()} of {got} bytes)"
        return f"the reply has {got // 2} registers instead of {count}"


class PackedPort:
    """Sends exchanges on the connection of a client of pymodbus and collects their replies.

    Parameters
    ----------
    client : ModbusTcpClient
        Open; its owner closes it.
    device_id : int
        Unit identifier.
    timeout_s : float
        Longest wait for the next bytes of a reply [s]; a whole reply may take twice as long.
    """

    def __init__(self, client: ModbusTcpClient, device_id: int, timeout_s: float) -> None:
        self._client = client
        self._device_id = device_id
        self._timeout_s = timeout_s
        self._number = 0
        self._received = b""
        self._readable = select.poll()
        if client.socket is not None:
            self._readable.register(client.socket, select.POLLIN)

    def make_way(self) -> bool:
        """Pass over doubled replies that have come; return whether no half of one lies before the next."""
        with suppress(ModbusIOException):
            while self._next_frame() is not None:
                pass
        return not self._received

    def send(self, exchange: Exchange) -> None:
        """Send a request.

        Raises
        ------
        ConnectionException, OSError
            If the connection is closed, or takes nothing.
        """
        wire = self._client.socket
        if wire is None:
            raise ConnectionException("closed")
        self._number = self._client.transaction.getNextTID()
        size = len(exchange.written)
        head = _REQUEST.pack(
            self._number,
            0,
            11 + size,
            self._device_id,
            FUNCTION,
            exchange.read_address,
            exchange.read_count,
            exchange.write_address,
            size // 2,
            size,
        )
        if wire.send(head + exchange.written) != len(head) + size:
            raise OSError("the connection takes no more")

    def receive(self, patience_s: float | None = None) -> PackedReply:
        """Wait for the reply of the last request; replies to earlier ones are passed over.

        Parameters
        ----------
        patience_s : float, optional
            Longest wait for the next bytes [s], where it is not that of the port.

        Raises
        ------
        ModbusIOException
            If it does not come in time, or what comes is no reply to this unit.
        ConnectionException, OSError
            If the connection is closed or broken.
        """
        patience_s = self._timeout_s if patience_s is None else patience_s
        end_s = time.monotonic() + 2.0 * patience_s
        while True:
            while (frame := self._next_frame()) is not None:
                number, _, _, unit, function = _HEAD.unpack_from(frame)
                if number != self._number:
                    continue
                if unit != self._device_id:
                    raise ModbusIOException(f"unit {unit} instead of {self._device_id}")
                return PackedReply(function, frame[_HEAD.size :])
            self._wait(min(patience_s, end_s - time.monotonic()))

    def _wait(self, wait_s: float) -> None:
        """Wait for further bytes."""
        wire = self._client.socket
        if wire is None:
            raise ConnectionException("closed")
        if wait_s <= 0.0 or not self._readable.poll(1000.0 * wait_s):
            raise ModbusIOException("No response")
        piece = wire.recv(_PIECE)
        if not piece:
            self._client.close()  # type: ignore[no-untyped-call]
            raise ConnectionException("closed by the device")
        self._received += piece

    def _next_frame(self) -> bytes | None:
        """Take the next whole frame from what has come, None where there is none."""
        received = self._received
        if len(received) < _HEAD.size:
            return None
        _, protocol, length, _, _ = _HEAD.unpack_from(received)
        if protocol or not 2 <= length <= _LONGEST:
            raise ModbusIOException(f"a frame of protocol {protocol} and length {length}")
        end = _PREFIX + length
        if len(received) < end:
            return None
        self._received = received[end:]
        return received[:end]
