"""Least and greatest values of every channel over a whole campaign, in a store that does not grow.

Each level has :data:`BUCKETS` buckets, each four times as wide as those of the level below: the last minutes
are there finely, the first hours of a long campaign coarsely. No sample's extreme is ever lost. What was
before a server came is put together elsewhere and taken in as a whole (:mod:`.recorded`).
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.monitor.past.answers import MOST_POINTS, answer
from bufferstand.daq.monitor.past.buckets import Extremes, bucketed, coarser

FINEST_S = 0.1
"""Width of the finest buckets [s of stand time]."""
COARSER = 4
LEVELS = 8
"""The coarsest level holds 38 days."""
BUCKETS = 2000
MOST_CHANNELS = 40
BACK_S = 1.0
"""Where time goes back by more than this, another start has begun [s]."""
NONE = -(1 << 62)
"""Number of a bucket that holds nothing."""


class _Level:
    """A ring of buckets of one width."""

    def __init__(self, width_s: float) -> None:
        self.width_s = width_s
        self.number = np.full(BUCKETS, NONE, dtype=np.int64)
        self.kept: dict[str, NDArray[np.float64]] = {}
        self.newest = NONE

    def add(self, at_s: float, extremes: Mapping[str, tuple[float, float]]) -> None:
        number = max(math.floor(at_s / self.width_s), self.newest)
        place = number % BUCKETS
        fresh = self.number[place] != number
        if fresh:
            self.number[place], self.newest = number, number
            for kept in self.kept.values():
                kept[:, place] = np.nan
        for name, (low, high) in extremes.items():
            values = self._of(name)
            if values is None:
                continue
            values[0, place] = np.fmin(values[0, place], low)
            values[1, place] = np.fmax(values[1, place], high)

    def take(self, numbers: NDArray[np.int64], extremes: Extremes) -> None:
        """Take many buckets, rising, each once; those that are older than what their place holds go."""
        numbers = numbers[-BUCKETS:]
        place = numbers % BUCKETS
        fresh = self.number[place] < numbers
        for kept in self.kept.values():
            kept[:, place[fresh]] = np.nan
        self.number[place[fresh]] = numbers[fresh]
        ours = self.number[place] == numbers
        self.newest = max(self.newest, int(numbers[-1]))
        for name, (low, high) in extremes.items():
            values = self._of(name)
            if values is not None:
                values[0, place[ours]] = np.fmin(values[0, place[ours]], low[-BUCKETS:][ours])
                values[1, place[ours]] = np.fmax(values[1, place[ours]], high[-BUCKETS:][ours])

    def _of(self, name: str) -> NDArray[np.float64] | None:
        known = self.kept.get(name)
        if known is None and len(self.kept) < MOST_CHANNELS:
            known = self.kept[name] = np.full((2, BUCKETS), np.nan)
        return known

    def held(self) -> NDArray[np.int64]:
        """Return the numbers of all buckets between which none was lost, rising."""
        return np.sort(self.number[self.number > max(self.newest - BUCKETS, NONE)])

    def within(self, from_s: float, to_s: float) -> NDArray[np.int64]:
        """Return the numbers of the buckets that lie in a span, rising."""
        held = self.held()
        begin_s = held * self.width_s
        return held[(begin_s + self.width_s > from_s) & (begin_s <= to_s)]

    def reaches(self, from_s: float) -> bool:
        """Return whether nothing behind a time was lost to newer buckets."""
        held = self.held()
        return bool(held.size) and held[0] * self.width_s <= from_s

    def values(self, name: str, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the least and greatest values of a channel in buckets, shape (2, N)."""
        kept = self.kept.get(name)
        return np.full((2, numbers.size), np.nan) if kept is None else kept[:, numbers % BUCKETS]

    @property
    def bytes(self) -> int:
        return self.number.nbytes + sum(kept.nbytes for kept in self.kept.values())


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

    def name_further(self, units: Mapping[str, str]) -> None:
        """Take units of channels by name, behind those that are there."""
        self._units = {**self._units, **{k: u for k, u in units.items() if k not in self._units}}

    @property
    def first_s(self) -> float | None:
        """Get the stand time at which it begins [s], None where it is empty."""
        return self._first_s

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
        self._widen(at_s, at_s)
        for level in self._levels:
            level.add(at_s, known)

    def take(self, time_s: NDArray[np.float64], values: Mapping[str, NDArray[np.float64]]) -> None:
        """Take many samples, also such as lie before what is there.

        Parameters
        ----------
        time_s : NDArray[float64]
            Stand time [s], rising, shape (n,); negative before the start that is under way.
        values : mapping of str to NDArray[float64]
            By channel, in its unit, shape (n,) each.
        """
        if not time_s.size:
            return
        self._widen(float(time_s[0]), float(time_s[-1]))
        numbers, extremes = bucketed(time_s, values, FINEST_S)
        for level in self._levels:
            level.take(numbers, extremes)
            numbers, extremes = coarser(numbers, extremes, COARSER)

    def merge(self, other: History) -> None:
        """Take in what another one holds of the same stand time: of no sample the extremes get lost."""
        if other._first_s is None:
            return
        self._widen(other._first_s, other._last_s)
        for own, its in zip(self._levels, other._levels, strict=True):
            numbers = its.held()
            if numbers.size:
                found = {name: its.values(name, numbers) for name in its.kept}
                own.take(numbers, {name: (low, high) for name, (low, high) in found.items()})
        self._units = {**other._units, **self._units}

    def forget_before(self, at_s: float) -> None:
        """Forget all buckets that begin before a time [s]."""
        if self._first_s is None or self._first_s >= at_s:
            return
        for level in self._levels:
            level.number[level.number * level.width_s < at_s - level.width_s] = NONE
        self._first_s = at_s

    def _widen(self, first_s: float, last_s: float) -> None:
        self._first_s = first_s if self._first_s is None else min(self._first_s, first_s)
        self._last_s = max(self._last_s, last_s)

    def as_bytes(self) -> bytes:
        """Return everything in a form for another process; of bounded size (:attr:`bytes` and a little)."""
        content: dict[str, Any] = {
            "names": np.array(list(self._units), dtype=np.str_),
            "units": np.array(list(self._units.values()), dtype=np.str_),
            "kept": np.array(list(self._levels[0].kept), dtype=np.str_),
            "ends_s": np.array([np.nan if self._first_s is None else self._first_s, self._last_s]),
        }
        for n, level in enumerate(self._levels):
            content[f"number{n}"] = level.number
            content[f"values{n}"] = np.array(list(level.kept.values())).reshape(-1, 2, BUCKETS)
        target = io.BytesIO()
        np.savez(target, **content)
        return target.getvalue()

    @classmethod
    def from_bytes(cls, content: bytes) -> History:
        """Return what :meth:`as_bytes` of another process has given.

        Raises
        ------
        ValueError
            If it is something else.
        """
        made = cls()
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as found:
                made._fill(found)
        except (BadZipFile, EOFError, KeyError, OSError) as error:
            raise ValueError(f"no history: {error}") from None
        return made

    def _fill(self, found: Mapping[str, NDArray[Any]]) -> None:
        self._units = dict(zip(found["names"].tolist(), found["units"].tolist(), strict=True))
        first_s, last_s = found["ends_s"].tolist()
        self._first_s, self._last_s = (None if math.isnan(first_s) else first_s), last_s
        for n, level in enumerate(self._levels):
            level.number = found[f"number{n}"]
            level.newest = int(level.number.max())
            level.kept = dict(zip(found["kept"].tolist(), found[f"values{n}"], strict=True))

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
            As of :func:`~bufferstand.daq.monitor.past.answers.answer`, of the finest level that holds the
            span in at most :data:`MOST_POINTS`.
        """
        if self._first_s is None:
            return answer(self._units)
        from_s, to_s = max(from_s, self._first_s), min(to_s, self._last_s)
        level, numbers = self._fitting(from_s, to_s)
        values = {name: level.values(name, numbers) for name in channels if name in self._units}
        return answer(self._units, numbers, level.width_s, values, (self._first_s, self._last_s), 3)

    def _fitting(self, from_s: float, to_s: float) -> tuple[_Level, NDArray[np.int64]]:
        for level in self._levels:
            numbers = level.within(from_s, to_s)
            if level.reaches(from_s) and numbers.size <= MOST_POINTS:
                return level, numbers
        return level, level.within(from_s, to_s)[-MOST_POINTS:]

    @property
    def bytes(self) -> int:
        """Return what its buckets take."""
        return sum(level.bytes for level in self._levels)
