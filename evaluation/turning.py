"""Fitted turning points: the extreme sample of a noisy stroke always overreaches and biases the energies.

Three shapes compete at each reversal, over windows of several widths: a polynomial (smooth turn), two
straight or curved flanks that meet (triangular turn), and a plateau (dwell). The residual decides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from evaluation.corners import corner_moment
from evaluation.motion import TurningPoint
from evaluation.record import FloatArray
from evaluation.turn_fits import Fit, flank_fit, grouped, maximum, powers, slope_of, smooth_fit, value_at

_LEVELS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3)
"""Widths of the windows tried: samples within this share of the half-cycle's range below the extreme."""
_LEAST_POINTS = 5
_MANY_POINTS = 12
_MOST_POINTS = 400
"""Samples of a window are averaged in groups down to this many points."""
_CONSISTENT = 1.3
"""A fit is consistent when its residual is within this factor of the noise."""
_ONE_SIDED = 0.01
"""A turn this close to the record's end (share of the stroke on its other side) is seen from one side."""
_EDGE_SHARES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5)
_STRAIGHT = 1e-3
_EDGE_MISSING = 0.003
"""A turn belongs to the record when no more than this share of the stroke is missing at its end."""
_PLATEAU_BANDS = (0.001, 0.003, 0.01)
"""Half-widths of the bands, as shares of the height; the wider ones see a dwell during which it creeps."""
_PLATEAU_NOISE = 6.5
_DWELL_SAMPLES = 5
_PLATEAU_WIDER = 9.0
_PLATEAU_RATIO = 1.8
"""Time within nine bands over time within one: 3 for a parabola, 9 for a triangle, towards 1 for a dwell."""


@dataclass(frozen=True, eq=False)
class _Side:
    """The neighbourhood of one reversal, turned so that the extreme is a maximum."""

    time_s: FloatArray
    value: FloatArray
    peak: int
    first: int
    """Index of the window's first sample in the record."""
    height: float
    open_left: bool
    open_right: bool
    sigma: float
    least_samples: int
    """Samples that a dwell needs to be one."""


def _window(side: _Side, share: float) -> slice:
    """Return the samples about the peak that lie within ``share`` of the height below it."""
    level = side.value[side.peak] - share * side.height - 2.0 * side.sigma
    return _run_above(side.value, side.peak, level)


def _smooth_degree(points: int) -> int:
    """Return 4 where there are points for it: a parabola's misfit hides in noise and shifts the turn."""
    return 4 if points > _LEAST_POINTS else 2


def _candidates(side: _Side) -> list[Fit]:
    windows = dict.fromkeys((w.start, w.stop) for w in (_window(side, share) for share in _LEVELS))
    wide_enough = [w for w in windows if w[1] - w[0] >= _LEAST_POINTS]
    if not wide_enough:  # few samples, or a turn near the end of the record
        near = (max(0, side.peak - _LEAST_POINTS + 1), min(side.value.size, side.peak + _LEAST_POINTS))
        wide_enough = [near] if near[1] - near[0] >= _LEAST_POINTS else []
    fits: list[Fit] = []
    for first, last in wide_enough:
        time_s, value, group = grouped(side.time_s[first:last], side.value[first:last], _MOST_POINTS)
        scale = float(np.sqrt(group))
        noise = side.sigma / scale
        tried = (
            smooth_fit(time_s, value, _smooth_degree(time_s.size), noise),
            flank_fit(time_s, value, 2 if time_s.size >= _MANY_POINTS else 1, noise),
        )
        fits += [replace(f, residual=f.residual * scale) for f in tried if f is not None]
    return fits


def _best(side: _Side) -> Fit | None:
    fits = _candidates(side)
    return _chosen(fits, side) if fits else None


def _chosen(fits: list[Fit], side: _Side) -> Fit:
    """Return the surest of the fits whose residual is no more than noise."""
    noise = max(side.sigma, min(fit.residual for fit in fits), 1e-6 * side.height)
    consistent = [fit for fit in fits if fit.residual <= _CONSISTENT * noise]
    return min(consistent, key=lambda fit: fit.u)


@dataclass(frozen=True)
class _Dwell:
    """A dwell: when and where the stroke arrives and leaves (turned as the side is), and its first sample."""

    arrive_s: float
    arrive: float
    leave_s: float
    leave: float
    index: int
    u: float
    u_arrive_s: float
    u_leave_s: float


def _plateau(side: _Side) -> _Dwell | None:
    """Return the dwell about the peak, if it is one, at the finest scale at which it shows."""
    for share in _PLATEAU_BANDS:
        band = max(_PLATEAU_NOISE * side.sigma, share * side.height)
        near = side.value[_run_above(side.value, side.peak, side.value[side.peak] - 2.0 * band)]
        level = float(np.median(near))
        inner = _run_above(side.value, side.peak, level - band)
        outer = _run_above(side.value, side.peak, level - _PLATEAU_WIDER * band)
        if inner.stop - inner.start < side.least_samples:
            continue
        inner_s = side.time_s[inner.stop - 1] - side.time_s[inner.start]
        outer_s = side.time_s[outer.stop - 1] - side.time_s[outer.start]
        if outer_s <= _PLATEAU_RATIO * inner_s:
            return _dwell(side, inner, outer, level, band)
    return None


def _dwell(side: _Side, inner: slice, outer: slice, level: float, band: float) -> _Dwell:
    time, value = side.time_s[inner], side.value[inner]
    rise_s = float(time[0] - side.time_s[outer.start])
    fall_s = float(side.time_s[outer.stop - 1] - time[-1])
    climb = (_PLATEAU_WIDER - 1.0) * band
    arrive_s, arrive = _corner(time, value, level - band, rise_s / climb)
    leave_s, leave = _corner(-time[::-1], value[::-1], level - band, fall_s / climb)
    u = float(np.std(np.diff(value))) / float(np.sqrt(2.0 * value.size))
    u_arrive_s = u_leave_s = _step_s(side)
    if (at := corner_moment(side.time_s, side.value, inner.start, arrive, band, side.sigma)) is not None:
        arrive_s, u_arrive_s = at
    back = side.value.size - inner.stop
    if (at := corner_moment(-side.time_s[::-1], side.value[::-1], back, leave, band, side.sigma)) is not None:
        leave_s, u_leave_s = at
    arrive_s = min(arrive_s, 0.5 * float(time[0] + time[-1]))
    leave_s = min(leave_s, -0.5 * float(time[0] + time[-1]))
    index = inner.start + int(np.searchsorted(time, arrive_s))
    return _Dwell(
        arrive_s, arrive, max(-leave_s, arrive_s), leave, side.first + index, u, u_arrive_s, u_leave_s
    )


def _corner(time: FloatArray, value: FloatArray, entered: float, slowness: float) -> tuple[float, float]:
    """Return time and value where a flank, which enters the band at ``time[0]``, meets the dwell.

    ``slowness`` is the flank's time per value. The value is the median just behind the corner, so that
    creep during the dwell does not shift it.
    """
    middle = 0.5 * float(time[0] + time[-1])
    corner, level = float(time[0]), float(np.median(value))
    for _ in range(3):
        corner = min(float(time[0]) + max(level - entered, 0.0) * slowness, middle)
        first = min(int(np.searchsorted(time, corner)), time.size - 5)
        span = max(2.0 * abs(level - entered) * slowness, 0.02 * float(time[-1] - time[0]))
        last = max(int(np.searchsorted(time, corner + span)), first + 5)
        level = float(np.median(value[first:last]))
    return corner, level


def _run_above(value: FloatArray, peak: int, level: float) -> slice:
    """Return the samples about the peak, at least itself, that are not below a level."""
    before = _first_below(value[:peak][::-1], level)
    after = _first_below(value[peak + 1 :], level)
    return slice(peak - before, peak + 1 + after)


def _first_below(value: FloatArray, level: float) -> int:
    """Return the index of the first sample below a level, or the size; looks no further than it must."""
    start, size = 0, 64
    while start < value.size:
        below = value[start : start + size] < level
        if below.any():
            return start + int(np.argmax(below))
        start, size = start + size, 2 * size
    return value.size


def _edge_fit(side: _Side) -> Fit:
    """Return the turning point at an end of the record, from the one side that is there.

    Where a polynomial over the last part of the stroke has its maximum on record, or so little beyond that
    no more than 0.3 % of the stroke is missing, the maximum is the turning point. Further beyond, the turn
    is cut off. Without any maximum (triangle), the end itself is the turning point.
    """
    fits = []
    for share in _EDGE_SHARES:
        window = _window(side, share)
        time_s, value, group = grouped(side.time_s[window], side.value[window], _MOST_POINTS)
        if time_s.size < _LEAST_POINTS:
            continue
        fits.append(_one_sided(side, time_s, value, _smooth_degree(time_s.size), group))
    if not fits:
        end_s, end = float(side.time_s[side.peak]), float(side.value[side.peak])
        return Fit("edge", end_s, end, side.sigma, side.sigma)
    return _chosen(fits, side)


def _one_sided(side: _Side, time_s: FloatArray, value: FloatArray, degree: int, group: int) -> Fit:
    end_s = float(side.time_s[side.peak])
    span = float(time_s[-1] - time_s[0])
    z = (time_s - end_s) / span
    matrix = powers(z, degree)
    inverse = np.linalg.inv(matrix.T @ matrix)
    coefficients = inverse @ (matrix.T @ value)
    error = value - matrix @ coefficients
    residual = float(np.sqrt(error @ error / (time_s.size - degree - 1)))
    u = max(residual, side.sigma / float(np.sqrt(group))) * float(np.sqrt(inverse[0, 0]))
    residual *= float(np.sqrt(group))
    vertex = maximum(coefficients.tolist(), 0.0)
    if vertex is None:
        bend, steep = float(coefficients[2]), abs(float(coefficients[1]))
        u_bend = residual / float(np.sqrt(group)) * float(np.sqrt(inverse[2, 2]))
        turning = bend < -max(3.0 * u_bend, _STRAIGHT * steep)
        return Fit("cut" if turning else "edge", end_s, float(coefficients[0]), residual, u)
    top = value_at(coefficients.tolist(), vertex)
    on_record = float(z[0]) <= vertex <= float(z[-1])
    reached = on_record or top - float(coefficients[0]) <= _EDGE_MISSING * side.height + 3.0 * u
    if not reached:
        return Fit("cut", end_s + span * vertex, top, residual, u)
    bend = -value_at(slope_of(slope_of(coefficients.tolist())), vertex)
    row = np.arange(degree + 1.0) * vertex ** np.maximum(np.arange(degree + 1) - 1, 0)
    scatter = max(residual, side.sigma) / float(np.sqrt(group))
    u_s = span * scatter * float(np.sqrt(row @ inverse @ row)) / bend
    return Fit("edge", end_s + span * vertex, top, residual, u, u_s)


def fit_turning_point(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    index: int,
    limits: tuple[int, int],
    kind: Literal["lower", "upper"],
    sigma_mm: float,
    *,
    at_end: tuple[bool, bool] = (True, True),
    held: int = 1,
) -> TurningPoint:
    """Fit one reversal of the stroke.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
    index : int
        Sample of the coarse extreme.
    limits : (int, int)
        First and last sample that may be used: the neighbouring reversals, or a break of the record.
    kind : "lower" or "upper"
    sigma_mm : float
        Noise of the stroke.
    at_end : (bool, bool)
        Whether the record (or an unbroken stretch of it) begins and ends at the limits.
    held : int
        Samples for which a value is held (:func:`evaluation.reversals.held_samples`).

    Returns
    -------
    TurningPoint
        ``edge`` or ``cut`` when only one side of the turn is on record.
    """
    side = _side(time_s, stroke_mm, index, limits, kind, sigma_mm, at_end, held)
    sign = 1.0 if kind == "upper" else -1.0
    dwell = _plateau(side)
    if dwell is not None:
        return TurningPoint(
            time_s=dwell.arrive_s,
            leave_s=dwell.leave_s,
            stroke_mm=sign * dwell.arrive,
            leave_mm=sign * dwell.leave,
            kind=kind,
            index=dwell.index,
            method="plateau",
            u_stroke_mm=dwell.u,
            u_time_s=dwell.u_arrive_s,
            u_leave_s=dwell.u_leave_s,
        )
    fit = None if side.open_left or side.open_right else _best(side)
    if fit is None:
        fit = _edge_fit(side)
    moment = float(time_s[index]) if fit.method == "cut" else fit.time_s
    nearest = side.first + int(np.argmin(np.abs(side.time_s - moment)))
    stroke = sign * fit.value
    # Where nothing was fitted that has a vertex, the moment is known to a step of the samples.
    u_s = fit.u_s if fit.u_s > 0.0 else _step_s(side)
    return TurningPoint(moment, moment, stroke, stroke, kind, nearest, fit.method, fit.u, u_s, u_s)


def _step_s(side: _Side) -> float:
    return float(side.time_s[-1] - side.time_s[0]) / max(1, side.time_s.size - 1)


def _side(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    index: int,
    limits: tuple[int, int],
    kind: Literal["lower", "upper"],
    sigma_mm: float,
    at_end: tuple[bool, bool],
    held: int,
) -> _Side:
    first, last = limits
    sign = 1.0 if kind == "upper" else -1.0
    value = sign * stroke_mm[first : last + 1]
    peak = index - first
    left = float(value[peak] - np.min(value[: peak + 1]))
    right = float(value[peak] - np.min(value[peak:]))
    least = 20.0 * sigma_mm + 1e-12
    open_left = left <= max(least, _ONE_SIDED * right if at_end[0] else 0.0)
    open_right = right <= max(least, _ONE_SIDED * left if at_end[1] else 0.0)
    heights = [height for height, is_open in ((left, open_left), (right, open_right)) if not is_open]
    return _Side(
        time_s=time_s[first : last + 1],
        value=value,
        peak=peak,
        first=first,
        height=min(heights, default=max(left, right, 1e-12)),
        open_left=open_left,
        open_right=open_right,
        sigma=sigma_mm,
        least_samples=_DWELL_SAMPLES * held,
    )
