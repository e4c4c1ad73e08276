"""Interpolates one channel at the instants of another by a spline, and bounds the error.

Between the readings of a slower channel the truth is not on record. What may lie there is judged by the
readings themselves: by what every second one of them gives, and the others
(:mod:`bufferstand.evaluation.gaps.coarse_sampling`).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray, moved
from bufferstand.evaluation.record import finite_where_rising, step_limits, understand
from bufferstand.foundation.numbers import median

_SAME_INSTANT_S = 1e-9
LONG = 1.5
"""A step longer than so many of both its neighbours is a hole: nothing is interpolated across it."""
_LEAST = 4
_LEAST_HALVED = 8


@dataclass(frozen=True, eq=False)
class Resampled:
    """A channel at other instants.

    Attributes
    ----------
    value : array, shape (M,)
        NaN where its readings do not reach, or have a hole.
    halved : array, shape (2, M)
        What every second reading gives, and what the others give, less ``value``; 0 where that is NaN.
    """

    value: FloatArray
    halved: FloatArray


def same_instants(one_s: FloatArray, other_s: FloatArray) -> bool:
    """Say whether times of shape (N,) are equal but for rounding."""
    if one_s is other_s:
        return True
    if one_s.shape != other_s.shape or (one_s.size and abs(one_s[0] - other_s[0]) > _SAME_INSTANT_S):
        return False
    return np.array_equal(one_s, other_s) or bool(
        np.allclose(one_s, other_s, rtol=0.0, atol=_SAME_INSTANT_S, equal_nan=True)
    )


def usable(at_s: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the readings that are numbers, at instants that rise strictly."""
    good = np.isfinite(at_s) & np.isfinite(value)
    if not good.all():
        at_s, value = at_s[good], value[good]
    if at_s.size and not np.all(np.diff(at_s) > 0.0):
        before = np.maximum.accumulate(np.concatenate(([-np.inf], at_s[:-1])))
        rising = at_s > before
        at_s, value = at_s[rising], value[rising]
    return at_s, value


def as_taken(at_s: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the readings that are numbers, when they were taken: as a record understands their stamps."""
    if at_s.size and step_limits(at_s)[0] > 0.0 and finite_where_rising(at_s, value):
        return at_s, value  # as nearly always
    good = np.isfinite(at_s) & np.isfinite(value)
    at_s, value = at_s[good], value[good]
    if not at_s.size or np.all(np.diff(at_s) > 0.0):
        return at_s, value
    understood = understand(at_s)
    return usable(at_s if understood is None else understood.time_s, value)


def bring(at_s: FloatArray, value: FloatArray, wanted_s: FloatArray) -> Resampled:
    """Return a channel at other instants, by cubic splines over each stretch without a hole.

    Parameters
    ----------
    at_s, value : arrays, shape (N,)
        Readings (:func:`usable`).
    wanted_s : array, shape (M,)

    Returns
    -------
    Brought
        Beyond its ends, a stretch reaches by no more than 1.5 steps of the faster one of both.
    """
    brought = Resampled(np.full(wanted_s.size, np.nan), np.zeros((2, wanted_s.size)))
    if at_s.size < _LEAST or not wanted_s.size:
        return brought
    reach_s = LONG * min(usual_step_s(at_s), usual_step_s(wanted_s))
    edges = [0, *holes(at_s).tolist(), at_s.size]
    for first, last in pairwise(edges):
        if last - first < _LEAST:
            continue
        own_s, known = at_s[first:last], value[first:last]
        near = (wanted_s >= own_s[0] - reach_s) & (wanted_s <= own_s[-1] + reach_s)
        wanted = wanted_s[near]
        found = moved(own_s, known, wanted)
        brought.value[near] = found
        brought.halved[:, near] = _halved(own_s, known, wanted) - found
    return brought


def holes(at_s: FloatArray) -> NDArray[np.intp]:
    """Return the readings that follow a step longer than 1.5 times the longer one of its neighbours."""
    step = np.diff(at_s)
    beside = np.concatenate(([-np.inf], step, [-np.inf]))
    return np.flatnonzero(step > LONG * np.maximum(beside[:-2], beside[2:])) + 1


def usual_step_s(at_s: FloatArray) -> float:
    """Return the median step of instants [s]; infinity for a single one."""
    return median(np.diff(at_s)) if at_s.size > 1 else float("inf")


def too_coarse(slow_s: FloatArray, fast_s: FloatArray, fast: FloatArray, limit: float) -> NDArray[np.bool_]:
    """Say between which readings of a slow channel more happens than they can show.

    There the faster channel leaves the straight line between its values at both readings by more than a
    limit. (Of a sine of n readings a cycle, by up to π² / 4 n² of its range.)

    Parameters
    ----------
    slow_s : array, shape (N,)
    fast_s, fast : arrays, shape (M,)
        Readings (:func:`usable`) of the faster channel.
    limit : float
        In its unit.

    Returns
    -------
    array of bool, shape (N - 1,)
    """
    coarse = np.zeros(max(slow_s.size - 1, 0), dtype=bool)
    if slow_s.size < 2 or not fast_s.size:
        return coarse
    line = np.interp(fast_s, slow_s, np.interp(slow_s, fast_s, fast))
    within = np.searchsorted(slow_s, fast_s, side="right") - 1
    far = (np.abs(fast - line) > limit) & (within >= 0) & (within < coarse.size)
    coarse[within[far]] = True
    return coarse


def _halved(at_s: FloatArray, value: FloatArray, wanted_s: FloatArray) -> FloatArray:
    """Return what halves of the readings give, shape (2, M); of few, straight lines between them."""
    parts = []
    for first in (0, 1):
        rows = np.unique(np.concatenate(([0], np.arange(first, at_s.size, 2), [at_s.size - 1])))
        if at_s.size < _LEAST_HALVED:
            parts.append(np.interp(wanted_s, at_s[rows], value[rows]))
        else:
            parts.append(moved(at_s[rows], value[rows], wanted_s))
    return np.stack(parts)
