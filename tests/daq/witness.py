"""An onlooker of its own at a controller's registers: no driver of ours, only sockets and struct."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

STATUS, STATUS_WORDS = 16, 24
FEED, WRITER = 97, 104
VALVE = 1 << 2
"""Bit of the status word: operation enabled."""


class Registers:
    """Reads and writes holding registers by Modbus TCP; one request at a time."""

    def __init__(self, port: int) -> None:
        self._wire = socket.create_connection(("127.0.0.1", port), timeout=30.0)
        self._number = 0

    def read(self, address: int, count: int) -> tuple[int, ...]:
        data = self._ask(struct.pack(">BHH", 3, address, count))
        return struct.unpack(f">{count}H", data[2:])

    def write(self, address: int, value: int) -> bool:
        """Write one register; return whether it was taken."""
        return self._ask(struct.pack(">BHH", 6, address, value))[0] == 6

    def _ask(self, pdu: bytes) -> bytes:
        self._number = self._number % 0xFFFF + 1
        self._wire.sendall(struct.pack(">HHHB", self._number, 0, len(pdu) + 1, 1) + pdu)
        _, _, length, _ = struct.unpack(">HHHB", self._all(7))
        return self._all(length - 1)

    def _all(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            more = self._wire.recv(count - len(data))
            assert more, "the controller has closed the connection"
            data += more
        return data

    def close(self) -> None:
        self._wire.close()


@dataclass(frozen=True)
class Look:
    """What the controller showed at a time of the wall [s, kN]."""

    at_s: float
    valve_on: bool
    state: int
    fault: int
    force_kN: float
    feed: int
    writer: int


@dataclass
class Witness:
    """Looks again and again, in a thread of its own."""

    port: int
    looks: list[Look] = field(default_factory=list)

    def look(self, registers: Registers) -> Look:
        words = registers.read(STATUS, STATUS_WORDS)
        feed, writer = registers.read(FEED, 1)[0], registers.read(WRITER, 1)[0]
        force = struct.unpack(">f", struct.pack(">HH", *words[12:14]))[0]
        return Look(time.monotonic(), bool(words[0] & VALVE), words[1], words[2], force, feed, writer)

    def newest(self) -> Look:
        return self.looks[-1]

    def since(self, at_s: float) -> list[Look]:
        return [look for look in self.looks if look.at_s >= at_s]


@contextmanager
def watching(port: int) -> Iterator[Witness]:
    """Look on while inside."""
    witness, ending, registers = Witness(port), threading.Event(), Registers(port)
    witness.looks.append(witness.look(registers))

    def watch() -> None:
        while not ending.wait(0.05):
            witness.looks.append(witness.look(registers))

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield witness
    finally:
        ending.set()
        thread.join()
        registers.close()
