"""The windows about many reversals at once, and which of them are no dwell.

Most turns are on record from both sides and have no rest. They are recognised here, many at once. The others
are examined one by one (:mod:`bufferstand.evaluation.cycles.turn_neighbourhood`,
:mod:`bufferstand.evaluation.cycles.dwells`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.cycles.dwells import (
    CUT_OFF_RATIO,
    PLATEAU_BANDS,
    PLATEAU_NOISE,
    PLATEAU_RATIO,
    PLATEAU_WIDER,
)
from bufferstand.evaluation.cycles.turn_neighbourhood import Reversals, least_height
from bufferstand.evaluation.numerics import BoolArray, FloatArray, IndexArray

_CHUNK_SAMPLES = 65_536
"""Samples that are looked at together: what is made of them stays in the processor's cache."""

_MOSTLY = 0.65
"""Half of the height is fallen in so much of a side of any usual motion: what is beyond need not be read."""
_SHORT = 400
"""Sides of no more samples are looked through, longer ones halved and halved again."""
_MOST_RATIO = 1.001 * max(PLATEAU_RATIO, CUT_OFF_RATIO)
"""Where samples alone show that the times within one and nine bands are further apart, none is a dwell."""
_WIDEST = PLATEAU_WIDER + 3.0
"""So many bands below the extreme lies all that tells a dwell: its level is within two of them."""


@dataclass(frozen=True, eq=False)
class Screened:
    """Reversals that are plain turns: ``rows`` (R,) of all; windows ``first`` … ``last`` (excluded), (R, L).

    ``height`` (R,) is that of the lower side.
    """

    rows: IndexArray
    first: IndexArray
    last: IndexArray
    height: FloatArray


def screened(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    reversals: Reversals,
    sigma_mm: float,
    shares: FloatArray,
    least_samples: int,
) -> Screened:
    """Return the reversals that are no dwell, and the windows about them.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
    reversals : Reversals
    sigma_mm : float
        Noise of the stroke.
    shares : array, shape (L,)
        Widths of the windows, rising: samples within this share of the height below the extreme, and two
        sigma.
    least_samples : int
        So many make a dwell.
    """
    inner = np.flatnonzero(~reversals.at_end.any(axis=1))
    at, limits = reversals.index[inner], reversals.limits[inner]
    sign = np.where(reversals.upper[inner], 1.0, -1.0)
    turns = _Turns(time_s, stroke_mm, at, sign, np.stack((at - limits[:, 0], limits[:, 1] - at)))
    heights = turns.heights()
    height = np.min(heights, axis=0)
    wide = np.minimum(np.max(heights, axis=0), 2.0 * height)
    below = shares * height[:, None] + 2.0 * sigma_mm
    bands = [np.maximum(PLATEAU_NOISE * sigma_mm, share * wide) for share in PLATEAU_BANDS]
    counts = np.zeros((2, *below.shape), dtype=np.intp)
    for part in _parts(np.max(turns.size, axis=0, initial=1)):
        own = turns.rows(part)
        for k in range(2):
            counts[k, part] = own.within(k, below[part])
    # Of each turn, so many samples to both sides that none beyond them tells a dwell.
    holds = below >= _WIDEST * bands[-1][:, None]
    chosen = counts[:, np.arange(at.size), np.argmax(holds, axis=1)]
    near = np.where(holds.any(axis=1), chosen, turns.size)
    plain = height > least_height(sigma_mm)
    for part in _parts(np.max(near, axis=0, initial=1) + 1):
        rests = turns.rows(part).rest(near[:, part], [band[part] for band in bands], least_samples)
        plain[part] &= ~rests
    first, last = at[:, None] - counts[0], at[:, None] + 1 + counts[1]
    return Screened(inner[plain], first[plain], last[plain], height[plain])


def _parts(longest: IndexArray) -> Iterator[slice]:
    """Yield turns that follow each other, as many as are looked at together by the longer side of each."""
    start = 0
    while start < longest.size:
        fits = np.maximum.accumulate(longest[start : start + _CHUNK_SAMPLES])
        number = int(np.count_nonzero(fits * np.arange(1, fits.size + 1) <= _CHUNK_SAMPLES))
        yield slice(start, start + max(1, number))
        start += max(1, number)


@dataclass(frozen=True, eq=False)
class _Turns:
    """Turns that follow each other, shape (R,), with ``size`` (2, R) samples to the left and to the right."""

    time_s: FloatArray
    stroke_mm: FloatArray
    at: IndexArray
    sign: FloatArray
    size: IndexArray

    def rows(self, part: slice | IndexArray) -> _Turns:
        """Return some of them."""
        return _Turns(self.time_s, self.stroke_mm, self.at[part], self.sign[part], self.size[:, part])

    def heights(self) -> FloatArray:
        """Return how far the stroke falls at most to both sides, shape (2, R)."""
        found = np.zeros(self.size.shape)
        for sign, lowest in ((1.0, np.minimum), (-1.0, np.maximum)):
            rows = np.flatnonzero(self.sign == sign)
            if not rows.size:
                continue
            at, (left, right) = self.at[rows], self.size[:, rows]
            bounds = np.stack((at - left, at, at + right), axis=1)
            least = lowest.reduceat(self.stroke_mm[: int(bounds[-1, 2]) + 1], bounds.ravel()).reshape(-1, 3)
            least[:, 1] = lowest(least[:, 1], self.stroke_mm[bounds[:, 2]])
            found[:, rows] = sign * (self.stroke_mm[at] - least[:, :2].T)
        return found

    def fallen(self, side: int, reach: int) -> FloatArray:
        """Return how far the stroke has fallen, going out to the left (0) or right (1), shape (R, ``reach``).

        Where a side has fewer samples, what lies beyond it follows. Where it is long, it is how far at most.
        """
        lowest, highest = int(self.at[0]) - reach, int(self.at[-1]) + reach
        if lowest < 0 or highest >= self.stroke_mm.size:
            stroke = self.stroke_mm[np.clip(np.arange(lowest, highest + 1), 0, self.stroke_mm.size - 1)]
        else:
            stroke = self.stroke_mm[lowest : highest + 1]
        windows = np.lib.stride_tricks.sliding_window_view(stroke, reach)
        out = windows[self.at - lowest + 1] if side else windows[self.at - lowest - reach][:, ::-1]
        drop = np.subtract(self.stroke_mm[self.at][:, None], out, out=np.empty((self.at.size, reach)))
        drop *= self.sign[:, None]
        return np.maximum.accumulate(drop, axis=1) if reach > _SHORT else drop

    def within(self, side: int, below: FloatArray) -> IndexArray:
        """Return the samples to one side that lie before the first further below the extreme, shape (R, L).

        The limits ``below`` (R, L) rise.
        """
        size = self.size[side]
        reach = int(np.max(size))
        near = int(_MOSTLY * reach)
        if near > 0:
            found = _not_above(self.fallen(side, near), np.minimum(size, near), below)
            if np.all(found[:, -1] < near):
                return found
        return _not_above(self.fallen(side, reach), size, below)

    def rest(self, near: IndexArray, bands: list[FloatArray], least_samples: int) -> BoolArray:
        """Say which turns are dwells within a band, as :func:`bufferstand.evaluation.cycles.dwells.plateau`
        does of one turn.

        ``near`` (2, R): samples to both sides that are no further below the extreme than that concerns.
        """
        fallen = [self.fallen(k, int(np.max(np.minimum(near[k] + 1, self.size[k])))) for k in range(2)]

        def within(below: FloatArray) -> IndexArray:
            """Return the samples to both sides that are no further below the extreme, shape (2, R, L)."""
            return np.stack([_not_above(fallen[k], self.size[k], below) for k in range(2)])

        found = np.zeros(self.at.size, dtype=bool)
        for band in bands:
            level = self._level(*within(2.0 * band[:, None])[..., 0])
            below = level[:, None] + np.multiply.outer(band, (1.0, PLATEAU_WIDER))
            counts = within(below)
            may = np.sum(counts[..., 0], axis=0) + 1 >= least_samples
            rows = np.flatnonzero(
                may & (self._shortest(counts[..., 1]) <= _MOST_RATIO * self._longest(counts[..., 0]))
            )
            own = self.rows(rows)
            inner_s, outer_s = own._lasts(counts[:, rows], below[rows]).T
            cut_off = np.any(counts[:, rows, 1] == own.size, axis=0)
            found[rows] |= outer_s <= np.where(cut_off, CUT_OFF_RATIO, PLATEAU_RATIO) * inner_s
        return found

    def _level(self, left: IndexArray, right: IndexArray) -> FloatArray:
        """Return how far below the extreme the median lies of so many samples to both sides and itself."""
        count = left + right + 1
        order = np.arange(int(np.max(count)))
        near = np.minimum(self.at[:, None] - left[:, None] + order, self.stroke_mm.size - 1)
        drop = (self.stroke_mm[self.at][:, None] - self.stroke_mm[near]) * self.sign[:, None]
        drop[order >= count[:, None]] = np.inf
        drop.sort(axis=1)
        lines = np.arange(count.size)
        return np.asarray(0.5 * (drop[lines, (count - 1) // 2] + drop[lines, count // 2]))

    def _shortest(self, within: IndexArray) -> FloatArray:
        """Return the time that samples within a level last: crossings lie beyond them, shape (R,)."""
        return np.asarray(self.time_s[self.at + within[1]] - self.time_s[self.at - within[0]])

    def _longest(self, within: IndexArray) -> FloatArray:
        """Return the time between the samples beyond a level: crossings lie before them, shape (R,)."""
        left, right = np.minimum(within + 1, self.size)
        return np.asarray(self.time_s[self.at + right] - self.time_s[self.at - left])

    def _lasts(self, within: IndexArray, below: FloatArray) -> FloatArray:
        """Return the time between crossings of levels (R, L), between samples; at a limit, of its sample."""
        top, at, sign = (self.stroke_mm[self.at] * self.sign)[:, None], self.at[:, None], self.sign[:, None]
        found = []
        for k, step in ((0, -1), (1, 1)):
            inside = at + step * within[k]
            outside = at + step * np.minimum(within[k] + 1, self.size[k][:, None])
            values = [top - self.stroke_mm[place] * sign for place in (inside, outside)]
            fall = values[1] - values[0]
            share = np.clip((below - values[0]) / np.where(fall > 0.0, fall, np.inf), 0.0, 1.0)
            found.append(self.time_s[inside] + share * (self.time_s[outside] - self.time_s[inside]))
        return np.asarray(found[1] - found[0])


def _not_above(fallen: FloatArray, size: IndexArray, limit: FloatArray) -> IndexArray:
    """Return how many values of each row lie before the first above each of its limits (R, L), which rise.

    None beyond its ``size`` (R,) counts. Rows of more than :data:`_SHORT` values must rise.
    """
    if fallen.shape[1] <= _SHORT:  # to look for the first one above is faster than bisection
        found = np.empty(limit.shape, dtype=np.intp)
        reach = fallen.shape[1]
        for k in range(limit.shape[1] - 1, -1, -1):
            above = fallen[:, :reach] > limit[:, k, None]
            first = np.argmax(above, axis=1)
            found[:, k] = np.minimum(np.where((first == 0) & ~above[:, 0], size, first), size)
            reach = min(reach, int(np.max(found[:, k])) + 1)  # a lower limit is passed no later
        return found
    low = np.zeros(limit.shape, dtype=np.intp)
    high = np.broadcast_to(size[:, None], limit.shape).copy()
    offset = fallen.shape[1] * np.arange(fallen.shape[0])[:, None]
    flat = fallen.ravel()
    for _ in range(int(np.max(size)).bit_length()):
        middle = (low + high) >> 1
        below = (flat[offset + np.minimum(middle, fallen.shape[1] - 1)] <= limit) & (low < high)
        low = np.where(below, middle + 1, low)
        high = np.where(below, high, np.minimum(middle, high))
    return low
