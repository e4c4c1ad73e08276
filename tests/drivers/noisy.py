"""Wires that lose, delay, double, reorder and alter what goes over them: between a client and a server."""

from __future__ import annotations

import os
import random
import select
import socket
import struct
import threading
import tty
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

KINDS = ("drop", "delay", "double", "corrupt")


class Noise:
    """Decides what happens to each frame: each kind with the same share, at most one of them at a time."""

    def __init__(self, seed: int, share: float, delay_s: float) -> None:
        self._random = random.Random(seed)
        self._share = share
        self._delay_s = delay_s
        self._lock = threading.Lock()
        self.done: Counter[str] = Counter()

    def disturb(self, frame: bytes) -> list[tuple[float, bytes]]:
        """Return what arrives of a frame: how much later, and its bytes."""
        with self._lock:
            number = int(self._random.random() / self._share) if self._share else len(KINDS)
            kind = KINDS[number] if number < len(KINDS) else "pass"
            self.done[kind] += 1
            match kind:
                case "drop":
                    return []
                case "delay":  # up to three timeouts: replies overtake each other
                    return [(self._random.uniform(0.2, 3.0) * self._delay_s, frame)]
                case "double":
                    return [(0.0, frame), (self._random.choice((0.0, 0.3 * self._delay_s)), frame)]
                case "corrupt":
                    return [(0.0, self._altered(frame))]
                case _:
                    return [(0.0, frame)]

    def _altered(self, frame: bytes) -> bytes:
        altered = bytearray(frame)
        for _ in range(self._random.choice((1, 1, 2, 5))):
            altered[self._random.randrange(len(altered))] ^= self._random.randrange(1, 256)
        return bytes(altered)


class _Sender:
    """Sends frames now or later; what is late does not hold up what follows."""

    def __init__(self, send: Callable[[bytes], object]) -> None:
        self._send = send
        self._lock = threading.Lock()
        self._timers: list[threading.Timer] = []

    def pass_on(self, arrivals: list[tuple[float, bytes]]) -> None:
        for delay_s, frame in arrivals:
            if delay_s > 0.0:
                timer = threading.Timer(delay_s, self._now, (frame,))
                timer.daemon = True
                self._timers = [t for t in self._timers if t.is_alive()]
                self._timers.append(timer)
                timer.start()
            else:
                self._now(frame)

    def _now(self, frame: bytes) -> None:
        with self._lock, suppress(OSError):  # the wire has been closed meanwhile: it never arrives
            self._send(frame)

    def close(self) -> None:
        for timer in self._timers:
            timer.cancel()
        for timer in self._timers:
            timer.join()


class NoisyTcp:
    """Passes frames of Modbus TCP on between clients and one server, frame by frame."""

    def __init__(self, port: int, noise: Noise) -> None:
        self._target = port
        self._noise = noise
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._wires: list[socket.socket] = []
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._threads[0].join()
        self._listener.close()
        for wire in self._wires:
            with suppress(OSError):
                wire.shutdown(socket.SHUT_RDWR)
        for thread in self._threads[1:]:
            thread.join()
        for wire in self._wires:
            wire.close()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            far = socket.create_connection(("127.0.0.1", self._target))
            for wire in (near, far):
                wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._threads = [self._threads[0], *(t for t in self._threads[1:] if t.is_alive())]
            self._wires = [w for w in self._wires if w.fileno() >= 0] + [near, far]
            for source, sink in ((near, far), (far, near)):
                thread = threading.Thread(target=self._carry, args=(source, sink))
                self._threads.append(thread)
                thread.start()

    def _carry(self, source: socket.socket, sink: socket.socket) -> None:
        sender = _Sender(sink.sendall)
        try:
            while (head := _receive(source, 6)) is not None:
                body = _receive(source, struct.unpack(">H", head[4:6])[0])
                if body is None:
                    break
                sender.pass_on(self._noise.disturb(head + body))
        except OSError:
            pass
        finally:
            sender.close()
            for wire in (source, sink):
                with suppress(OSError):
                    wire.shutdown(socket.SHUT_RDWR)
            source.close()


def _receive(wire: socket.socket, size: int) -> bytes | None:
    data = b""
    while len(data) < size:
        part = wire.recv(size - len(data))
        if not part:
            return None
        data += part
    return data


class NoisyLine:
    """A serial line between two pseudo-terminals: ``near`` for the client, ``far`` for the server.

    What comes in one piece is taken for a frame, as on a line the pauses between frames tell them apart.
    """

    def __init__(self, folder: Path, noise: Noise | None = None, far: Path | None = None) -> None:
        self._noise = noise or Noise(0, 0.0, 0.0)
        self._ends: list[int] = []
        self._masters: list[int] = []
        self.near = self._terminal(folder / "near")
        if far is None:
            self.far = self._terminal(folder / "far")
        else:  # the server has made its terminal already
            self.far = far
            end = os.open(far, os.O_RDWR | os.O_NOCTTY)
            self._masters.append(end)
        self._stop_read, self._stop_write = os.pipe()
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def _terminal(self, link: Path) -> Path:
        master, slave = os.openpty()
        tty.setraw(slave)
        self._masters.append(master)
        self._ends.append(slave)
        link.symlink_to(os.ttyname(slave))
        return link

    def _carry(self) -> None:
        first, second = self._masters
        senders = {
            source: _Sender(lambda data, sink=sink: os.write(sink, data))  # type: ignore[misc]
            for source, sink in ((first, second), (second, first))
        }
        while True:
            ready = select.select([first, second, self._stop_read], [], [])[0]
            if self._stop_read in ready:
                break
            for source in ready:
                senders[source].pass_on(self._noise.disturb(os.read(source, 4096)))
        for sender in senders.values():
            sender.close()

    def close(self) -> None:
        os.write(self._stop_write, b"x")
        self._thread.join()
        for end in (*self._masters, *self._ends, self._stop_read, self._stop_write):
            os.close(end)


@contextmanager
def noisy_tcp(port: int, noise: Noise) -> Iterator[int]:
    proxy = NoisyTcp(port, noise)
    try:
        yield proxy.port
    finally:
        proxy.close()


@contextmanager
def line(folder: Path, noise: Noise | None = None, far: Path | None = None) -> Iterator[NoisyLine]:
    between = NoisyLine(folder, noise, far)
    try:
        yield between
    finally:
        between.close()
