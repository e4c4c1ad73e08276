"""A TCP proxy between programs and a controller that writes down who asked what, and when."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from tests.two_programs.registers import (
    ADDRESSES,
    EXCEPTION,
    READ_AND_WRITE,
    READ_HOLDING,
    WRITE_MANY,
    WRITE_ONE,
    decode,
    name_of,
)

HEAD = 7
"""Bytes of a Modbus TCP header: transaction, protocol, length, unit."""
DEVICE_FAILURE = 4
NO_COMMAND = {"request_number", "ring_acknowledge"}


@dataclass
class Request:
    """One request that a program sent to the controller."""

    time_s: float
    pid: int | None
    """The process whose socket it came from; None where nobody holds it any more."""
    function: int
    read_from: int | None = None
    """First address that it reads with function 3."""
    written: dict[int, int] = field(default_factory=dict)
    """Words by address."""
    refused: int | None = None
    """Code of the Modbus exception that it was answered with."""

    @property
    def names(self) -> set[str]:
        """The registers that it writes."""
        return {name_of(address) for address in self.written}

    @property
    def commands(self) -> set[str]:
        """Those of them that command the stand: no number of a request, no acknowledgement of the ring."""
        return self.names - NO_COMMAND

    def value(self, name: str) -> float | None:
        """Return what it writes into a register; None if it does not."""
        address = ADDRESSES[name][0]
        return decode(name, self.written) if address in self.written else None

    def __str__(self) -> str:
        refused = "" if self.refused is None else f", refused with exception {self.refused}"
        said = ", ".join(f"{name_of(at)} = {word}" for at, word in self.written.items())
        return f"{self.time_s:.3f} s: process {self.pid}, function {self.function}: {said}{refused}"


class Tap:
    """Listens on a port of its own and hands everything on, both ways, as it comes."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self.requests: list[Request] = []
        self.refuses: Callable[[Request], bool] = lambda _: False
        """Which requests are answered with exception 4 and never reach the controller."""
        self._upstream: int | None = None
        self._open: list[socket.socket] = []

    def serve(self, upstream: int) -> None:
        """Hand on to this port of this computer from now on."""
        self._upstream = upstream
        threading.Thread(target=self._accept, name="tap", daemon=True).start()

    def close(self) -> None:
        # A close alone leaves the accept of the other thread waiting.
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for end in self._open:
            _hang_up(end)

    def by(self, pid: int, from_s: float = 0.0, to_s: float = float("inf")) -> list[Request]:
        """Return what a process asked within a time."""
        return [one for one in self.requests[:] if one.pid == pid and from_s <= one.time_s <= to_s]

    def first(self, pid: int, what: Callable[[Request], bool] = lambda _: True) -> Request | None:
        """Return the first request of a process that is so."""
        return next((one for one in self.requests[:] if one.pid == pid and what(one)), None)

    def _accept(self) -> None:
        while True:
            try:
                client, (_, port) = self._listener.accept()
            except OSError:
                return
            try:
                server = socket.create_connection(("127.0.0.1", self._upstream), 10.0)
            except OSError:
                client.close()
                continue
            for end in (client, server):
                end.settimeout(None)
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._open += [client, server]
            waiting: dict[int, Request] = {}
            pid = owner(port, self.port)

            def asked(
                frame: bytes,
                pid: int | None = pid,
                waiting: dict[int, Request] = waiting,
                client: socket.socket = client,
            ) -> bool:
                request = parse(frame, pid)
                self.requests.append(request)
                if self.refuses(request):
                    request.refused = DEVICE_FAILURE
                    client.sendall(
                        frame[:4] + bytes((0, 3, frame[6], frame[HEAD] | EXCEPTION, DEVICE_FAILURE))
                    )
                    return False
                waiting[_transaction(frame)] = request
                return True

            def answered(frame: bytes, waiting: dict[int, Request] = waiting) -> bool:
                request = waiting.pop(_transaction(frame), None)
                if request is not None and frame[HEAD] & EXCEPTION:
                    request.refused = frame[HEAD + 1]
                return True

            for source, sink, note in ((client, server, asked), (server, client, answered)):
                threading.Thread(target=_hand_on, args=(source, sink, note), daemon=True).start()


def parse(frame: bytes, pid: int | None) -> Request:
    """Read a request of functions 6, 16 and 23; of others only the function is noted."""
    function, body = frame[HEAD], frame[HEAD + 1 :]
    first, words = 0, b""
    if function == WRITE_ONE:
        first, words = struct.unpack(">H", body[:2])[0], body[2:4]
    elif function == WRITE_MANY:
        first, words = struct.unpack(">H", body[:2])[0], body[5:]
    elif function == READ_AND_WRITE:
        first, words = struct.unpack(">H", body[4:6])[0], body[9:]
    values = struct.unpack(f">{len(words) // 2}H", words)
    read_from = struct.unpack(">H", body[:2])[0] if function == READ_HOLDING else None
    return Request(time.monotonic(), pid, function, read_from, dict(enumerate(values, first)))


def owner(port: int, to_port: int) -> int | None:
    """Return the process that holds the client's end of a TCP connection on this computer."""
    ends = f":{port:04X} ", f":{to_port:04X} "
    for line in Path("/proc/net/tcp").read_text().splitlines()[1:]:
        words = line.split()
        if all(f"{words[place]} ".endswith(end) for place, end in zip((1, 2), ends, strict=True)):
            return _holder(f"socket:[{words[9]}]")
    return None


def _holder(link: str) -> int | None:
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError):
                if any(str(handle.readlink()) == link for handle in (folder / "fd").iterdir()):
                    return int(folder.name)
    return None


def _transaction(frame: bytes) -> int:
    return int.from_bytes(frame[:2], "big")


def _hand_on(source: socket.socket, sink: socket.socket, note: Callable[[bytes], bool]) -> None:
    """Hand on until one end hangs up; ``note`` is given each frame before, and says whether it goes on."""
    kept = b""
    with contextlib.suppress(OSError):
        while came := source.recv(4096):
            kept += came
            while len(kept) >= HEAD and len(kept) >= (size := 6 + int.from_bytes(kept[4:6], "big")):
                if note(kept[:size]):
                    sink.sendall(kept[:size])
                kept = kept[size:]
    _hang_up(source)
    _hang_up(sink)


def _hang_up(end: socket.socket) -> None:
    with contextlib.suppress(OSError):
        end.shutdown(socket.SHUT_RDWR)
    end.close()
