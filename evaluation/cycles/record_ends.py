"""Turning points at an end of the record, fitted from the one side that is on record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from bufferstand.evaluation.cycles.turn_neighbourhood import TurnNeighbourhood
from bufferstand.evaluation.numerics import (
    LEAST_POINTS,
    MOST_POINTS,
    FloatArray,
    derivative,
    maxima,
    solved,
    value_at,
)

_EDGE_SHARES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5)
_WIDE, _ENOUGH = 0.2, 30
"""No wider window than 0.2 where that has so many samples: over more, a sine is no quartic."""
_STRAIGHT = 1e-3
_EDGE_MISSING = 0.003
"""A turn belongs to the record when no more than this share of the stroke is missing at its end."""
_MOST_DOUBT = 0.003
"""… and what the fit does not know for sure, but no more than this share: a poor fit is no turning point."""
_CONTRADICTS = 3.0
"""So many standard deviations apart are no noise."""
CONSISTENT = 1.3
"""A fit is consistent when its residual is within this factor of the noise."""


@dataclass(frozen=True)
class EdgeFit:
    """A turn seen from one side: ``edge`` where it belongs to the record, ``cut`` where it does not.

    ``at_end``: value at the record's end, where the fit has no maximum on record.
    """

    method: Literal["edge", "cut"]
    time_s: float
    value: float
    residual: float
    u: float
    u_s: float = 0.0
    at_end: float | None = None


def _grouped(time_s: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray, int]:
    """Return means over groups of neighbours, and the size of a group."""
    group = max(1, -(-time_s.size // MOST_POINTS))
    whole = (time_s.size // group) * group
    shape = (-1, group)
    return time_s[:whole].reshape(shape).mean(axis=1), value[:whole].reshape(shape).mean(axis=1), group


def edge_fits(sides: Sequence[TurnNeighbourhood]) -> list[EdgeFit]:
    """Return the turning points at ends of the record, each from the one side that is there.

    Where a polynomial over the last part of the stroke has its maximum on record, or so little beyond that
    no more than 0.3 % of the stroke is missing, the maximum is the turning point. Further beyond, the turn
    is cut off. Without any maximum (triangle), the end itself is the turning point.
    """
    windows = [window for row, side in enumerate(sides) for window in _windows(row, side)]
    found: list[list[EdgeFit]] = [[] for _ in sides]
    for degree, few in ((2, True), (4, False)):
        own = [window for window in windows if (window.time_s.size == LEAST_POINTS) == few]
        for window, fit in zip(own, _one_sided(sides, own, degree), strict=True):
            found[window.row].append(fit)
    return [_surest(side, fits) for side, fits in zip(sides, found, strict=True)]


def _surest(side: TurnNeighbourhood, fits: Sequence[EdgeFit]) -> EdgeFit:
    if not fits:
        return _last_sample(side, side.sigma)
    noise = max(side.sigma, min(fit.residual for fit in fits), 1e-6 * side.height)
    known = [fit for fit in fits if fit.residual <= CONSISTENT * noise]
    surest = min(known, key=lambda fit: fit.u)
    if surest.method == "cut" or surest.at_end is None:
        return surest
    ends = [fit for fit in known if fit.method == "edge" and fit.at_end is not None]
    surest = _not_contradicted([_last_sample(side, noise), *ends])
    # The turn may lie anywhere from the record's end to the fit's maximum beyond it.
    beyond = surest.value - (surest.at_end or surest.value)
    return replace(surest, u=float(np.hypot(surest.u, beyond / np.sqrt(3.0))))


def _last_sample(side: TurnNeighbourhood, noise: float) -> EdgeFit:
    end_s, end = float(side.time_s[side.peak]), float(side.value[side.peak])
    return EdgeFit("edge", end_s, end, noise, noise, at_end=end)


def _not_contradicted(fits: Sequence[EdgeFit]) -> EdgeFit:
    """Return the surest of some turns without a maximum on record that no narrower window contradicts.

    A stand eases out of its rest within a few samples, which hides in the residual of a wide window. A less
    sure fit, or the last sample itself, has other noise, too: beyond three times that it contradicts. How far
    it lies away beyond that noise is a standard uncertainty of the turn, in any case.
    """
    value, u = (np.array([getattr(fit, name) for fit in fits], dtype=np.float64) for name in ("at_end", "u"))
    less_sure = u > u[:, None]
    apart, noise = (value - value[:, None]) ** 2, np.where(less_sure, u**2 - u[:, None] ** 2, np.inf)
    contradicted = np.any(apart > _CONTRADICTS**2 * noise, axis=1)
    surest = int(np.argmin(np.where(contradicted, np.inf, u)))
    doubt = max(0.0, float(np.max(apart[surest] - noise[surest])))
    return replace(fits[surest], u=float(np.hypot(u[surest], np.sqrt(doubt))))


class _Window(NamedTuple):
    """Points beside the end of one side (``row``), each the mean of ``group`` samples."""

    row: int
    time_s: FloatArray
    value: FloatArray
    group: int


def _windows(row: int, side: TurnNeighbourhood) -> list[_Window]:
    windows = []
    for share in _EDGE_SHARES:
        window = side.above(side.value[side.peak] - share * side.height - 2.0 * side.sigma)
        points = _Window(row, *_grouped(side.time_s[window], side.value[window]))
        if points.time_s.size < LEAST_POINTS:
            continue
        windows.append(points)
        if share >= _WIDE and points.time_s.size >= _ENOUGH:
            break
    return windows


def _one_sided(sides: Sequence[TurnNeighbourhood], windows: Sequence[_Window], degree: int) -> list[EdgeFit]:
    """Return the turn by a polynomial over each of some windows."""
    if not windows:
        return []
    count = np.array([window.time_s.size for window in windows])
    used = np.arange(int(np.max(count))) < count[:, None]
    span = np.array([float(window.time_s[-1] - window.time_s[0]) for window in windows])
    ends_s = [float(side.time_s[side.peak]) for side in sides]
    z, value = np.zeros(used.shape), np.zeros(used.shape)
    z[used] = np.concatenate([own.time_s - ends_s[own.row] for own in windows]) / np.repeat(span, count)
    value[used] = np.concatenate([window.value for window in windows])
    coefficients, inverse, _, errors = solved(z, value, used, degree)
    vertex = maxima(coefficients, np.zeros(count.size))
    some = np.nan_to_num(vertex)
    top = value_at(coefficients, some)
    bend = -value_at(derivative(derivative(coefficients)), some)
    residual = np.sqrt(errors / (count - degree - 1))
    return [
        _Polynomial(
            group=window.group,
            span_s=float(span[row]),
            ends=(float(z[row, 0]), float(z[row, count[row] - 1])),
            coefficients=coefficients[row],
            inverse=inverse[row],
            residual=float(residual[row]),
            vertex=float(vertex[row]),
            top=float(top[row]),
            bend=float(bend[row]),
        ).turn(sides[window.row])
        for row, window in enumerate(windows)
    ]


@dataclass(frozen=True, eq=False)
class _Polynomial:
    """A polynomial over a window: time since the end in its length ``span_s``, points of ``group`` samples.

    ``ends`` are those of the window, ``vertex`` is its maximum (NaN: there is none), ``top`` and ``bend`` its
    value and curvature there.
    """

    group: int
    span_s: float
    ends: tuple[float, float]
    coefficients: FloatArray
    inverse: FloatArray
    residual: float
    vertex: float
    top: float
    bend: float

    def turn(self, side: TurnNeighbourhood) -> EdgeFit:
        """Return what it says of the turn."""
        end_s, root = float(side.time_s[side.peak]), float(np.sqrt(self.group))
        at_end, steep, bend = (float(c) for c in self.coefficients[:3])
        u = max(self.residual, side.sigma / root) * float(np.sqrt(self.inverse[0, 0]))
        residual = self.residual * root
        if np.isnan(self.vertex):
            u_bend = self.residual * float(np.sqrt(self.inverse[2, 2]))
            turning = bend < -max(3.0 * u_bend, _STRAIGHT * abs(steep))
            return EdgeFit("cut" if turning else "edge", end_s, at_end, residual, u, at_end=at_end)
        vertex_s = end_s + self.span_s * self.vertex
        on_record = self.ends[0] <= self.vertex <= self.ends[1]
        doubt = min(3.0 * u, _MOST_DOUBT * side.height)
        if not on_record and self.top - at_end > _EDGE_MISSING * side.height + doubt:
            return EdgeFit("cut", vertex_s, self.top, residual, u)
        degree = self.coefficients.size - 1
        row = np.arange(degree + 1.0) * self.vertex ** np.maximum(np.arange(degree + 1) - 1, 0)
        scatter = max(residual, side.sigma) / root
        u_s = self.span_s * scatter * float(np.sqrt(row @ self.inverse @ row)) / self.bend
        return EdgeFit("edge", vertex_s, self.top, residual, u, u_s, None if on_record else at_end)
