"""The windows about many reversals at once, and which of them are no dwell.

Turns that are on record from both sides and do not rest are what a run has thousands of: they are told here,
many at once. The others are looked at one by one (:mod:`evaluation.turn_sides`, :mod:`evaluation.dwells`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.dwells import CUT_OFF_RATIO, PLATEAU_BANDS, PLATEAU_NOISE, PLATEAU_RATIO, PLATEAU_WIDER
from evaluation.record import FloatArray
from evaluation.turn_sides import IndexArray, Reversals, least_height

BoolArray = NDArray[np.bool_]
_CHUNK_SAMPLES = 65_536
"""Samples that are looked at together: what is made of them stays in the processor's cache."""

_SHORT = 400
"""Sides of no more samples are looked through, longer ones halved and halved again."""


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
        Widths of the windows: samples within this share of the height below the extreme, and two sigma.
    least_samples : int
        So many make a dwell.
    """
    inner = np.flatnonzero(~reversals.at_end.any(axis=1))
    at, limits = reversals.index[inner], reversals.limits[inner]
    sign = np.where(reversals.upper[inner], 1.0, -1.0)
    size = np.stack((at - limits[:, 0], limits[:, 1] - at))
    counts = np.zeros((2, at.size, shares.size), dtype=np.intp)
    height, plain = np.zeros(at.size), np.zeros(at.size, dtype=bool)
    longest = np.max(size, axis=0, initial=1)
    start = 0
    while start < at.size:
        fits = np.maximum.accumulate(longest[start : start + _CHUNK_SAMPLES])
        number = int(np.count_nonzero(fits * np.arange(1, fits.size + 1) <= _CHUNK_SAMPLES))
        part = slice(start, start + max(1, number))
        fallen = [
            _fallen(stroke_mm, at[part], size[k, part], sign[part], step) for k, step in enumerate((-1, 1))
        ]
        lines = np.arange(fallen[0].shape[0])
        heights = np.stack([f[lines, own - 1] for f, own in zip(fallen, size[:, part], strict=True)])
        height[part] = np.min(heights, axis=0)
        wide = np.minimum(np.max(heights, axis=0), 2.0 * height[part])
        for k in range(2):
            below = shares * height[part][:, None] + 2.0 * sigma_mm
            counts[k, part] = _not_above(fallen[k], size[k, part], below)
        turns = _Turns(time_s, stroke_mm, at[part], sign[part], size[:, part], fallen)
        plain[part] = height[part] > least_height(sigma_mm)
        for share in PLATEAU_BANDS:
            plain[part] &= ~turns.rest(np.maximum(PLATEAU_NOISE * sigma_mm, share * wide), least_samples)
        start = part.stop
    first, last = at[:, None] - counts[0], at[:, None] + 1 + counts[1]
    return Screened(inner[plain], first[plain], last[plain], height[plain])


@dataclass(frozen=True, eq=False)
class _Turns:
    """Turns and what was found about them: ``size`` (2, R) samples and how far they have ``fallen`` at most,
    to the left and to the right.
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    at: IndexArray
    sign: FloatArray
    size: IndexArray
    fallen: Sequence[FloatArray]

    def rest(self, band: FloatArray, least_samples: int) -> BoolArray:
        """Say which turns are dwells within a band each, as :func:`evaluation.dwells.plateau` does of one."""
        below = self._level(2.0 * band)
        inner, outer = (self._within(below + times * band) for times in (1.0, PLATEAU_WIDER))
        cut_off = np.any(outer == self.size, axis=0)
        outer_s = self._lasts(outer, below + PLATEAU_WIDER * band)
        ratio = np.where(cut_off, CUT_OFF_RATIO, PLATEAU_RATIO)
        rests = outer_s <= ratio * self._lasts(inner, below + band)
        return np.asarray(rests & (np.sum(inner, axis=0) + 1 >= least_samples))

    def _within(self, below: FloatArray) -> IndexArray:
        """Return the samples to both sides that are not further below the extreme, shape (2, R)."""
        return np.stack([_not_above(self.fallen[k], self.size[k], below[:, None])[:, 0] for k in range(2)])

    def _level(self, below: FloatArray) -> FloatArray:
        """Return how far below the extreme the median lies of what is not further below it."""
        left, right = self._within(below)
        count = left + right + 1
        order = np.arange(int(np.max(count)))
        near = np.minimum(self.at[:, None] - left[:, None] + order, self.stroke_mm.size - 1)
        drop = (self.stroke_mm[self.at][:, None] - self.stroke_mm[near]) * self.sign[:, None]
        drop[order >= count[:, None]] = np.inf
        drop.sort(axis=1)
        lines = np.arange(count.size)
        return np.asarray(0.5 * (drop[lines, (count - 1) // 2] + drop[lines, count // 2]))

    def _lasts(self, within: IndexArray, below: FloatArray) -> FloatArray:
        """Return the time between the crossings of a level, between samples; at a limit, of its sample."""
        top, found = self.stroke_mm[self.at] * self.sign, []
        for k, step in ((0, -1), (1, 1)):
            inside = self.at + step * within[k]
            outside = self.at + step * np.minimum(within[k] + 1, self.size[k])
            values = [top - self.stroke_mm[place] * self.sign for place in (inside, outside)]
            fall = values[1] - values[0]
            share = np.clip((below - values[0]) / np.where(fall > 0.0, fall, np.inf), 0.0, 1.0)
            found.append(self.time_s[inside] + share * (self.time_s[outside] - self.time_s[inside]))
        return np.asarray(found[1] - found[0])


def _fallen(
    stroke_mm: FloatArray, at: IndexArray, size: IndexArray, sign: FloatArray, step: int
) -> FloatArray:
    """Return how far the stroke has fallen at most, going out from each extreme by ``step``, shape (R, W)."""
    order = np.arange(1, int(np.max(size)) + 1)
    out = at[:, None] + step * np.minimum(order, size[:, None])
    drop = (stroke_mm[at] * sign)[:, None] - stroke_mm[out] * sign[:, None]
    return np.asarray(np.maximum.accumulate(drop, axis=1))


def _not_above(fallen: FloatArray, size: IndexArray, limit: FloatArray) -> IndexArray:
    """Return how many values of each row, which rises, are not above each of its limits."""
    if fallen.shape[1] <= _SHORT:  # to look for the first one above is faster than bisection
        found = np.empty(limit.shape, dtype=np.intp)
        for k in range(limit.shape[1]):
            above = fallen > limit[:, k, None]
            first = np.argmax(above, axis=1)
            found[:, k] = np.where(above[np.arange(first.size), first], first, size)
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
