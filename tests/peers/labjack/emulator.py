"""The device with its two ports, in a thread of its own; faults are asked for from outside."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Mapping
from types import TracebackType

from tests.peers.labjack.device import LabJack, Signal
from tests.peers.labjack.stream import ETHERNET, Habits
from tests.peers.labjack.wire import CommandConnection, StreamConnection

HOST = "127.0.0.1"
TICK_S = 0.002
UNSENT = 1 << 16
"""Bytes that may wait in a connection; more stay in the device's own buffer."""


class LabJackEmulator:
    """A T7 or T8 on two loopback ports; a context manager.

    Parameters
    ----------
    inputs : mapping of int to Signal
        Volts of an AIN for true times [s] (:meth:`now_s`), arrays in and out; others read 0 V.
    product : {7, 8}
    drift : float
        By how much its clock is faster than the computer's.
    habits : Habits, optional
        What the documents leave open.
    port, stream_port : int
        0 takes free ones.

    Attributes
    ----------
    device : LabJack
        ``outputs`` of it are the digital lines that were written.
    """

    def __init__(
        self,
        inputs: Mapping[int, Signal],
        *,
        product: int = 7,
        drift: float = 0.0,
        habits: Habits | None = None,
        port: int = 0,
        stream_port: int = 0,
    ) -> None:
        self._begun = time.monotonic()
        self.device = LabJack(product, inputs, self.now_s, drift, habits)
        self.port, self.stream_port = port, stream_port
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name="labjack emulator", daemon=True)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ended: asyncio.Event | None = None
        self._commands: set[asyncio.Transport] = set()
        self._listeners: set[asyncio.Transport] = set()
        self._replies_lost = 0
        self._late_s = 0.0
        self._held_until = 0.0
        self._packets_lost = 0
        self.packets = 0
        """Packets sent."""

    def now_s(self) -> float:
        """Return the true time since it was made [s]."""
        return time.monotonic() - self._begun

    def lose_replies(self, count: int) -> None:
        """Do the next requests, and lose the replies."""
        self._replies_lost = count

    def delay_replies(self, seconds: float) -> None:
        """Send each reply that much later, from now on; 0 ends it."""
        self._late_s = seconds

    def hold_packets(self, seconds: float) -> None:
        """Send no packets for so long, as a network does that stands still: the buffer may overflow."""
        self._held_until = self.now_s() + seconds

    def lose_packets(self, count: int) -> None:
        """Lose the next packets of the stream."""
        self._packets_lost = count

    def overlap_scan(self) -> None:
        """Have a scan take too long: status 2942, and the stream ends."""
        if self.device.stream is not None:
            self.device.stream.overlap()

    def cut(self) -> None:
        """Cut every connection; it can be connected to again."""
        self._in_loop(lambda: [one.abort() for one in (*self._commands, *self._listeners)])

    def __enter__(self) -> LabJackEmulator:
        """Listen."""
        self._thread.start()
        if not self._ready.wait(10.0):
            raise RuntimeError("the emulator has not begun to listen")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let go of both ports."""
        self._in_loop(lambda: self._ended.set() if self._ended else None)
        self._thread.join(10.0)

    def _in_loop(self, do: Callable[[], object]) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(do)

    def _run(self) -> None:
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._loop, self._ended = asyncio.get_running_loop(), asyncio.Event()
        commands = await self._loop.create_server(
            lambda: CommandConnection(self.device, self._deliver, self._commands), HOST, self.port
        )
        stream = await self._loop.create_server(
            lambda: StreamConnection(self._listeners), HOST, self.stream_port
        )
        self.port = commands.sockets[0].getsockname()[1]
        self.stream_port = stream.sockets[0].getsockname()[1]
        self._ready.set()
        while not self._ended.is_set():
            self._pump()
            await asyncio.sleep(TICK_S)
        for server in (commands, stream):
            server.close()
        for one in (*self._commands, *self._listeners):
            one.abort()
        await asyncio.sleep(0)
        for server in (commands, stream):
            await server.wait_closed()

    def _pump(self) -> None:
        """Take the scans that are due, and send what makes packets."""
        stream = self.device.stream
        if stream is None:
            return
        stream.advance(self.now_s())
        if stream.plan.target != ETHERNET or self.now_s() < self._held_until or not self._listeners:
            return
        while all(one.get_write_buffer_size() < UNSENT for one in self._listeners):
            packet = stream.packet()
            if packet is None:
                return
            if self._packets_lost:
                self._packets_lost -= 1
                continue
            self.packets += 1
            for one in self._listeners:
                one.write(packet)

    def _deliver(self, reply: bytes, send: Callable[[bytes], None]) -> None:
        if self._replies_lost:
            self._replies_lost -= 1
        elif self._late_s and self._loop is not None:
            self._loop.call_later(self._late_s, send, reply)
        else:
            send(reply)
