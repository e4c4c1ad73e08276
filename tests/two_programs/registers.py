"""The register table of docs/registers.md once more, by hand, and a Modbus TCP client that can only read.

Bare sockets and ``struct``: neither pymodbus nor a driver of this project, so that what both sides of the
project take for granted is not taken for granted here.
"""

from __future__ import annotations

import socket
import struct

READ_HOLDING = 3
WRITE_ONE = 6
WRITE_MANY = 16
READ_AND_WRITE = 23
EXCEPTION = 0x80

SIMULATED = 10
"""Address of the optional word by which a simulated controller says what it is."""
STATUS = (16, 25)
"""First address and number of registers: status_word … status_check, without a hole."""
CONTROL = (96, 9)

ADDRESSES: dict[str, tuple[int, str]] = {
    "status_word": (16, "H"),
    "state": (17, "H"),
    "fault_code": (18, "H"),
    "echo_sequence": (19, "H"),
    "done_sequence": (21, "H"),
    "heartbeat": (24, "H"),
    "watchdog_remaining_ms": (25, "H"),
    "watchdog_trips": (26, "H"),
    "end_reason": (27, "H"),
    "force_kN": (28, "f"),
    "stroke_mm": (30, "f"),
    "position_mm": (32, "f"),
    "command_mm": (34, "f"),
    "command_sequence": (64, "H"),
    "command_code": (65, "H"),
    "target_mm": (66, "f"),
    "execute": (84, "H"),
    "control_word": (96, "H"),
    "watchdog_feed": (97, "H"),
    "watchdog_time_ms": (98, "H"),
    "request_number": (99, "H"),
    "force_limit_kN": (100, "f"),
    "stroke_limit_mm": (102, "f"),
    "writer": (104, "H"),
    "ring_acknowledge": (256, "I"),
}
WRITTEN = ("control_word", "watchdog_feed", "watchdog_time_ms", "force_limit_kN", "stroke_limit_mm")
"""Registers that change by nothing but a program's writing (the writer also falls to 0 by itself)."""

OPERATION_ENABLED = 0x0004
OFF, READY, HOLDING, RAMPING, WAVEFORM, RELEASING, FAULT = range(7)
STATES = ("off", "ready", "holding", "ramping", "waveform", "releasing", "fault")


def decode(name: str, words: dict[int, int]) -> float:
    """Return a register's value from the words at its addresses; 32-bit values come high word first."""
    address, kind = ADDRESSES[name]
    if kind == "H":
        return words[address]
    (value,) = struct.unpack(f">{kind}", struct.pack(">HH", words[address], words[address + 1]))
    return float(value) if kind == "f" else int(value)


def name_of(address: int) -> str:
    """Return the name of what lies at an address, or the address itself."""
    for name, (first, kind) in ADDRESSES.items():
        if first <= address < first + (1 if kind == "H" else 2):
            return name
    return str(address)


class ReadOnlyClient:
    """A Modbus TCP client that knows function 3 and no other: it cannot disturb what it looks at."""

    def __init__(self, port: int, timeout_s: float = 60.0) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._transaction = 0

    def read(self, first: int, count: int) -> dict[int, int]:
        """Return so many holding registers from an address on, by address.

        Raises:
            ConnectionError: The controller hangs up, refuses, or answers something else.
        """
        self._transaction = self._transaction % 0xFFFF + 1
        self._socket.sendall(struct.pack(">HHHBBHH", self._transaction, 0, 6, 1, READ_HOLDING, first, count))
        transaction, protocol, length, _, function = struct.unpack(">HHHBB", self._receive(8))
        body = self._receive(length - 2)
        if (transaction, protocol, function) != (self._transaction, 0, READ_HOLDING):
            raise ConnectionError(f"function {function:#04x} {body.hex()} in reply to a read of {first}")
        return dict(zip(range(first, first + count), struct.unpack(f">{count}H", body[1:]), strict=True))

    def close(self) -> None:
        self._socket.close()

    def _receive(self, count: int) -> bytes:
        received = b""
        while len(received) < count:
            piece = self._socket.recv(count - len(received))
            if not piece:
                raise ConnectionError("the controller has hung up")
            received += piece
        return received
