"""A TCP proxy that breaks a connection in the ways a network does; it knows nothing of Modbus."""

from __future__ import annotations

import selectors
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Literal

How = Literal["hold", "drop", "reset", "refuse", "deaf"]
"""``hold``: what is sent waits and comes later. ``drop``: it is lost. ``reset``: connections are reset, also
new ones. ``refuse``: nobody listens. ``deaf``: half open; replies are lost, requests arrive."""
HOWS: tuple[How, ...] = ("hold", "drop", "reset", "refuse", "deaf")


@dataclass
class BrokenWire:
    """Hands bytes on between a client and ``port``, except while :meth:`breaks` says how not to.

    ``spans`` are the outages so far: kind, start and end by ``time.monotonic()`` [s].
    """

    port: int
    spans: list[tuple[How, float, float]] = field(default_factory=list)
    passed: int = 0
    _how: How | None = None
    _ends: bool = False

    def __post_init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._held: list[tuple[socket.socket, bytes]] = []
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self._lock = threading.Lock()
        self._listener: socket.socket | None = None
        self.own_port = self._listen(0)
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def breaks(self, how: How, for_s: float) -> None:
        """Break it for a time [s]; returns when it is whole again."""
        began_s = time.monotonic()
        with self._lock:
            self._how = how
            if how in ("reset", "refuse"):
                self._cut()
            if how == "refuse":
                self._close_listener()
        time.sleep(for_s)
        with self._lock:
            self._how = None
            if how == "refuse":
                self._listen(self.own_port)
            for receiver, data in self._held:
                with suppress(OSError):
                    receiver.sendall(data)
            self._held.clear()
        self.spans.append((how, began_s, time.monotonic()))

    def close(self) -> None:
        self._ends = True
        self._thread.join()
        with self._lock:
            self._cut()
            self._close_listener()

    def _listen(self, port: int) -> int:
        self._listener = socket.create_server(("127.0.0.1", port))
        self._selector.register(self._listener, selectors.EVENT_READ)
        return int(self._listener.getsockname()[1])

    def _close_listener(self) -> None:
        if self._listener is not None:
            self._selector.unregister(self._listener)
            self._listener.close()
            self._listener = None

    def _cut(self) -> None:
        """Reset every connection, without goodbye."""
        for pair in self._pairs:
            for end in pair:
                self._reset(end)
        self._pairs.clear()

    def _reset(self, end: socket.socket) -> None:
        with suppress(KeyError, ValueError):
            self._selector.unregister(end)
        with suppress(OSError):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        end.close()

    def _serve(self) -> None:
        while not self._ends:
            for key, _ in self._selector.select(0.02):
                with self._lock:
                    if key.fileobj is self._listener:
                        self._accept()
                    elif isinstance(key.fileobj, socket.socket) and key.fileobj.fileno() >= 0:
                        self._hand_on(key.fileobj)

    def _accept(self) -> None:
        assert self._listener is not None
        client, _ = self._listener.accept()
        if self._how == "reset":
            self._reset(client)
            return
        device = socket.create_connection(("127.0.0.1", self.port))
        self._pairs.append((client, device))
        for end in (client, device):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._selector.register(end, selectors.EVENT_READ)

    def _hand_on(self, end: socket.socket) -> None:
        pair = next((pair for pair in self._pairs if end in pair), None)
        if pair is None:
            return
        try:
            data = end.recv(65536)
        except OSError:
            data = b""
        if not data:
            self._pairs.remove(pair)
            for one in pair:
                self._reset(one)
            return
        to_client = end is pair[1]
        receiver = pair[0] if to_client else pair[1]
        if self._how == "hold":
            self._held.append((receiver, data))
        elif self._how == "drop" or (self._how == "deaf" and to_client):
            return
        else:
            self.passed += len(data)
            with suppress(OSError):
                receiver.sendall(data)


@contextmanager
def broken_wire(port: int) -> Iterator[BrokenWire]:
    wire = BrokenWire(port)
    try:
        yield wire
    finally:
        wire.close()
