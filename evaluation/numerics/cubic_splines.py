"""Cubic splines with SciPy's "not-a-knot" ends: through many rows of points at once, and at a delay."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from bufferstand.evaluation.numerics.arrays import FloatArray, IndexArray


def splines(
    time_s: FloatArray, values: Sequence[FloatArray], count: IndexArray, points: int
) -> list[FloatArray]:
    """Return each row at ``points`` even moments from its first to its last point.

    Parameters
    ----------
    time_s : array, shape (R, P)
        Rising in each row up to its ``count``.
    values : sequence of arrays, shape (R, P)
    count : array of int, shape (R,)
        Points of each row, at least four.
    points : int

    Returns
    -------
    list of array, shape (R, points)
        The moments, and each of ``values`` at them.
    """
    rows = count.size
    lines = np.arange(rows)
    used = np.arange(time_s.shape[1]) < count[:, None]
    first, last = time_s[:, 0], time_s[lines, count - 1]
    share = np.linspace(0.0, 1.0, points)
    fine = first[:, None] + (last - first)[:, None] * share
    fine[:, -1] = last
    # One after the other, a row's last point and the next one's first an interval apart that nobody reads.
    own = ((time_s - first[:, None]) / (last - first)[:, None])[used]
    place = own + 2.0 * np.repeat(lines, count)
    starts = np.concatenate(([0], np.cumsum(count)[:-1]))
    at = np.searchsorted(place, (share + 2.0 * lines[:, None]).ravel(), side="right") - 1
    at = np.clip(at.reshape(fine.shape), starts[:, None], (starts + count - 2)[:, None])
    y = np.stack([value[used] for value in values], axis=1)
    slope = _slopes(own, y, starts, count)
    step = own[at + 1] - own[at]
    z = (share - own[at]) / step
    return [
        fine,
        *(
            _between(y[at, k], y[at + 1, k], step * slope[at, k], step * slope[at + 1, k], z)
            for k in range(y.shape[1])
        ),
    ]


def spline_at(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Return the spline through points at some places; beyond the ends, its outermost cubics.

    Parameters
    ----------
    x : array, shape (N,)
        Rising, at least four.
    y : array, shape (N, K)
    at : array, shape (M,)

    Returns
    -------
    array, shape (M, K)
    """
    return _read(x, y, _slopes(x, y, np.array([0]), np.array([x.size])), at)


def _read(x: FloatArray, y: FloatArray, slope: FloatArray, at: FloatArray) -> FloatArray:
    """Return the spline of some values and slopes at some places."""
    place = np.clip(np.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
    step = (x[place + 1] - x[place])[:, None]
    z = (at - x[place])[:, None] / step
    return _between(y[place], y[place + 1], step * slope[place], step * slope[place + 1], z)


def _between(
    low: FloatArray, high: FloatArray, begins: FloatArray, ends: FloatArray, z: FloatArray
) -> FloatArray:
    """Return Hermite's cubics of two values and slopes by the step, at the share z of the way."""
    rise = high - low
    return low + z * (rise + (1.0 - z) * ((begins - rise) * (1.0 - z) - (ends - rise) * z))


def _slopes(x: FloatArray, y: FloatArray, starts: IndexArray, count: IndexArray) -> FloatArray:
    """Return the slopes of the splines at all points: one tridiagonal system, in which no row knows another.

    ``x`` (N,) and ``y`` (N, K) are the rows one after the other. Equations as in scipy.interpolate.
    """
    ends = starts + count - 1
    dx = np.diff(x)
    dx[ends[:-1]] = 1.0  # between rows: read by no equation that stays
    chord = np.diff(y, axis=0) / dx[:, None]
    bands = np.zeros((3, x.size))
    right = np.zeros_like(y)
    bands[1, 1:-1] = 2.0 * (dx[:-1] + dx[1:])
    bands[0, 2:] = dx[:-1]
    bands[2, :-2] = dx[1:]
    right[1:-1] = 3.0 * (dx[1:, None] * chord[:-1] + dx[:-1, None] * chord[1:])
    a, b = dx[starts], dx[starts + 1]
    whole = a + b
    bands[1, starts], bands[0, starts + 1] = b, whole
    weights = (a + 2.0 * whole) * b / whole, a**2 / whole
    right[starts] = weights[0][:, None] * chord[starts] + weights[1][:, None] * chord[starts + 1]
    a, b = dx[ends - 1], dx[ends - 2]
    whole = a + b
    bands[1, ends], bands[2, ends - 1] = b, whole
    weights = (a + 2.0 * whole) * b / whole, a**2 / whole
    right[ends] = weights[0][:, None] * chord[ends - 1] + weights[1][:, None] * chord[ends - 2]
    bands[2, starts[1:] - 1] = 0.0
    bands[0, starts[1:]] = 0.0
    return _solved(bands, right)


def _solved(bands: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solution of a tridiagonal system, its bands as scipy.linalg.solve_banded has them."""
    if right.shape[0] <= _END_POINTS:  # scipy takes a tenth of a second to import
        matrix = np.diag(bands[1]) + np.diag(bands[0, 1:], 1) + np.diag(bands[2, :-1], -1)
        return np.linalg.solve(matrix, right)
    from scipy.linalg import solve_banded  # noqa: PLC0415 - slow to import, and seldom needed

    return np.asarray(solve_banded((1, 1), bands, right), dtype=np.float64)


_EVEN_STEPS = 1e-7
"""Steps count as even that differ by no more than this share of one: of a spline's values that moves less."""
_MOST_STEPS = 2
"""A moment is at most so many steps from its point."""
_END_POINTS = 80
"""Points at each end whose spline is solved by itself; …"""
_TOLD_APART = 40
"""… beyond so many an end is forgotten: each step leaves 2 - √3 of its weight, forty of them 1e-23."""
_SHIFTS = (1, 2, 4, 8, 16)
_LEFT_OUT = sum(_SHIFTS)
"""Values at each end that the filter takes for those beside them alone: fewer than the spline is put over."""


def moved(time_s: FloatArray, value: FloatArray, wanted_s: FloatArray) -> FloatArray:
    """Return the cubic spline through points (its ends not-a-knot) at other moments.

    Parameters
    ----------
    time_s, value : arrays, shape (N,)
        Points, at least four, in order of time.
    wanted_s : array, shape (M,)

    Returns
    -------
    array, shape (M,)
    """
    even = moved_evenly(time_s, value, wanted_s)
    if even is not None:
        return even
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - slow to import, and seldom needed

    return np.asarray(CubicSpline(time_s, value)(wanted_s))


def moved_evenly(time_s: FloatArray, value: FloatArray, wanted_s: FloatArray) -> FloatArray | None:
    """Return the same for many points that are even, each moment as far from its point as every other one.

    There the spline at the moments is a recursive filter and four products (Unser 1999, Splines: a perfect
    fit for signal and image processing, eq. 16 and 17): the same figures to the last digits, a tenth of the
    time. None where the points are not so, are few, or one of them is no number.
    """
    share = _common_share(time_s, wanted_s)
    if share is None or not np.isfinite(np.sum(value)):
        return None
    whole = int(np.floor(share))
    s = share - whole
    r = 1.0 - s
    taps = r**3 / 6.0, 2.0 / 3.0 - s**2 * (1.0 - 0.5 * s), 2.0 / 3.0 - r**2 * (1.0 - 0.5 * r), s**3 / 6.0
    weight, scale = _weights(value)
    inner = slice(_TOLD_APART, value.size - _TOLD_APART)
    begin, end = (at + whole - 1 - _LEFT_OUT for at in (inner.start, inner.stop))
    found = np.empty(value.size)
    found[inner] = np.correlate(weight[begin : end + len(taps) - 1], np.multiply(scale, taps), mode="valid")
    # The filter's ends are not the spline's, which are put over them: that at the end backwards.
    ends = np.stack((value[:_END_POINTS], value[: -_END_POINTS - 1 : -1]), axis=1)
    near = np.arange(_TOLD_APART)
    points, slopes_of = _even_ends()
    spline = _read(points, ends, slopes_of @ ends, np.concatenate((near + share, near - share)))
    found[:_TOLD_APART], found[: -_TOLD_APART - 1 : -1] = spline[:_TOLD_APART, 0], spline[_TOLD_APART:, 1]
    return found


def _weights(value: FloatArray) -> tuple[FloatArray, float]:
    """Return the weights of the B-splines that run through even values, and a factor that they lack.

    Without :data:`_LEFT_OUT` at each end. The filter there and back, 6 |z| / ((1 - z q) (1 - z / q)), with
    z = √3 - 2 and q the step to the next value. 1 / (1 - z q) is (1 + z q) (1 + z² q²) (1 + z⁴ q⁴) …, of
    which five factors leave out z³²: 5e-19. So it takes whole columns and no library: scipy.ndimage takes
    longer to import than a run to evaluate.
    """
    pole = float(np.sqrt(3.0)) - 2.0
    weight, scale = value, -6.0 * pole
    for shift in _SHIFTS:
        both = weight[2 * shift :] + weight[: -2 * shift]
        both *= pole / (1.0 + pole * pole)
        both += weight[shift:-shift]
        weight, scale, pole = both, scale * (1.0 + pole * pole), pole * pole
    return weight, scale


@lru_cache(maxsize=1)
def _even_ends() -> tuple[FloatArray, FloatArray]:
    """Return even points 0, 1, 2 …, and by what matrix their values give the spline's slopes at them."""
    points = np.arange(float(_END_POINTS))
    return points, _slopes(points, np.eye(_END_POINTS), np.array([0]), np.array([_END_POINTS]))


def _common_share(time_s: FloatArray, wanted_s: FloatArray) -> float | None:
    """Return by what share of a step every moment follows its point; None where they are not alike."""
    if wanted_s.size != time_s.size or time_s.size < 2 * _END_POINTS:
        return None
    step = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    late_s = float(wanted_s[0] - time_s[0])
    slack_s = _EVEN_STEPS * step
    if not (step > 0.0 and abs(late_s) <= _MOST_STEPS * step):
        return None
    for differences, usual_s in ((wanted_s - time_s, late_s), (np.diff(time_s), step)):
        if not max(np.max(differences) - usual_s, usual_s - np.min(differences)) <= slack_s:
            return None
    return late_s / step
