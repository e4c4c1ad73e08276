"""The controller on Modbus TCP in real time, with what can go wrong on the wire."""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import threading
import time
from collections.abc import Callable

from tests.peers.delta_rmc.addresses import place
from tests.peers.delta_rmc.controller import RmcController

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
READS, LONGEST_WRITE = (3, 4), 123


class RmcServer:
    """Serve a controller on the loopback; its loop follows the clock. Use it in a ``with``.

    Parameters
    ----------
    controller : RmcController
    port : int
        0 for a free one, see `address`.
    clock : callable
        Seconds that the controller's loop follows.

    Attributes
    ----------
    lock : threading.Lock
        Held while the controller steps; take it to look into the controller.
    """

    def __init__(
        self, controller: RmcController, port: int = 0, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.controller, self._clock = controller, clock
        self.lock = threading.Lock()
        self._listener = socket.create_server(("127.0.0.1", port))
        self.address: tuple[str, int] = self._listener.getsockname()[:2]
        self._begun_s, self._stepped = clock(), 0
        self._ended = threading.Event()
        self._wires: set[socket.socket] = set()
        self._lost = self._late = 0
        self._late_s = 0.0
        self.requests = 0

    def __enter__(self) -> RmcServer:
        threading.Thread(target=self._accept, daemon=True).start()
        self._ticker = threading.Thread(target=self._tick, daemon=True)
        self._ticker.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        # An accept that waits is only ended by a shutdown of its socket.
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.drop()
        self._ticker.join()

    def lose(self, replies: int = 1) -> None:
        """Carry out the next requests, but send no reply."""
        self._lost = replies

    def delay(self, seconds: float, replies: int = 1) -> None:
        """Send the next replies late."""
        self._late, self._late_s = replies, seconds

    def drop(self) -> None:
        """Close every connection."""
        for wire in list(self._wires):
            with contextlib.suppress(OSError):
                wire.shutdown(socket.SHUT_RDWR)

    def reset(self) -> None:
        """Cut the controller's power for a moment."""
        with self.lock:
            self.controller.reset()
        self.drop()

    def overrun(self) -> None:
        """Let every plot run past what has been read of it."""
        with self.lock:
            for _ in range(self.controller.unsaid.plot_samples * self.controller.plots[0].period_loops + 1):
                self.controller.step()

    def _catch_up(self) -> None:
        due = math.floor((self._clock() - self._begun_s) / self.controller.loop_s)
        while self._stepped < due:
            self.controller.step()
            self._stepped += 1

    def _tick(self) -> None:
        while not self._ended.wait(0.01):
            with self.lock:
                self._catch_up()

    def _accept(self) -> None:
        while not self._ended.is_set():
            try:
                wire, _ = self._listener.accept()
            except OSError:
                return
            wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._wires.add(wire)
            threading.Thread(target=self._serve, args=(wire,), daemon=True).start()

    def _serve(self, wire: socket.socket) -> None:
        with contextlib.suppress(OSError), wire:
            while head := _exactly(wire, 7):
                transaction, protocol, length, unit = struct.unpack(">HHHB", head)
                body = _exactly(wire, length - 1)
                if protocol != 0 or not body:
                    break
                self._reply(wire, transaction, unit, body)
        self._wires.discard(wire)

    def _reply(self, wire: socket.socket, transaction: int, unit: int, body: bytes) -> None:
        with self.lock:
            self._catch_up()
            self.requests += 1
            lost, self._lost = self._lost > 0, max(self._lost - 1, 0)
            late_s = self._late_s if self._late > 0 and not lost else 0.0
            self._late -= 1 if late_s else 0
            answer = self._answer(body, lost)
        if late_s:
            time.sleep(late_s)
        if not lost:
            wire.sendall(struct.pack(">HHHB", transaction, 0, len(answer) + 1, unit) + answer)

    def _answer(self, body: bytes, lost: bool) -> bytes:
        function = body[0]
        try:
            if function not in (*READS, 6, 8, 16, 23):
                raise _ModbusError(ILLEGAL_FUNCTION)
            if function in (6, 8):
                if function == 6:
                    first, word = struct.unpack(">HH", body[1:])
                    self._write(first, [word])
                return body  # of 8: return query data
            if function == 16:
                first, count = struct.unpack(">HH", body[1:5])
                self._write(first, _words(body[6:], count))
                return body[:5]
            if function == 23:
                first, count, into, writes = struct.unpack(">HHHH", body[1:9])
                self._write(into, _words(body[10:], writes))
            else:
                first, count = struct.unpack(">HH", body[1:])
            return self._read(function, first, count, lost)
        except struct.error:
            return bytes((function | 0x80, ILLEGAL_VALUE))
        except _ModbusError as refused:
            return bytes((function | 0x80, refused.code))

    def _halves(self, bits: int) -> tuple[int, int]:
        low, high = bits & 0xFFFF, bits >> 16
        return (low, high) if self.controller.unsaid.low_word_first else (high, low)

    def _read(self, function: int, first: int, count: int, lost: bool) -> bytes:
        if not 0 < count <= self.controller.unsaid.largest_read:
            raise _ModbusError(ILLEGAL_VALUE)
        words: list[int] = []
        file, element, half = place(first + 1)  # the wire counts from 0, the manual from 1
        plot = self.controller.upload(file)
        registers = (count + half + 1) // 2
        if plot is not None and element == 0:
            values = self.controller.read_upload(plot, registers)
            if lost and not self.controller.unsaid.index_moves_when_lost:
                plot.take_back()
        else:
            values = []
            for step in range(registers):
                at = file * 256 + element + step
                values.append(self.controller.read(at // 256, at % 256))
        for value in values:
            words += self._halves(value)
        words = words[half : half + count]
        return struct.pack(f">BB{count}H", function, 2 * count, *words)

    def _write(self, first: int, words: list[int]) -> None:
        if not 0 < len(words) <= LONGEST_WRITE:
            raise _ModbusError(ILLEGAL_VALUE)
        file, element, half = place(first + 1)
        command = file in (2, self.controller.model.commands)
        if command and (half or len(words) % 2):
            # Half a command register: what it would do is not said, so it is not taken.
            raise _ModbusError(ILLEGAL_ADDRESS)
        registers: list[tuple[int, int, int]] = []
        at = file * 256 + element
        pending = list(words)
        if half:
            registers.append((file, element, self._patched(at, 1, pending.pop(0))))
            at += 1
        while len(pending) >= 2:
            one, two = pending.pop(0), pending.pop(0)
            low, high = (one, two) if self.controller.unsaid.low_word_first else (two, one)
            registers.append((at // 256, at % 256, high << 16 | low))
            at += 1
        if pending:
            registers.append((at // 256, at % 256, self._patched(at, 0, pending[0])))
        self.controller.write(registers)

    def _patched(self, at: int, half: int, word: int) -> int:
        halves = list(self._halves(self.controller.read(at // 256, at % 256)))
        halves[half] = word
        low, high = halves if self.controller.unsaid.low_word_first else reversed(halves)
        return high << 16 | low


class _ModbusError(ValueError):
    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def _words(data: bytes, count: int) -> list[int]:
    if len(data) != 2 * count:
        raise _ModbusError(ILLEGAL_VALUE)
    return list(struct.unpack(f">{count}H", data))


def _exactly(wire: socket.socket, count: int) -> bytes:
    """Give so many bytes, or none when the other end has closed."""
    data = b""
    while len(data) < count:
        more = wire.recv(count - len(data))
        if not more:
            return b""
        data += more
    return data
