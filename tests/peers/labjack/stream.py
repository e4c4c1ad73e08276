"""The stream: a scan clock, a buffer that can overflow, packets. T-Series Datasheet 3.2 and 3.2.4.

What the documents read do not say is a parameter of :class:`Habits`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ETHERNET, COMMAND_RESPONSE = 0x01, 0x10
MOST_PER_PACKET = 512
DEFAULT_BUFFER, LARGEST_BUFFER = 4096, 262144
RECOVERING, RECOVERED, SCAN_OVERLAP, RECOVERY_OVERFLOW, BURST_COMPLETE, BUFFER_FULL = range(2940, 2946)
DUMMY = 0xFFFF


@dataclass(frozen=True)
class Habits:
    """What the documents leave open.

    Parameters
    ----------
    dummy_is_counted : bool
        Whether the scan of 0xFFFF behind an overflow is one of the scans that are said to be skipped (of the
        U3's stream that is said; of the T-series' it is not).
    channel_interval_us : float
        From one channel of a scan to the next [µs]; a T8 takes all at once.
    """

    dummy_is_counted: bool = True
    channel_interval_us: float = 15.0


@dataclass(frozen=True)
class StreamPlan:
    """What was set up when a stream was enabled."""

    rate_Hz: float
    addresses: tuple[int, ...]
    samples_per_packet: int
    buffer_bytes: int
    target: int
    scans: int
    recovers: bool


class Stream:
    """A running stream.

    Parameters
    ----------
    plan : StreamPlan
    sample : callable
        Gives the 16 bits of every channel, shape (scans, channels), for the true times of scans [s].
    start_s : float
        True time at which it was enabled; the first scan comes one period later.
    drift : float
        By how much the device's clock is faster than the true one.
    habits : Habits
    """

    def __init__(
        self,
        plan: StreamPlan,
        sample: Callable[[NDArray[np.float64]], NDArray[np.uint16]],
        start_s: float,
        drift: float,
        habits: Habits,
    ) -> None:
        self.plan = plan
        self.running = True
        self.scans = 0  # that the clock has asked for
        self._sample = sample
        self._start_s = start_s
        self._true_rate_Hz = plan.rate_Hz * (1.0 + drift)
        self._habits = habits
        self._buffer = bytearray()
        self._recovering = False
        self._skipped = 0
        self._due: list[tuple[int, int, int]] = []  # bytes before it, status, additional
        self._ends_with = 0
        self._transaction = 0

    def scan_time_s(self, scan: int) -> float:
        """Return the true time of a scan, counted from 0 [s]."""
        return self._start_s + (scan + 1) / self._true_rate_Hz

    @property
    def backlog(self) -> int:
        """Bytes that wait."""
        return len(self._buffer)

    def advance(self, now_s: float) -> None:
        """Take the scans that are due by now."""
        due = int((now_s - self._start_s) * self._true_rate_Hz) - self.scans
        if not self.running or due <= 0:
            return
        if self.plan.scans:
            due = min(due, self.plan.scans - self.scans)
        while due > 0 and self.running:
            size = 2 * len(self.plan.addresses)
            fit = min(due, max(0, (self.plan.buffer_bytes - len(self._buffer)) // size))
            if self._recovering or not fit:
                due = self._overflow(due)
                continue
            times = self._start_s + (np.arange(fit) + self.scans + 1) / self._true_rate_Hz
            self._buffer += self._sample(times).astype(">u2").tobytes()
            self.scans += fit
            due -= fit
        if self.plan.scans and self.scans >= self.plan.scans:
            self.running, self._ends_with = False, BURST_COMPLETE

    def _overflow(self, due: int) -> int:
        if not self.plan.recovers:
            self.running, self._ends_with = False, BUFFER_FULL
            return due
        self._recovering = True
        self.scans += due
        self._skipped += due
        return 0

    def overlap(self) -> None:
        """A scan took longer than the period: the stream says so and ends."""
        self.running, self._ends_with = False, SCAN_OVERLAP

    def packet(self) -> bytes | None:
        """Return the next packet of a spontaneous stream; None while there is not enough for one."""
        wanted = 2 * self.plan.samples_per_packet
        if len(self._buffer) < wanted and self._recovering:
            self._recover()
        if len(self._buffer) < wanted and not (not self.running and (self._buffer or self._ends_with)):
            return None
        data, status, additional = self._take(min(wanted, len(self._buffer)))
        head = struct.pack(">HHHBBBB", self._transaction, 0, 10 + len(data), 1, 76, 16, 0)
        self._transaction = (self._transaction + 1) & 0xFFFF
        return head + struct.pack(">HHH", min(len(self._buffer), 0xFFFF), status, additional) + data

    def answer(self, registers: int) -> bytes:
        """Return what a read of ``STREAM_DATA_CR`` gives: four registers of header, then samples."""
        if self._recovering and len(self._buffer) < 2 * (registers - 4):
            self._recover()
        data, status, additional = self._take(min(2 * (registers - 4), len(self._buffer)))
        head = struct.pack(">4H", len(data) // 2, min(len(self._buffer), 0xFFFF), status, additional)
        return (head + data).ljust(2 * registers, b"\0")

    def drop(self) -> None:
        """Lose the next packet: its number is used up."""
        self.packet()

    def _recover(self) -> None:
        """End the overflow: a scan of 0xFFFF parts old from new, and the skipped ones are told."""
        skipped = self._skipped - (0 if self._habits.dummy_is_counted else 1)
        overflow = skipped > 0xFFFF
        status = RECOVERY_OVERFLOW if overflow else RECOVERED
        self._due.append((len(self._buffer), status, min(skipped, 0xFFFF)))
        self._buffer += struct.pack(">H", DUMMY) * len(self.plan.addresses)
        self._recovering, self._skipped = False, 0

    def _take(self, size: int) -> tuple[bytes, int, int]:
        data = bytes(self._buffer[:size])
        del self._buffer[:size]
        status, additional = (RECOVERING if self._recovering else 0), 0
        if self._due and self._due[0][0] < size:
            _, status, additional = self._due.pop(0)
        self._due = [(before - size, one, more) for before, one, more in self._due]
        if not self.running and not self._buffer and self._ends_with:
            status, additional, self._ends_with = self._ends_with, len(data) // 2, 0
        return data, status, additional
