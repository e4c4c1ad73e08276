"""Shapes that are fitted to a reversal: a polynomial for a smooth turn, two flanks for a sharp one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from evaluation.motion import TurnMethod
from evaluation.record import FloatArray

_TIP_SLACK = 0.25
"""Flanks may meet so much further out than half a step of the samples."""


@dataclass(frozen=True)
class Fit:
    """A fitted reversal: moment, height, the residual (one sample's), and the u of height and moment."""

    method: TurnMethod
    time_s: float
    value: float
    residual: float
    u: float
    u_s: float = 0.0


def grouped(time_s: FloatArray, value: FloatArray, most: int) -> tuple[FloatArray, FloatArray, int]:
    """Return means over groups of neighbours, at most ``most`` points, and the size of a group."""
    group = max(1, -(-time_s.size // most))
    if group == 1:
        return time_s, value, 1
    whole = (time_s.size // group) * group
    shape = (-1, group)
    return time_s[:whole].reshape(shape).mean(axis=1), value[:whole].reshape(shape).mean(axis=1), group


def value_at(coefficients: list[float], z: float) -> float:
    """Return a polynomial's value, coefficients from the lowest power (Horner's scheme on plain floats)."""
    total = 0.0
    for coefficient in reversed(coefficients):
        total = total * z + coefficient
    return total


def slope_of(coefficients: list[float]) -> list[float]:
    """Return the coefficients of the derivative."""
    return [k * c for k, c in enumerate(coefficients)][1:]


def powers(z: FloatArray, degree: int) -> FloatArray:
    """Return the matrix of powers 0 … ``degree`` of ``z``, shape (N, degree + 1)."""
    matrix = np.empty((z.size, degree + 1))
    matrix[:, 0] = 1.0
    for k in range(degree):
        matrix[:, k + 1] = matrix[:, k] * z
    return matrix


def maximum(coefficients: list[float], guess: float) -> float | None:
    """Return where a polynomial has its maximum near ``guess`` inside ±0.9, by Newton's method."""
    slope = slope_of(coefficients)
    bend = slope_of(slope)
    z = guess
    for _ in range(12):
        curvature = value_at(bend, z)
        if curvature >= 0.0:
            return None
        step = value_at(slope, z) / curvature
        z -= step
        if abs(z) > 0.9:
            return None
        if abs(step) < 1e-12:
            break
    return z


def smooth_fit(time_s: FloatArray, value: FloatArray, degree: int, noise: float) -> Fit | None:
    """Fit a polynomial and return its maximum inside the window; u is never below what ``noise`` makes it."""
    spare = time_s.size - degree - 1
    if spare < 1:
        return None
    middle, half = 0.5 * float(time_s[0] + time_s[-1]), 0.5 * float(time_s[-1] - time_s[0])
    matrix = powers((time_s - middle) / half, degree)
    normal = matrix.T @ matrix
    inverse = np.linalg.inv(normal)
    coefficients = inverse @ (matrix.T @ value)
    fitted = matrix @ coefficients
    error = value - fitted
    residual = float(np.sqrt(error @ error / spare))
    top = maximum(coefficients.tolist(), float(matrix[np.argmax(fitted), 1]))
    if top is None:
        return None
    row = top ** np.arange(degree + 1)
    gain = float(np.sqrt(row @ inverse @ row))
    height = value_at(coefficients.tolist(), top)
    scatter = max(residual, noise)
    # The maximum lies where the slope is 0: an error of the slope moves it by that over the curvature.
    slope_row = np.concatenate(([0.0], np.arange(1.0, degree + 1) * row[:-1]))
    curvature = value_at(slope_of(slope_of(coefficients.tolist())), top)
    u_s = half * scatter * float(np.sqrt(slope_row @ inverse @ slope_row)) / -curvature
    return Fit("polynomial", middle + half * top, height, residual, scatter * gain, u_s)


def _flank(z: FloatArray, value: FloatArray, degree: int) -> tuple[list[float], float, FloatArray] | None:
    if z.size < degree + 2:
        return None
    scale = float(np.max(np.abs(z)))
    stretch = scale ** -np.arange(degree + 1.0)
    matrix = powers(z / scale, degree)
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


def flank_fit(time_s: FloatArray, value: FloatArray, degree: int, noise: float) -> Fit | None:
    """Fit both flanks and return where they meet; u is never below what ``noise`` makes it."""
    spare = time_s.size - 1 - 2 * (degree + 1)
    at = int(np.argmax(value))
    half = 0.5 * float(time_s[-1] - time_s[0])
    z = (time_s - time_s[at]) / half
    left, right = _flank(z[:at], value[:at], degree), _flank(z[at + 1 :], value[at + 1 :], degree)
    if left is None or right is None or spare < 1:
        return None
    meet = _meeting(left[0], right[0])
    # The sample nearest to a sharp tip is at most half a step away, in time and so in height. Flanks that
    # meet further out have a short dwell between them, not a tip.
    step = float(np.max(np.diff(z[max(0, at - 1) : at + 2])))
    if meet is None or abs(meet) > 0.5 * step + _TIP_SLACK * step:
        return None
    rise, fall = value_at(slope_of(left[0]), meet), -value_at(slope_of(right[0]), meet)
    if rise <= 0.0 or fall <= 0.0:
        return None
    if value_at(left[0], meet) - value[at] > (0.5 + _TIP_SLACK) * step * max(rise, fall) + 3.0 * noise:
        return None
    residual = float(np.sqrt((left[1] + right[1]) / spare))
    row = meet ** np.arange(degree + 1)
    gain = 0.5 * float(np.sqrt(row @ left[2] @ row + row @ right[2] @ row))
    peak = value_at(left[0], meet)
    scatter = max(residual, noise)
    u_s = half * scatter * 2.0 * gain / (rise + fall)
    return Fit("lines", float(time_s[at]) + half * meet, peak, residual, scatter * gain, u_s)
