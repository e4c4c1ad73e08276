"""The controller's samples as points of 10 ms, with each channel moved by the delay that is stated of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.foundation.channels import STROKE_CHANNELS

Floats = NDArray[np.float64]

POINT_S = 0.01
"""Samples of so long a time are averaged to a point [s]: what is linear in them is not changed by that."""
JUDGED_S = 0.05
"""Points are handed on so often [s of device time]: judging each pass would cost more than it shows."""
KEPT_S = 8.0
"""So long points are kept [s]."""
GAP_S = 0.1
"""A longer gap between points begins anew [s]: what happened in it is not known."""
LEAST_DELAY_S = 0.001
"""A delay of less moves nothing by as much as a point [s]."""


class SamplePoints:
    """Collects blocks of the controller, and keeps the last seconds as points.

    Parameters
    ----------
    delays_s : mapping of str to float
        Stated delay of each channel: a value was true so long before its time stamp.

    Attributes
    ----------
    names : tuple of str
        Channels there are: ``command``, ``position``, the draw wires, ``force``.
    table : NDArray, shape (n, 1 + channels)
        Time [s of the device's clock] and channels, oldest first.
    new : int
        So many of its last rows came with the last block that was taken.
    """

    def __init__(self, delays_s: Mapping[str, float]) -> None:
        self._delays_s = delays_s
        self._pending: list[Floats] = []
        self._began_s = 0.0
        self.names: tuple[str, ...] = ()
        self.table: Floats = np.empty((0, 1))
        self.new = 0
        self._raw: Floats = np.empty((0, 1))
        self._moved: tuple[tuple[int, float], ...] = ()
        self._latest_s = 0.0

    def take(self, block: ScaledBlock) -> bool:
        """Take a block; return whether there are new points to look at."""
        if not len(block):
            return False
        if not self.names:
            self._begin(block)
        if any(name not in block.values for name in self.names):
            return False
        part = np.stack([block.time_us * 1e-6, *(block.values[name] for name in self.names)], axis=1)
        if not self._pending:
            self._began_s = float(part[0, 0])
        self._pending.append(part)
        if part[-1, 0] - self._began_s < JUDGED_S:
            return False
        return self._hand_on()

    def take_rest(self) -> bool:
        """Hand on what has come since, though it is less than usual; return whether there are new points."""
        return bool(self._pending) and self._hand_on()

    @property
    def span_s(self) -> float:
        """Return how long a time the points cover [s]."""
        return float(self.table[-1, 0] - self.table[0, 0]) if len(self.table) else 0.0

    def last(self, span_s: float) -> Floats:
        """Return the rows of the last ``span_s`` seconds; none where there was a gap within them."""
        if not len(self.table):
            return self.table
        rows = self.table[int(np.searchsorted(self.table[:, 0], self.table[-1, 0] - span_s)) :]
        if len(rows) < 2 or float(np.max(np.diff(rows[:, 0]))) > GAP_S:
            return rows[:0]
        return rows

    def newest(self, span_s: float) -> Floats:
        """Return the last ``span_s`` seconds as they came, not moved by delays, up to the last sample.

        Returns
        -------
        NDArray, shape (n, 1 + channels)
            Points, and what is no point yet as means of as long a time.
        """
        waiting = [part.mean(axis=0, keepdims=True) for part in _parts(self._pending)]
        rows = np.concatenate((self._raw, *waiting)) if len(self._raw) or waiting else self._raw
        return rows[rows[:, 0] >= rows[-1, 0] - span_s] if len(rows) else rows

    def column(self, name: str) -> int | None:
        """Return the column of a channel in a row; None where there is none."""
        return 1 + self.names.index(name) if name in self.names else None

    @property
    def wires(self) -> tuple[str, ...]:
        """Return the draw wires there are."""
        return tuple(name for name in self.names if name.startswith("stroke"))

    def _begin(self, block: ScaledBlock) -> None:
        wires: Sequence[str] = [name for name in STROKE_CHANNELS if name in block.values] or ["stroke"]
        wanted = ("command", "position", *wires, "force")
        self.names = tuple(name for name in wanted if name in block.values)
        delays = [self._delays_s.get(name, 0.0) for name in self.names]
        self._moved = tuple(
            (column, delay_s) for column, delay_s in enumerate(delays, start=1) if delay_s > LEAST_DELAY_S
        )
        self._latest_s = max((delay_s for _, delay_s in self._moved), default=0.0)
        self.table = self._raw = np.empty((0, 1 + len(self.names)))

    def _hand_on(self) -> bool:
        rows = np.concatenate(self._pending)
        self._pending.clear()
        self.new = 0
        if len(self._raw) and rows[0, 0] <= self._raw[-1, 0]:  # its clock was set back
            self.table = self._raw = self.table[:0]
        bins = np.floor(rows[:, 0] / POINT_S).astype(np.int64)
        starts = np.flatnonzero(np.diff(bins, prepend=bins[0] - 1))
        if len(starts) > 1:  # the last point may not be whole yet
            self._pending.append(rows[starts[-1] :])
            self._began_s = float(rows[starts[-1], 0])
            rows, starts = rows[: starts[-1]], starts[:-1]
        counts = np.diff(np.append(starts, len(rows)))[:, np.newaxis]
        points = np.add.reduceat(rows, starts, axis=0) / counts
        self._raw = _kept(np.concatenate((self._raw, points)), KEPT_S + self._latest_s)
        fresh = self._aligned()
        self.new = len(fresh)
        if self.new:
            self.table = _kept(np.concatenate((self.table, fresh)), KEPT_S)
        return self.new > 0

    def _aligned(self) -> Floats:
        """Return the points that can be moved by their delays by now and were not yet."""
        since_s = self.table[-1, 0] if len(self.table) else -np.inf
        time_s = self._raw[:, 0]
        due = (time_s > since_s) & (time_s <= time_s[-1] - self._latest_s)
        fresh = self._raw[due]
        for column, delay_s in self._moved:
            fresh[:, column] = np.interp(fresh[:, 0] + delay_s, time_s, self._raw[:, column])
        return np.asarray(fresh)


def _parts(pending: Sequence[Floats]) -> list[Floats]:
    """Return samples that are no points yet, those of one point together."""
    if not pending:
        return []
    rows = np.concatenate(pending)
    bins = np.floor(rows[:, 0] / POINT_S).astype(np.int64)
    return np.split(rows, np.flatnonzero(np.diff(bins)) + 1)


def _kept(table: Floats, span_s: float) -> Floats:
    return np.asarray(table[int(np.searchsorted(table[:, 0], table[-1, 0] - span_s)) :])
