"""How one signal follows another that measures the same: factor, zero, delay, residual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.foundation.numbers import likeness

MOST_LATE_S = 2.0
"""No filter and no bus makes a signal later than this."""
_COARSE_S = 0.02
_LOOKED_AT = 4000
_FEWEST, _MOVES_ON = 20, 0.2
_ROUNDING = 1e-12
"""A window in which x moves by so little beside others stands still but for rounding."""


@dataclass(frozen=True)
class SignalFit:
    """``y = zero + factor · x``, least squares.

    Attributes
    ----------
    factor, zero : float
    left : float
        Standard deviation of what the line leaves of y, as a share of y's own.
    """

    factor: float
    zero: float
    left: float


def fitted(x: FloatArray, y: FloatArray) -> SignalFit | None:
    """Return how y follows x, shape (N,) each; None where x does not move."""
    mean_x, mean_y = float(np.mean(x)), float(np.mean(y))
    x, y = x - mean_x, y - mean_y
    spread, own = float(np.dot(x, x)), float(np.dot(y, y))
    if spread <= 0.0:
        return None
    factor = float(np.dot(x, y)) / spread
    rest = y - factor * x
    left = float(np.sqrt(np.dot(rest, rest) / own)) if own > 0.0 else 0.0
    return SignalFit(factor, mean_y - factor * mean_x, left)


def lateness(
    time_s: FloatArray, x: FloatArray, y: FloatArray, least_s: float = -np.inf
) -> tuple[float, SignalFit] | None:
    """Return by how much later than x the signal y is [s], at which it follows best, and that fit.

    Parameters
    ----------
    time_s, x, y : arrays, shape (N,)
        Negative: y is earlier. Looked for within :data:`MOST_LATE_S`, and a third of the record.
    least_s : float, optional
        None is returned at once where y is later by less than this.
    """
    near_s = _nearest_late_s(time_s, x, y)
    if near_s is None or near_s + _COARSE_S < least_s:
        return None
    every = -(-time_s.size // _LOOKED_AT)
    at_s, later = time_s[::every], y[::every]
    found = [
        (float(s), fit)
        for s in near_s + np.linspace(-_COARSE_S, _COARSE_S, 21)
        if (fit := fitted(np.interp(at_s - s, time_s, x), later))
    ]
    return min(found, key=lambda pair: pair[1].left, default=None)


def _nearest_late_s(time_s: FloatArray, x: FloatArray, y: FloatArray) -> float | None:
    """Return the lateness at which y follows x best, in steps of :data:`_COARSE_S`; None: x never moves.

    On an even grid x that is moved by whole steps is a window of x.
    """
    lasts_s = float(time_s[-1] - time_s[0])
    most = int(min(MOST_LATE_S, lasts_s / 3.0) / _COARSE_S + 0.5)
    count = int(lasts_s / _COARSE_S) + 1
    at_s = time_s[0] + _COARSE_S * np.arange(-most, count + most)
    moved = np.interp(at_s, time_s, x)
    every = -(-count // _LOOKED_AT)
    moved = moved - np.mean(moved)
    later = np.interp(at_s[most : most + count : every], time_s, y)
    later = later - np.mean(later)
    shared, mean, spread = np.empty((3, 2 * most + 1))  # the first: x earliest, y latest
    for phase in range(min(every, spread.size)):  # windows of every so-manyeth value, of one column each
        own, rows = moved[phase::every], shared[phase::every].size
        shared[phase::every] = np.correlate(own, later, mode="valid")[:rows] ** 2
        mean[phase::every] = _sums(own, later.size)[:rows] / later.size
        spread[phase::every] = _sums(own * own, later.size)[:rows]
    spread -= later.size * mean**2
    moves = spread > _ROUNDING * np.max(spread)
    if not np.any(moves):
        return None
    follows = np.divide(shared, spread, out=np.full(spread.size, -1.0), where=moves)
    return _COARSE_S * (most - int(np.argmax(follows)))


def _sums(values: FloatArray, count: int) -> FloatArray:
    """Return the sums of each so many values that follow each other."""
    total = np.concatenate(([0.0], np.cumsum(values)))
    return np.asarray(total[count:] - total[:-count])


def still_from(time_s: FloatArray, value: FloatArray, other: FloatArray) -> float | None:
    """Return since when a signal stands still to the last digit while another one moves on [s], or None.

    Parameters
    ----------
    time_s, value, other : arrays, shape (N,)
        The other one must move by a fifth of its range meanwhile.
    """
    changes = np.flatnonzero(np.diff(value) != 0.0)
    first = int(changes[-1]) + 1 if changes.size else 0
    rest = other[first:]
    if rest.size < _FEWEST or float(np.ptp(rest)) < _MOVES_ON * float(np.ptp(other)):
        return None
    return float(time_s[first])


def shown(factor: float) -> str:
    """Return a factor with what it looks like, for a person."""
    like = likeness(factor)
    return f"{factor:.3g} ({like})" if like else f"{factor:.3g}"
