"""Shapes that are fitted to reversals: a polynomial for a smooth turn, two flanks for a sharp one.

All windows of all reversals of a run are fitted at once: rows of points, padded to one length, whose normal
equations are solved together. A window by itself would cost a thousand times its arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache

import numpy as np

from bufferstand.evaluation.numerics.arrays import BoolArray, FloatArray, IndexArray

MOST_POINTS = 100
"""Samples of a window are averaged in groups down to this many points."""
MANY_POINTS = 12
"""Flanks are parabolas from so many points on, else straight lines."""
LEAST_POINTS = 5
UNSURE_POINTS = 6
"""Of six points a quartic leaves one misfit, and of a turn midway between two of them none, however sharp it
is: what a parabola says instead tells how sure it is."""
_LAST_STEP = 1e-7
"""Newton's method squares what is left: after so small a step it is as small as rounding."""
_TIP_SLACK = 0.25
"""Flanks may meet so much further out than half a step of the samples."""
_TOLD = 5.0
"""A fourth term of so many standard deviations is one."""
_MANY_POINTS = 16
"""Of so many points a quartic leaves what it leaves of the curve itself; of fewer, what it misses stays in
the bounds of what few samples may hide."""
_NEAR_MIDDLE = 0.5
"""A summit so near to the middle of its window, in half-widths, is one of which its terms say more."""
_CHUNK_POINTS = 100_000
"""Points that are fitted together: what is made of them stays in the processor's cache."""

_FEW_ALIKE = 50
"""Of fewer rows of one number of points each has a matrix of its own."""
_LEAST_ALIKE = 8
"""So many rows of one number of points are fitted by one matrix …"""
_EVEN = 1e-4
"""… whose points lie within this share of a step of where even ones would."""


@dataclass(frozen=True, eq=False)
class WindowPoints:
    """Points of many windows, a row each: ``count`` (R,) of the (R, P) are points, the rest is padding.

    ``group`` (R,): samples that were averaged to a point. Values are turned so that each is a maximum.
    """

    time_s: FloatArray
    value: FloatArray
    count: IndexArray
    group: IndexArray

    @cached_property
    def used(self) -> BoolArray:
        """Which of the (R, P) are points."""
        return np.asarray(np.arange(self.time_s.shape[1]) < self.count[:, None])

    def rows(self, chosen: IndexArray | slice) -> WindowPoints:
        """Return some of the rows."""
        return WindowPoints(self.time_s[chosen], self.value[chosen], self.count[chosen], self.group[chosen])


@dataclass(frozen=True, eq=False)
class Fits:
    """Fitted reversals, shape (R,) each: moment, height, residual (one sample's), u of height and of moment.

    Where a fit is none, residual and u are infinite. ``rise`` and ``fall``: slopes of both flanks where they
    meet [mm/s], ``bend`` the greater of half their curvatures [mm/s²]; 0 for smooth turns.
    """

    time_s: FloatArray
    value: FloatArray
    residual: FloatArray
    u: FloatArray
    u_s: FloatArray
    rise: FloatArray
    fall: FloatArray
    bend: FloatArray

    @classmethod
    def none(cls, rows: int) -> Fits:
        """Return rows without a fit."""
        zero, never = np.zeros((5, rows)), np.full((3, rows), np.inf)
        return cls(zero[0], zero[1], *never, *zero[2:])

    def rows(self, chosen: BoolArray) -> Fits:
        """Return some of the rows."""
        return Fits(*(getattr(self, own.name)[chosen] for own in fields(self)))

    def put(self, chosen: IndexArray | slice, fits: Fits) -> None:
        """Write the fits of some of the rows."""
        for own in fields(self):
            getattr(self, own.name)[chosen] = getattr(fits, own.name)


def points_of(
    time_s: FloatArray, value: FloatArray, sign: FloatArray, first: IndexArray, last: IndexArray
) -> WindowPoints:
    """Return the points of windows ``first`` … ``last`` (excluded), at most :data:`MOST_POINTS` of each.

    ``sign`` (R,) turns lower reversals upside down.
    """
    size = last - first
    group = np.maximum(1, -(-size // MOST_POINTS))
    count = size // group
    # The sums below end where the next group begins, which must be a sample of the record.
    count -= (first + count * group == value.size) & (group > 1)
    width = int(np.max(count, initial=1))
    at = first[:, None] + group[:, None] * np.minimum(np.arange(width + 1), count[:, None])
    if np.all(group == 1):
        at = np.minimum(at[:, :-1], last[:, None] - 1)
        time, level = time_s[at], value[at]
    else:
        flat = np.minimum(at, value.size - 1).ravel()
        time, level = (np.add.reduceat(a, flat).reshape(at.shape)[:, :-1] for a in (time_s, value))
        time, level = time / group[:, None], level / group[:, None]
        single = group == 1
        alone = np.minimum(at[single, :-1], last[single, None] - 1)
        time[single], level[single] = time_s[alone], value[alone]
    level *= sign[:, None]
    return WindowPoints(time, level, np.maximum(count, 0), group)


def smooth_fits(points: WindowPoints, sigma: float, averaged: int = 1) -> Fits:
    """Return the polynomial of every row; ``sigma`` is the noise of a sample.

    ``averaged``: what the samples are means of. A mean over h lies h² / 24 of the curvature inside the turn,
    which is given back.
    """
    few = points.count <= LEAST_POINTS
    # A parabola's misfit hides in noise and shifts the turn: fourth degree where there are points for it.
    return _in_parts(points, few, lambda part, is_few: _smooth(part, 2 if is_few else 4, sigma, averaged))


def sharp_fits(points: WindowPoints, sigma: float) -> Fits:
    """Return the flanks of every row."""
    few = points.count < MANY_POINTS
    return _in_parts(points, few, lambda part, is_few: _flanks(part, 1 if is_few else 2, sigma))


def _in_parts(points: WindowPoints, few: BoolArray, fit: Callable[[WindowPoints, bool], Fits]) -> Fits:
    """Fit so many rows at a time that what is made of them stays in the processor's cache."""
    step = max(1, _CHUNK_POINTS // points.time_s.shape[1])
    if 0 < few.size <= step and (few.all() or not few.any()):
        return fit(points, bool(few[0]))
    found = Fits.none(few.size)
    for is_few in (True, False):
        rows = np.flatnonzero(few == is_few)
        for start in range(0, rows.size, step):
            part = rows[start : start + step]
            joined = part[-1] - part[0] + 1 == part.size
            own = slice(int(part[0]), int(part[-1]) + 1) if joined else part
            found.put(own, fit(points.rows(own), is_few))
    return found


def powers(z: FloatArray, degree: int) -> FloatArray:
    """Return the powers 0 … degree of ``z``, shape (..., degree + 1)."""
    matrix = np.empty((*z.shape, degree + 1))
    matrix[..., 0] = 1.0
    for k in range(degree):
        matrix[..., k + 1] = matrix[..., k] * z
    return matrix


def value_at(coefficients: FloatArray, z: FloatArray) -> FloatArray:
    """Return polynomials, shape (R, degree + 1) from the lowest power, at one z each (Horner's scheme)."""
    total = coefficients[:, -1]
    for k in range(coefficients.shape[1] - 2, -1, -1):
        total = total * z + coefficients[:, k]
    return total


def derivative(coefficients: FloatArray) -> FloatArray:
    """Return the coefficients of the derivatives of polynomials, shape (R, degree)."""
    return coefficients[:, 1:] * np.arange(1.0, coefficients.shape[1])


def solved(
    z: FloatArray, value: FloatArray, used: BoolArray, degree: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return coefficients, inverse of the normal matrix, fitted values and the sum of squared errors."""
    matrix = powers(z, degree) * used[..., None]
    turned = matrix.transpose(0, 2, 1)
    normal = turned @ matrix
    # A row that cannot be solved gets a matrix that can; its count of points rules it out later.
    weak = np.count_nonzero(used, axis=1) <= degree
    normal[weak] = np.eye(degree + 1)
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    coefficients = (inverse @ (turned @ value[..., None]))[..., 0]
    fitted = (matrix @ coefficients[..., None])[..., 0]
    error = np.where(used, value - fitted, 0.0)
    return coefficients, inverse, fitted, np.einsum("rp,rp->r", error, error)


@lru_cache(maxsize=256)
def _even_solution(number: int, degree: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return even points from -1 to 1, their powers, the inverse of the normal matrix, and the solution."""
    even = np.linspace(-1.0, 1.0, number)
    matrix = powers(even, degree)
    common = np.asarray(np.linalg.inv(matrix.T @ matrix), dtype=np.float64)
    return even, matrix, common, matrix @ common


@lru_cache(maxsize=4)
def _even_solutions(degree: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return points, powers, solutions and inverses by number of points, padded; NaN where too few."""
    numbers = MOST_POINTS + 1
    even = np.full((numbers, MOST_POINTS), np.nan)
    matrix, solution = np.zeros((2, numbers, MOST_POINTS, degree + 1))
    common = np.zeros((numbers, degree + 1, degree + 1))
    for number in range(degree + 1, numbers):
        own = slice(0, number)
        even[number] = 0.0
        even[number, own], matrix[number, own], common[number], solution[number, own] = _even_solution(
            number, degree
        )
    return even, matrix, solution, common


def _solved_alike(
    z: FloatArray, value: FloatArray, used: BoolArray, degree: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the same where ``z`` runs from -1 to 1: rows of as many even points by one matrix."""
    count = np.count_nonzero(used, axis=1)
    if count.size < _FEW_ALIKE * np.unique(count).size:
        return _solved_row_by_row(z, value, used, count, degree)
    coefficients = np.empty((count.size, degree + 1))
    inverse = np.empty((count.size, degree + 1, degree + 1))
    fitted, errors = np.zeros_like(value), np.empty(count.size)
    other = np.ones(count.size, dtype=bool)
    numbers, times = np.unique(count, return_counts=True)
    for number in numbers[(times >= _LEAST_ALIKE) & (numbers > degree)].tolist():
        rows = np.flatnonzero(count == number)
        even, matrix, common, solution = _even_solution(number, degree)
        rows = rows[np.max(np.abs(z[rows, :number] - even), axis=1) <= _EVEN * (even[1] - even[0])]
        own = value[rows, :number]
        found = own @ solution
        near = found @ matrix.T
        coefficients[rows], inverse[rows], fitted[rows, :number] = found, common, near
        own -= near
        errors[rows] = np.einsum("rp,rp->r", own, own)
        other[rows] = False
    if other.any():
        one = solved(z[other], value[other], used[other], degree)
        coefficients[other], inverse[other], fitted[other], errors[other] = one
    return coefficients, inverse, fitted, errors


def _solved_row_by_row(
    z: FloatArray, value: FloatArray, used: BoolArray, count: IndexArray, degree: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the same by a matrix for each row: where few rows are alike, all at once is faster."""
    even, matrix, solution, common = _even_solutions(degree)
    own = slice(0, z.shape[1])
    inverse = common[count]
    coefficients = (value[:, None, :] @ solution[:, own][count])[:, 0]
    fitted = (matrix[:, own][count] @ coefficients[..., None])[..., 0]
    error = np.where(used, value - fitted, 0.0)
    errors = np.einsum("rp,rp->r", error, error)
    near = np.max(np.abs(z - even[:, own][count]), axis=1) <= _EVEN * 2.0 / np.maximum(count - 1, 1)
    if not near.all():
        other = ~near
        one = solved(z[other], value[other], used[other], degree)
        coefficients[other], inverse[other], fitted[other], errors[other] = one
    return coefficients, inverse, fitted, errors


def _gain(row: FloatArray, inverse: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.maximum(np.einsum("ri,rij,rj->r", row, inverse, row), 0.0)))


def maxima(coefficients: FloatArray, guess: FloatArray) -> FloatArray:
    """Return where polynomials have a maximum near ``guess`` inside ±0.9, by Newton's method; else NaN."""
    slope = derivative(coefficients)
    bend = derivative(slope)
    z = guess.copy()
    lost = np.zeros(z.size, dtype=bool)
    for _ in range(12):
        curvature = value_at(bend, z)
        lost |= curvature >= 0.0
        step = np.where(lost, 0.0, value_at(slope, z) / np.where(curvature < 0.0, curvature, -1.0))
        z = z - step
        lost |= np.abs(z) > 0.9
        if np.all(lost | (np.abs(step) < _LAST_STEP)):
            break
    return np.where(lost, np.nan, z)


def _smooth(points: WindowPoints, degree: int, sigma: float, averaged: int) -> Fits:
    """Fit a polynomial to each row; u is never below what ``sigma`` makes it."""
    count = points.count
    last = np.take_along_axis(points.time_s, count[:, None] - 1, axis=1)[:, 0]
    middle, half = 0.5 * (points.time_s[:, 0] + last), 0.5 * (last - points.time_s[:, 0])
    z = np.where(points.used, (points.time_s - middle[:, None]) / half[:, None], 0.0)
    level = np.where(points.used, points.value, 0.0)
    coefficients, inverse, fitted, errors = _solved_alike(z, level, points.used, degree)
    spare = count - degree - 1
    highest = np.argmax(np.where(points.used, fitted, -np.inf), axis=1)
    top = maxima(coefficients, np.take_along_axis(z, highest[:, None], axis=1)[:, 0])
    good = (spare >= 1) & np.isfinite(top)
    top = np.where(good, top, 0.0)
    residual = np.sqrt(errors / np.maximum(spare, 1))
    scatter = np.maximum(residual, sigma / np.sqrt(points.group))
    row = powers(top, degree)
    # The maximum lies where the slope is 0: an error of the slope moves it by that over the curvature.
    slope_row = np.concatenate((np.zeros((top.size, 1)), np.arange(1.0, degree + 1) * row[:, :-1]), axis=1)
    curvature = np.where(good, value_at(derivative(derivative(coefficients)), top), -1.0)
    step = 2.0 / np.maximum(count - 1, 1)
    inside = step**2 / 24.0 * (1.0 - 1.0 / (averaged * points.group) ** 2)
    flat = np.zeros(top.size)
    value = value_at(coefficients, top) - inside * curvature
    if degree == 4:
        beyond = _beyond_quartic(coefficients, top, scatter**2 * inverse[:, 4, 4])
        value = value + np.where(count >= _MANY_POINTS, beyond, 0.0)
    u = np.where(good, scatter * _gain(row, inverse), np.inf)
    if degree == 4 and (unsure := good & (count == UNSURE_POINTS)).any():
        lower = _solved_alike(z[unsure], level[unsure], points.used[unsure], 2)[0]
        at = maxima(lower, top[unsure])
        apart = np.abs(value[unsure] - value_at(lower, np.nan_to_num(at)))
        u[unsure] = np.maximum(u[unsure], np.where(np.isfinite(at), 0.5 * apart, np.inf))
    return Fits(
        time_s=middle + half * top,
        value=value,
        residual=np.where(good, residual * np.sqrt(points.group), np.inf),
        u=u,
        u_s=half * scatter * _gain(slope_row, inverse) / -curvature,
        rise=flat,
        fall=flat,
        bend=flat,
    )


def _beyond_quartic(coefficients: FloatArray, z: FloatArray, variance: FloatArray) -> FloatArray:
    """Return what a smooth turn has at its summit more than the quartic through even points of it.

    A turn whose second and fourth terms are those of a sine, a2 < 0 < a4, goes on as one, with
    a5 = 3/5 a3 a4 / a2 and a6 = 2/5 a4² / a2. Over -1 … 1 a quartic leaves z⁵ - 10/9 z³ + 5/21 z, and
    z⁶ - 15/11 z⁴ + 5/11 z² - 5/231. Over a fifth of a stroke that is 1e-5 of it, alike at all turns: less
    than the noise of one, more than that of the mean of some. ``variance``: that of a4, which counts where it
    is told from noise.
    """
    second, third, fourth = coefficients[:, 2:].T
    told = (second < 0.0) & (fourth > 0.0) & (fourth**2 > _TOLD**2 * variance) & (np.abs(z) <= _NEAR_MIDDLE)
    bent = np.where(told, fourth / np.where(told, second, -1.0), 0.0)
    square = z * z
    fifth = 0.6 * third * bent * z * ((square - 10.0 / 9.0) * square + 5.0 / 21.0)
    sixth = 0.4 * fourth * bent * (((square - 15.0 / 11.0) * square + 5.0 / 11.0) * square - 5.0 / 231.0)
    return np.asarray(fifth + sixth)


def _meeting(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return where two flanks of first or second degree meet, closest to 0; NaN where they do not."""
    c = left - right
    c0, c1, c2 = c[:, 0], c[:, 1], c[:, 2] if c.shape[1] > 2 else np.zeros(len(c))
    safe = np.where(c1 == 0.0, 1.0, c1)
    discriminant = np.where(c1 == 0.0, -1.0, 1.0 - 4.0 * c0 * c2 / safe**2)
    root = np.sqrt(np.maximum(discriminant, 0.0))
    return np.where(discriminant < 0.0, np.nan, -2.0 * c0 / safe / (1.0 + root))


def _solved_sides(
    z: FloatArray, value: FloatArray, sides: Sequence[BoolArray], degree: int
) -> list[tuple[FloatArray, ...]]:
    """Return :func:`solved` for the points of each side."""
    used = np.concatenate(sides)
    both = solved(np.tile(z, (len(sides), 1)) * used, np.tile(value, (len(sides), 1)) * used, used, degree)
    rows = len(z)
    return [tuple(column[k * rows : (k + 1) * rows] for column in both) for k in range(len(sides))]


def _flanks(points: WindowPoints, degree: int, sigma: float) -> Fits:
    """Fit both flanks of each row and find where they meet; u is never below what ``sigma`` makes it."""
    level = np.where(points.used, points.value, -np.inf)
    at = np.argmax(level, axis=1)[:, None]
    order = np.arange(level.shape[1])
    count = points.count
    last = np.take_along_axis(points.time_s, count[:, None] - 1, axis=1)[:, 0]
    half = 0.5 * (last - points.time_s[:, 0])
    tip_s = np.take_along_axis(points.time_s, at, axis=1)[:, 0]
    z = np.where(points.used, (points.time_s - tip_s[:, None]) / half[:, None], 0.0)
    value = np.where(points.used, points.value, 0.0)
    sides = [points.used & (order < at), points.used & (order > at)]
    left, right = _solved_sides(z, value, sides, degree)
    meet = _meeting(left[0], right[0])
    # The sample nearest to a sharp tip is at most half a step away, in time and so in height. Flanks that
    # meet further out have a short dwell between them, not a tip.
    before = np.take_along_axis(z, np.maximum(at - 1, 0), axis=1)[:, 0]
    after = np.take_along_axis(z, np.minimum(at + 1, count[:, None] - 1), axis=1)[:, 0]
    step = np.maximum(-before, after)
    good = np.all([np.count_nonzero(side, axis=1) >= degree + 2 for side in sides], axis=0)
    good &= (count - 1 - 2 * (degree + 1) >= 1) & (
        np.abs(np.nan_to_num(meet, nan=np.inf)) <= (0.5 + _TIP_SLACK) * step
    )
    meet = np.where(good, meet, 0.0)
    rise, fall = value_at(derivative(left[0]), meet), -value_at(derivative(right[0]), meet)
    good &= (rise > 0.0) & (fall > 0.0)
    peak = value_at(left[0], meet)
    noise = sigma / np.sqrt(points.group)
    overshoot = peak - np.take_along_axis(value, at, axis=1)[:, 0]
    good &= overshoot <= (0.5 + _TIP_SLACK) * step * np.maximum(rise, fall) + 3.0 * noise
    residual = np.sqrt((left[3] + right[3]) / np.maximum(count - 1 - 2 * (degree + 1), 1))
    row = powers(meet, degree)
    gain = 0.5 * np.hypot(_gain(row, left[1]), _gain(row, right[1]))
    scatter = np.maximum(residual, noise)
    bend = np.zeros(meet.size)
    if degree > 1:
        bend = np.maximum(np.abs(left[0][:, 2]), np.abs(right[0][:, 2]))
    return Fits(
        time_s=tip_s + half * meet,
        value=peak,
        residual=np.where(good, residual * np.sqrt(points.group), np.inf),
        u=np.where(good, scatter * gain, np.inf),
        u_s=half * scatter * 2.0 * gain / np.where(good, rise + fall, 1.0),
        rise=rise / half,
        fall=fall / half,
        bend=bend / half**2,
    )
