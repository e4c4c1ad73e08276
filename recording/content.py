"""The content of a run, independent of its form on disk: streams, clock anchors and events."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAIN_STREAM = "controller"
"""The stream whose device clock is the clock of the run."""

MICROSECOND_S = 1e-6


def main_stream(names: Iterable[str]) -> str:
    """Return which of a run's streams leads: the controller's, or the first where none moved the stand."""
    there = list(names)
    return MAIN_STREAM if MAIN_STREAM in there or not there else there[0]


class RecordingFault(Exception):  # noqa: N818 - it names the fact
    """The recording itself cannot go on or cannot be finished: disk full, disk failed, queue overrun.

    What was acknowledged before is safe in the journal, which is named in the text.
    """


@dataclass(frozen=True)
class Segment:
    """A stretch of rows that follow each other without a known interruption.

    Parameters
    ----------
    first_row : int
        Its first row in the stream.
    first_sequence : int
        The device's sequence number of that row; the rows of a segment count up by one.
    lost : int
        Samples known to be lost before it (0 for the first, and where the number is not known).
    """

    first_row: int
    first_sequence: int
    lost: int


@dataclass(frozen=True)
class StreamContent:
    """The samples of one device.

    Parameters
    ----------
    time : NDArray
        int64 time stamps [µs] as received (device clock, or host's stand time), or float64 times [s] of an
        imported record; shape (n,).
    counts : mapping of str to NDArray
        Raw numbers by channel, shape (n,) each, as delivered.
    segments : sequence of Segment
        Where rows follow each other without interruption; the first begins at row 0 (none if n = 0).
    """

    time: NDArray[np.int64] | NDArray[np.float64]
    counts: Mapping[str, NDArray[Any]]
    segments: Sequence[Segment] = ()

    def __post_init__(self) -> None:
        rows = len(self.time)
        for name, column in self.counts.items():
            if column.shape != (rows,):
                raise ValueError(f"channel {name} has shape {column.shape}, its time stamps ({rows},)")
        if rows and not self.segments:
            object.__setattr__(self, "segments", (Segment(0, 0, 0),))

    @property
    def rows(self) -> int:
        """Number of samples."""
        return len(self.time)


@dataclass(frozen=True)
class Anchor:
    """One moment on three clocks: device [µs], host's stand time [s] at reception, UTC (ISO 8601)."""

    device_us: int
    host_s: float
    utc: str

    @property
    def ahead_s(self) -> float:
        """Get by how much the host's clock was ahead of the device's then [s]."""
        return self.host_s - self.device_us / 1e6


@dataclass(frozen=True)
class Event:
    """Something that happened at ``at_s`` of the host's stand time [s]."""

    at_s: float
    kind: str
    text: str
    data: Mapping[str, Any] = field(default_factory=dict)


def add_segment(segments: list[Segment], segment: Segment) -> None:
    """Add a segment to a stream's, unless it merely continues the last one without a gap."""
    if segments and segment.lost == 0:
        last = segments[-1]
        if segment.first_sequence - last.first_sequence == segment.first_row - last.first_row:
            return
    segments.append(segment)


def gaps_of(segments: Sequence[Segment]) -> list[tuple[int, int]]:
    """Return the interruptions as (row before it, samples lost).

    The number is the larger of the jump of the sequence and what the device reported; it is 0 where an
    interruption is known but not its size (sequence restarted, time stamp repeated or stepped back).
    """
    gaps = []
    for before, after in pairwise(segments):
        expected = before.first_sequence + after.first_row - before.first_row
        gaps.append((after.first_row - 1, max(after.lost, after.first_sequence - expected, 0)))
    return gaps
