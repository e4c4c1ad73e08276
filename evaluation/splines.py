"""Cubic splines through many rows of points at once, with SciPy's "not-a-knot" ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from evaluation.record import FloatArray

IndexArray = NDArray[np.intp]


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
    found = [fine]
    for k in range(y.shape[1]):
        low, rise = y[at, k], y[at + 1, k] - y[at, k]
        bend, over = step * slope[at, k] - rise, step * slope[at + 1, k] - rise
        # Hermite: y0 + z (rise + (1 - z) (bend (1 - z) - over z)).
        found.append(low + z * (rise + (1.0 - z) * (bend * (1.0 - z) - over * z)))
    return found


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
    return np.asarray(solve_banded((1, 1), bands, right), dtype=np.float64)
