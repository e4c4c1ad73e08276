"""The windows about many reversals at once, and which of them cannot be a dwell.

Turns that are on record from both sides and do not rest are what a run has thousands of: they are told here,
many at once. The others are looked at one by one (:mod:`evaluation.turn_sides`, :mod:`evaluation.dwells`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.dwells import PLATEAU_BANDS, PLATEAU_NOISE, PLATEAU_RATIO, PLATEAU_WIDER
from evaluation.record import FloatArray
from evaluation.turn_sides import IndexArray, Reversal, least_height

BoolArray = NDArray[np.bool_]
_BELOW = (1.0, 1.5, 2.0, 2.5, PLATEAU_WIDER)
"""How many bands below the extreme is looked."""
_CHUNK_SAMPLES = 65_536
"""Samples that are looked at together: what is made of them stays in the processor's cache."""


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
    reversals: Sequence[Reversal],
    sigma_mm: float,
    shares: FloatArray,
) -> Screened:
    """Return the reversals that are no dwell for sure, and the windows about them.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
    reversals : sequence of Reversal
    sigma_mm : float
        Noise of the stroke.
    shares : array, shape (L,)
        Widths of the windows: samples within this share of the height below the extreme, and two sigma.
    """
    inner = np.array([i for i, r in enumerate(reversals) if not (r.at_end[0] or r.at_end[1])], dtype=np.intp)
    at = np.array([reversals[i].index for i in inner], dtype=np.intp)
    sign = np.array([1.0 if reversals[i].kind == "upper" else -1.0 for i in inner])
    limits = np.array([reversals[i].limits for i in inner], dtype=np.intp).reshape(-1, 2)
    size = np.stack((at - limits[:, 0], limits[:, 1] - at))
    counts = np.zeros((2, at.size, shares.size + len(_BELOW) * len(PLATEAU_BANDS)), dtype=np.intp)
    height, open_turn = np.zeros(at.size), np.zeros(at.size, dtype=bool)
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
        open_turn[part] = height[part] <= least_height(sigma_mm)
        wide = np.minimum(np.max(heights, axis=0), 2.0 * height[part])
        limit = _thresholds(height[part], wide, sigma_mm, shares)
        for k in range(2):
            counts[k, part] = _not_above(fallen[k], size[k, part], limit)
        start = part.stop
    plain = ~open_turn & _moves_on(time_s, at, limits, counts[:, :, shares.size :])
    first, last = at[:, None] - counts[0, :, : shares.size], at[:, None] + 1 + counts[1, :, : shares.size]
    return Screened(inner[plain], first[plain], last[plain], height[plain])


def _fallen(
    stroke_mm: FloatArray, at: IndexArray, size: IndexArray, sign: FloatArray, step: int
) -> FloatArray:
    """Return how far the stroke has fallen at most, going out from each extreme by ``step``, shape (R, W)."""
    order = np.arange(1, int(np.max(size)) + 1)
    out = at[:, None] + step * np.minimum(order, size[:, None])
    drop = (stroke_mm[at] * sign)[:, None] - stroke_mm[out] * sign[:, None]
    return np.asarray(np.maximum.accumulate(drop, axis=1))


def _thresholds(height: FloatArray, wide: FloatArray, sigma_mm: float, shares: FloatArray) -> FloatArray:
    """Return how far below the extreme is asked for: the windows, then some bands of each dwell."""
    bands = np.maximum(PLATEAU_NOISE * sigma_mm, np.array(PLATEAU_BANDS) * wide[:, None])
    windows = shares * height[:, None] + 2.0 * sigma_mm
    return np.concatenate((windows, *(times * bands for times in _BELOW)), axis=1)


def _not_above(fallen: FloatArray, size: IndexArray, limit: FloatArray) -> IndexArray:
    """Return how many values of each row, which rises, are not above each of its limits (bisection)."""
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


def _moves_on(time_s: FloatArray, at: IndexArray, limits: IndexArray, counts: IndexArray) -> BoolArray:
    """Say of each turn whether it is no dwell at any scale, whatever the level of that dwell would be.

    Where half of what lies within two bands lies within x, a dwell's level is not further below the extreme
    than x bands: its time within a band is less than that within x + 1 below the extreme, and its time within
    nine bands more than that within nine. For x, 1 and 1.5 are tried.
    """
    size = len(PLATEAU_BANDS)
    one, half_more, two, further, nine = (counts[:, :, k * size : (k + 1) * size] for k in range(len(_BELOW)))
    at, begin, end = at[:, None], limits[:, :1], limits[:, 1:]
    outer_s = time_s[at + nine[1]] - time_s[at - nine[0]]
    moves = np.zeros(outer_s.shape, dtype=bool)
    for within, inner in ((one, two), (half_more, further)):
        near = 2 * (np.sum(within, axis=0) + 1) >= np.sum(two, axis=0) + 3
        inner_s = time_s[np.minimum(at + inner[1] + 1, end)] - time_s[np.maximum(at - inner[0] - 1, begin)]
        moves |= near & (outer_s > PLATEAU_RATIO * inner_s)
    return np.asarray(np.all(moves, axis=1))
