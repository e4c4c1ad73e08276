"""Least and greatest values of every channel over a whole campaign, in a store that does not grow.

Each level has :data:`BUCKETS` buckets, each four times as wide as those of the level below: the last minutes
are there finely, the first hours of a long campaign coarsely. No sample's extreme is ever lost.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.monitor.sample_rows import finite

FINEST_S = 0.1
"""Width of the finest buckets [s of stand time]."""
COARSER = 4
LEVELS = 8
"""The coarsest level holds 38 days."""
BUCKETS = 2000
MOST_CHANNELS = 40
MOST_POINTS = 1000
"""Of an answer: more than a screen has columns for a chart."""
BACK_S = 1.0
"""Where time goes back by more than this, another start has begun [s]."""


class _Level:
    """A ring of buckets of one width."""

    def __init__(self, width_s: float) -> None:
        self.width_s = width_s
        self._number = np.full(BUCKETS, -1, dtype=np.int64)
        self._values: dict[str, NDArray[np.float64]] = {}
        self.newest = -1

    def add(self, at_s: float, extremes: Mapping[str, tuple[float, float]]) -> None:
        number = max(math.floor(at_s / self.width_s), self.newest)
        place = number % BUCKETS
        fresh = self._number[place] != number
        if fresh:
            self._number[place], self.newest = number, number
            for kept in self._values.values():
                kept[:, place] = np.nan
        for name, (low, high) in extremes.items():
            values = self._of(name)
            if values is None:
                continue
            values[0, place] = np.fmin(values[0, place], low)
            values[1, place] = np.fmax(values[1, place], high)

    def _of(self, name: str) -> NDArray[np.float64] | None:
        known = self._values.get(name)
        if known is None and len(self._values) < MOST_CHANNELS:
            known = self._values[name] = np.full((2, BUCKETS), np.nan)
        return known

    def within(self, from_s: float, to_s: float) -> NDArray[np.int64]:
        """Return the numbers of the buckets that lie in a span, rising."""
        held = self._number[self._number >= 0]
        begin_s = held * self.width_s
        return np.sort(held[(begin_s + self.width_s > from_s) & (begin_s <= to_s)])

    def values(self, name: str, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the least and greatest values of a channel in buckets, shape (2, N)."""
        kept = self._values.get(name)
        return np.full((2, numbers.size), np.nan) if kept is None else kept[:, numbers % BUCKETS]

    @property
    def bytes(self) -> int:
        return self._number.nbytes + sum(kept.nbytes for kept in self._values.values())


class History:
    """Keeps and gives the extremes of channels over stand time."""

    def __init__(self) -> None:
        self._units: dict[str, str] = {}
        self.clear()

    def clear(self) -> None:
        """Forget everything: another start has begun."""
        self._levels = [_Level(FINEST_S * COARSER**n) for n in range(LEVELS)]
        self._first_s: float | None = None
        self._last_s = -math.inf

    def name(self, channels: Iterable[Mapping[str, Any]]) -> None:
        """Take names and units of channels: every one of the stand, and those that are derived."""
        self._units = {str(one["name"]): str(one["unit"]) for one in channels}

    def add(self, at_s: float, extremes: Mapping[str, Sequence[float | None]]) -> None:
        """Take the least and greatest values since the last call.

        Parameters
        ----------
        at_s : float
            Stand time [s].
        extremes : mapping of str to (float or None, float or None)
            By channel, in its unit; None where there is none.
        """
        if at_s < self._last_s - BACK_S:
            self.clear()
        known = {
            name: (float(low), float(high))
            for name, (low, high) in extremes.items()
            if low is not None and high is not None
        }
        if not known:
            return
        self._first_s = at_s if self._first_s is None else self._first_s
        self._last_s = max(self._last_s, at_s)
        for level in self._levels:
            level.add(at_s, known)

    def span(self, from_s: float, to_s: float, channels: Sequence[str]) -> dict[str, Any]:
        """Return what a chart of a span shows.

        Parameters
        ----------
        from_s, to_s : float
            Stand time [s]; the infinite ones reach to what there is.
        channels : sequence of str

        Returns
        -------
        dict
            ``t`` (middle of each bucket, s), ``values`` by channel (``low``, ``high``; None where nothing was
            read), ``width_s`` of a bucket, ``first_s`` and ``last_s`` of all, and the ``channels`` there are
            with their ``unit``. Of the finest level that holds the span in at most :data:`MOST_POINTS`.
        """
        common = {"channels": [{"name": name, "unit": unit} for name, unit in self._units.items()]}
        if self._first_s is None:
            return {**common, "t": [], "values": {}, "width_s": None, "first_s": None, "last_s": None}
        from_s, to_s = max(from_s, self._first_s), min(to_s, self._last_s)
        level, numbers = self._fitting(from_s, to_s)
        values = {}
        for name in channels:
            if name in self._units:
                low, high = level.values(name, numbers)
                values[name] = {"low": [finite(v) for v in low], "high": [finite(v) for v in high]}
        return {
            **common,
            "t": np.round((numbers + 0.5) * level.width_s, 3).tolist(),
            "values": values,
            "width_s": level.width_s,
            "first_s": self._first_s,
            "last_s": self._last_s,
        }

    def _fitting(self, from_s: float, to_s: float) -> tuple[_Level, NDArray[np.int64]]:
        for level in self._levels:
            numbers = level.within(from_s, to_s)
            whole = numbers.size and numbers[0] * level.width_s <= from_s
            if whole and numbers.size <= MOST_POINTS:
                return level, numbers
        return level, level.within(from_s, to_s)[-MOST_POINTS:]

    @property
    def bytes(self) -> int:
        """Return what its buckets take."""
        return sum(level.bytes for level in self._levels)
