"""The loop of force over stroke of one cycle, cut exactly at the fitted turning points."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from evaluation.motion import Cycle, Loop
from evaluation.record import FloatArray, Record
from evaluation.smoothing import polynomial

DENSE_SAMPLES = 200
"""A branch with fewer samples is interpolated (cubic spline over time, each branch by itself), because the
polygon through N points of a cycle encloses too little: -0.26 % at 50, -0.07 % at 100 (wire-facts 3.3)."""
_DENSE_POINTS = 800
_MOST_POINTS = 1000
"""A branch with more samples is averaged in groups: the noise of force times that of stroke adds up with
the number of samples, while the polygon of 2000 points is right to 2 parts in a million."""
_LEAST_STEP = 0.5
"""A sample nearer than this share of a step to a turning point is left out: that point stands for it."""
END_SHARE = 0.02
"""Share of a branch from which the force at its turning point is extrapolated."""
_LEAST_END_SAMPLES = 4
_MOST_END_SAMPLES = 400


def cut_loop(record: Record, cycle: Cycle) -> Loop:
    """Return the loop of one cycle with both lower turning points and the upper one as points of it.

    The force at a turning point is extrapolated from both branches over their last 2 % (at least four
    samples) and, where stroke passes through without dwell, is the mean of the two.

    Parameters
    ----------
    record : Record
    cycle : Cycle
        One of :func:`evaluation.cycles.find_cycles`, complete.

    Returns
    -------
    Loop
    """
    start_s, top_s, leave_s, end_s = cycle.start_s, cycle.top.time_s, cycle.top.leave_s, cycle.end_s
    up = _branch(record, start_s, top_s)
    down = _branch(record, leave_s, end_s)
    top_up, top_down = _end_force(up, top_s, last=True), _end_force(down, leave_s, last=False)
    if cycle.top.dwell_s == 0.0:
        top_up = top_down = 0.5 * (top_up + top_down)
    loading = _closed(
        up,
        (start_s, cycle.stroke_min_mm, _end_force(up, start_s, last=False)),
        (top_s, cycle.stroke_max_mm, top_up),
    )
    unloading = _closed(
        down,
        (leave_s, cycle.top.leave_mm, top_down),
        (end_s, cycle.stroke_end_mm, _end_force(down, end_s, last=True)),
    )
    top = loading.shape[1] - 1
    if cycle.top.dwell_s > 0.0:
        dwell = np.stack(_branch(record, top_s, leave_s))
        whole = np.concatenate((loading, dwell, unloading), axis=1)
        return Loop(whole[0], whole[1], whole[2], top, top + dwell.shape[1] + 1)
    whole = np.concatenate((loading, unloading[:, 1:]), axis=1)
    return Loop(whole[0], whole[1], whole[2], top, top)


def _branch(record: Record, start_s: float, end_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    first = int(np.searchsorted(record.time_s, start_s, side="right"))
    last = int(np.searchsorted(record.time_s, end_s, side="left"))
    inside = slice(first, last)
    return record.time_s[inside], record.stroke_mm[inside], record.force_kN[inside]


def _end_force(branch: tuple[FloatArray, FloatArray, FloatArray], at_s: float, *, last: bool) -> float:
    """Return the force of a branch at its end, from a line (few samples: a parabola) over its end."""
    time, _, force = branch
    count = int(np.clip(END_SHARE * time.size, _LEAST_END_SAMPLES, _MOST_END_SAMPLES))
    part = slice(-count, None) if last else slice(0, count)
    near, value = time[part] - at_s, force[part]
    if near.size == 0:
        return float("nan")
    scale = float(np.max(np.abs(near))) or 1.0
    degree = min(2 if near.size <= 2 * _LEAST_END_SAMPLES else 1, near.size - 1)
    return float(polynomial(near / scale, value, degree)[0])


def _closed(
    branch: tuple[FloatArray, FloatArray, FloatArray],
    first: tuple[float, float, float],
    last: tuple[float, float, float],
) -> FloatArray:
    """Return time, stroke and force (3, M) of a branch with its end points, dense enough to integrate."""
    inner = np.stack(branch)
    if inner.shape[1] > 2:
        # Noise on two points that are nearer to each other than samples are would bend a spline at will.
        near_s = _LEAST_STEP * (inner[0, -1] - inner[0, 0]) / (inner.shape[1] - 1)
        inner = inner[:, (inner[0] - first[0] >= near_s) & (last[0] - inner[0] >= near_s)]
    group = -(-inner.shape[1] // _MOST_POINTS)
    if group > 1:
        whole = inner.shape[1] // group * group
        rest = inner[:, whole:].mean(axis=1, keepdims=True) if whole < inner.shape[1] else inner[:, :0]
        inner = np.hstack((inner[:, :whole].reshape(3, -1, group).mean(axis=2), rest))
    columns = np.column_stack((first, inner, last))
    time = columns[0]
    apart = np.concatenate(([True], np.diff(time) > 1e-9 * (time[-1] - time[0])))
    apart[-1] = True
    columns = columns[:, apart]
    if columns.shape[1] >= DENSE_SAMPLES or columns.shape[1] < 4:
        return columns
    fine = np.linspace(columns[0, 0], columns[0, -1], _DENSE_POINTS)
    return np.vstack((fine, CubicSpline(columns[0], columns[1:], axis=1)(fine)))
