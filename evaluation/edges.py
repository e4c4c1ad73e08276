"""Turning points at an end of the record, from the one side that is there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from evaluation.record import FloatArray
from evaluation.turn_fits import LEAST_POINTS, MOST_POINTS, maxima, powers
from evaluation.turn_sides import Side

_EDGE_SHARES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5)
_WIDE, _ENOUGH = 0.2, 30
"""No wider window than 0.2 where that has so many samples: over more, a sine is no quartic."""
_STRAIGHT = 1e-3
_EDGE_MISSING = 0.003
"""A turn belongs to the record when no more than this share of the stroke is missing at its end."""
CONSISTENT = 1.3
"""A fit is consistent when its residual is within this factor of the noise."""


@dataclass(frozen=True)
class EdgeFit:
    """A turn seen from one side: ``edge`` where it belongs to the record, ``cut`` where it does not."""

    method: Literal["edge", "cut"]
    time_s: float
    value: float
    residual: float
    u: float
    u_s: float = 0.0


def _grouped(time_s: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray, int]:
    """Return means over groups of neighbours, and the size of a group."""
    group = max(1, -(-time_s.size // MOST_POINTS))
    whole = (time_s.size // group) * group
    shape = (-1, group)
    return time_s[:whole].reshape(shape).mean(axis=1), value[:whole].reshape(shape).mean(axis=1), group


def edge_fit(side: Side) -> EdgeFit:
    """Return the turning point at an end of the record, from the one side that is there.

    Where a polynomial over the last part of the stroke has its maximum on record, or so little beyond that
    no more than 0.3 % of the stroke is missing, the maximum is the turning point. Further beyond, the turn
    is cut off. Without any maximum (triangle), the end itself is the turning point.
    """
    fits = []
    for share in _EDGE_SHARES:
        window = side.above(side.value[side.peak] - share * side.height - 2.0 * side.sigma)
        time_s, value, group = _grouped(side.time_s[window], side.value[window])
        if time_s.size < LEAST_POINTS:
            continue
        fits.append(_one_sided(side, time_s, value, 4 if time_s.size > LEAST_POINTS else 2, group))
        if share >= _WIDE and time_s.size >= _ENOUGH:
            break
    if not fits:
        end_s, end = float(side.time_s[side.peak]), float(side.value[side.peak])
        return EdgeFit("edge", end_s, end, side.sigma, side.sigma)
    noise = max(side.sigma, min(fit.residual for fit in fits), 1e-6 * side.height)
    return min((fit for fit in fits if fit.residual <= CONSISTENT * noise), key=lambda fit: fit.u)


def _one_sided(side: Side, time_s: FloatArray, value: FloatArray, degree: int, group: int) -> EdgeFit:
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
    vertex = float(maxima(coefficients[None], np.zeros(1))[0])
    if np.isnan(vertex):
        bend, steep = float(coefficients[2]), abs(float(coefficients[1]))
        u_bend = residual / float(np.sqrt(group)) * float(np.sqrt(inverse[2, 2]))
        turning = bend < -max(3.0 * u_bend, _STRAIGHT * steep)
        return EdgeFit("cut" if turning else "edge", end_s, float(coefficients[0]), residual, u)
    top = float(np.polynomial.polynomial.polyval(vertex, coefficients))
    on_record = float(z[0]) <= vertex <= float(z[-1])
    reached = on_record or top - float(coefficients[0]) <= _EDGE_MISSING * side.height + 3.0 * u
    if not reached:
        return EdgeFit("cut", end_s + span * vertex, top, residual, u)
    bend = -float(np.polynomial.polynomial.polyval(vertex, np.polynomial.polynomial.polyder(coefficients, 2)))
    row = np.arange(degree + 1.0) * vertex ** np.maximum(np.arange(degree + 1) - 1, 0)
    scatter = max(residual, side.sigma) / float(np.sqrt(group))
    u_s = span * scatter * float(np.sqrt(row @ inverse @ row)) / bend
    return EdgeFit("edge", end_s + span * vertex, top, residual, u, u_s)
