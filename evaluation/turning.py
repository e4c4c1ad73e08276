"""Fitted turning points: the extreme sample of a noisy stroke always overreaches and biases the energies.

Three shapes compete at each reversal, over windows of several widths: a polynomial (smooth turn), two
straight or curved flanks that meet (triangular turn), and a plateau (dwell). The residual decides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from evaluation.motion import TurningPoint, TurnMethod
from evaluation.record import FloatArray

_LEVELS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3)
"""Widths of the windows tried: samples within this share of the half-cycle's range below the extreme."""
_MOST_POINTS = 400
"""Samples of a window are averaged in groups down to this many points."""
_CONSISTENT = 1.3
"""A fit is consistent when its residual is within this factor of the noise."""
_EDGE_SHARES = (0.1, 0.2, 0.3, 0.5)
_EDGE_BEYOND = 0.1
_PLATEAU_BANDS = (0.001, 0.003, 0.01)
"""Half-widths of the bands, as shares of the height; the wider ones see a dwell during which it creeps."""
_PLATEAU_NOISE = 6.5
_PLATEAU_WIDER = 9.0
_PLATEAU_RATIO = 1.8
"""Time within nine bands over time within one: 3 for a parabola, 9 for a triangle, towards 1 for a dwell."""


@dataclass(frozen=True)
class _Fit:
    method: TurnMethod
    time_s: float
    value: float
    residual: float
    u: float


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


def _grouped(time_s: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray, int]:
    group = max(1, -(-time_s.size // _MOST_POINTS))
    if group == 1:
        return time_s, value, 1
    whole = (time_s.size // group) * group
    shape = (-1, group)
    return time_s[:whole].reshape(shape).mean(axis=1), value[:whole].reshape(shape).mean(axis=1), group


def _value(coefficients: list[float], z: float) -> float:
    total = 0.0
    for coefficient in reversed(coefficients):
        total = total * z + coefficient
    return total


def _slope(coefficients: list[float]) -> list[float]:
    return [k * c for k, c in enumerate(coefficients)][1:]


def _powers(z: FloatArray, degree: int) -> FloatArray:
    matrix = np.empty((z.size, degree + 1))
    matrix[:, 0] = 1.0
    for k in range(degree):
        matrix[:, k + 1] = matrix[:, k] * z
    return matrix


def _maximum(coefficients: list[float], guess: float) -> float | None:
    """Return where a polynomial has its maximum near ``guess`` inside ±0.9, by Newton's method."""
    slope = _slope(coefficients)
    bend = _slope(slope)
    z = guess
    for _ in range(12):
        curvature = _value(bend, z)
        if curvature >= 0.0:
            return None
        step = _value(slope, z) / curvature
        z -= step
        if abs(z) > 0.9:
            return None
        if abs(step) < 1e-12:
            break
    return z


def _smooth_fit(time_s: FloatArray, value: FloatArray, degree: int) -> _Fit | None:
    """Fit a polynomial and return its maximum inside the window."""
    spare = time_s.size - degree - 1
    if spare < 1:
        return None
    middle, half = 0.5 * float(time_s[0] + time_s[-1]), 0.5 * float(time_s[-1] - time_s[0])
    matrix = _powers((time_s - middle) / half, degree)
    normal = matrix.T @ matrix
    inverse = np.linalg.inv(normal)
    coefficients = inverse @ (matrix.T @ value)
    fitted = matrix @ coefficients
    error = value - fitted
    residual = float(np.sqrt(error @ error / spare))
    top = _maximum(coefficients.tolist(), float(matrix[np.argmax(fitted), 1]))
    if top is None:
        return None
    row = top ** np.arange(degree + 1)
    gain = float(np.sqrt(row @ inverse @ row))
    height = _value(coefficients.tolist(), top)
    return _Fit("polynomial", middle + half * top, height, residual, residual * gain)


def _flank(z: FloatArray, value: FloatArray, degree: int) -> tuple[list[float], float, FloatArray] | None:
    if z.size < degree + 2:
        return None
    scale = float(np.max(np.abs(z)))
    stretch = scale ** -np.arange(degree + 1.0)
    matrix = _powers(z / scale, degree)
    inverse = np.linalg.inv(matrix.T @ matrix)
    coefficients = inverse @ (matrix.T @ value)
    error = value - matrix @ coefficients
    return (coefficients * stretch).tolist(), float(error @ error), inverse * np.outer(stretch, stretch)


def _meeting(left: list[float], right: list[float]) -> float | None:
    """Return where two flanks of first or second degree meet, closest to 0."""
    c0, c1, c2 = ([a - b for a, b in zip(left, right, strict=True)] + [0.0])[:3]
    if c1 == 0.0:
        return None
    straight = -c0 / c1
    discriminant = 1.0 - 4.0 * c0 * c2 / c1**2
    if discriminant < 0.0:
        return None
    return 2.0 * straight / (1.0 + float(np.sqrt(discriminant)))


def _flank_fit(time_s: FloatArray, value: FloatArray, degree: int) -> _Fit | None:
    """Fit both flanks and return where they meet."""
    spare = time_s.size - 1 - 2 * (degree + 1)
    at = int(np.argmax(value))
    half = 0.5 * float(time_s[-1] - time_s[0])
    z = (time_s - time_s[at]) / half
    left, right = _flank(z[:at], value[:at], degree), _flank(z[at + 1 :], value[at + 1 :], degree)
    if left is None or right is None or spare < 1:
        return None
    meet = _meeting(left[0], right[0])
    near = 1.5 * float(np.max(np.diff(z[max(0, at - 2) : at + 3])))
    if meet is None or abs(meet) > near:
        return None
    if _value(_slope(left[0]), meet) <= 0.0 or _value(_slope(right[0]), meet) >= 0.0:
        return None
    residual = float(np.sqrt((left[1] + right[1]) / spare))
    row = meet ** np.arange(degree + 1)
    gain = 0.5 * float(np.sqrt(row @ left[2] @ row + row @ right[2] @ row))
    peak = _value(left[0], meet)
    return _Fit("lines", float(time_s[at]) + half * meet, peak, residual, residual * gain)


def _window(side: _Side, share: float) -> slice:
    """Return the samples about the peak that lie within ``share`` of the height below it."""
    level = side.value[side.peak] - share * side.height - 2.0 * side.sigma
    below = np.flatnonzero(side.value < level)
    left = below[below < side.peak]
    right = below[below > side.peak]
    first = int(left[-1]) + 1 if left.size else 0
    last = int(right[0]) if right.size else side.value.size
    return slice(first, last)


def _candidates(side: _Side) -> list[_Fit]:
    fits: list[_Fit] = []
    previous = slice(-1, -1)
    for share in _LEVELS:
        window = _window(side, share)
        if window == previous or window.stop - window.start < 5:
            continue
        previous = window
        time_s, value, group = _grouped(side.time_s[window], side.value[window])
        scale = np.sqrt(group)
        tried = [_smooth_fit(time_s, value, 2), _smooth_fit(time_s, value, 4)]
        tried += [_flank_fit(time_s, value, 1), _flank_fit(time_s, value, 2)]
        fits += [_Fit(f.method, f.time_s, f.value, f.residual * scale, f.u) for f in tried if f is not None]
    return fits


def _best(side: _Side) -> _Fit | None:
    fits = _candidates(side)
    if not fits:
        return None
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


def _plateau(side: _Side) -> _Dwell | None:
    """Return the dwell about the peak, if it is one, at the finest scale at which it shows."""
    for share in _PLATEAU_BANDS:
        band = max(_PLATEAU_NOISE * side.sigma, share * side.height)
        near = side.value[_run_above(side.value, side.peak, side.value[side.peak] - 2.0 * band)]
        level = float(np.median(near))
        inner = _run_above(side.value, side.peak, level - band)
        outer = _run_above(side.value, side.peak, level - _PLATEAU_WIDER * band)
        if inner.stop - inner.start < 5:
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
    index = inner.start + int(np.searchsorted(time, arrive_s))
    return _Dwell(arrive_s, arrive, max(-leave_s, arrive_s), leave, side.first + index, u)


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
    below = np.flatnonzero(value < level)
    at = int(np.searchsorted(below, peak))
    first = int(below[at - 1]) + 1 if at > 0 else 0
    last = int(below[at]) if at < below.size else value.size
    return slice(first, max(last, first + 1))


def _edge_fit(side: _Side) -> _Fit:
    """Return the turning point at an end of the record, from the one side that is there.

    Where a polynomial over the last part of the stroke has its maximum at that end, or so little outside that
    no more than a tenth of the window is missing, the maximum is the
    turning point. Further outside, the turn is cut off. Without any (triangle), the end itself is it.
    """
    end_s, end_value = float(side.time_s[side.peak]), float(side.value[side.peak])
    window = next((w for w in (_window(side, share) for share in _EDGE_SHARES) if w.stop - w.start > 7), None)
    if window is None:
        window = _window(side, _EDGE_SHARES[-1])
    time_s, value, _ = _grouped(side.time_s[window], side.value[window])
    if time_s.size < 4:
        return _Fit("edge", end_s, end_value, side.sigma, side.sigma)
    span = float(time_s[-1] - time_s[0])
    matrix = _powers((time_s - end_s) / span, min(4, time_s.size - 2))
    inverse = np.linalg.inv(matrix.T @ matrix)
    coefficients = inverse @ (matrix.T @ value)
    error = value - matrix @ coefficients
    residual = float(np.sqrt(error @ error / max(1, time_s.size - matrix.shape[1])))
    u = residual * float(np.sqrt(inverse[0, 0]))
    vertex = _maximum(coefficients.tolist(), 0.0)
    if vertex is not None:
        method: TurnMethod = "edge" if abs(vertex) < _EDGE_BEYOND else "cut"
        return _Fit(method, end_s + span * vertex, _value(coefficients.tolist(), vertex), residual, u)
    return _Fit("edge", end_s, float(coefficients[0]), residual, u)


def fit_turning_point(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    index: int,
    limits: tuple[int, int],
    kind: Literal["lower", "upper"],
    sigma_mm: float,
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

    Returns
    -------
    TurningPoint
        ``edge`` or ``cut`` when only one side of the turn is on record.
    """
    side = _side(time_s, stroke_mm, index, limits, kind, sigma_mm)
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
        )
    fit = None if side.open_left or side.open_right else _best(side)
    if fit is None:
        fit = _edge_fit(side)
    moment = float(time_s[index]) if fit.method == "cut" else fit.time_s
    nearest = side.first + int(np.argmin(np.abs(side.time_s - moment)))
    stroke = sign * fit.value
    return TurningPoint(moment, moment, stroke, stroke, kind, nearest, fit.method, fit.u)


def _side(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    index: int,
    limits: tuple[int, int],
    kind: Literal["lower", "upper"],
    sigma_mm: float,
) -> _Side:
    first, last = limits
    sign = 1.0 if kind == "upper" else -1.0
    value = sign * stroke_mm[first : last + 1]
    peak = index - first
    left = float(value[peak] - np.min(value[: peak + 1]))
    right = float(value[peak] - np.min(value[peak:]))
    least = 20.0 * sigma_mm + 1e-12
    open_left, open_right = left <= least, right <= least
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
    )
