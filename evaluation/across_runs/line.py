"""A straight line through figures of several runs with correlated errors.

Each figure has the weight of what its run has of its own; the covariance of slope and intercept is that of
the shared errors, too. Weights by the whole covariance would have the least variance only if line and shared
contributions were exact: where runs have little noise, they make the most of the small amounts by which a
shared error is no straight line (a force 0.3 ms late: 4.4 of its u from the truth). Where shared errors are
straight lines, both are the same.

Runs that scatter about the line by more than they state differ by something that nobody stated: a variance
common to all is added then, as large as makes the scatter what is to be expected (Mandel and Paule,
Analytical Chemistry 42 (1970) 1194). What the runs have of their own is then what their residuals say, all of
it and not only what was added, and Student's t accounts for how little a few runs say of it. With t on the
added variance alone, intervals of 95 % held 91 % of four runs that scatter by as much again as they state.
The residuals are asked where they are larger than those of half of all runs without such a scatter would be:
at that limit the interval is right without any scatter to 2.5 %, and with any to 1 %, from four runs on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bufferstand.evaluation.across_runs.combine import COVERAGE, Figures, RunFigure
from bufferstand.evaluation.numerics import FloatArray

_HALVINGS = 60
_ROUNDING = 1e-9
_LEAST_OWN = 0.02
"""Least share of a figure's uncertainty that counts as its own in weights and scatter: what is shared is
known to a few per cent, and no line is exact."""


@dataclass(frozen=True)
class Uncertain:
    """A figure of the line with its standard uncertainty and the half-width that holds 95 %."""

    value: float
    u: float
    half_width_95: float

    @property
    def coverage_factor(self) -> float:
        """k of U = k u."""
        return coverage_factor(self.u, self.half_width_95)

    @property
    def expanded_uncertainty(self) -> float:
        """U = k u."""
        return self.coverage_factor * self.u


def coverage_factor(u: float, half_width_95: float) -> float:
    """Return k of U = k u: 2, or more where a few runs have to say how far they scatter (JCGM 100, G.3)."""
    return max(COVERAGE, half_width_95 / u) if u > 0.0 else COVERAGE


@dataclass(frozen=True)
class FittedLine:
    """value = intercept + slope · x.

    Attributes
    ----------
    slope, intercept : Uncertain
    band : tuple of float
        Half-width that holds 95 % of the line's value at each point.
    band_U : tuple of float
        Expanded uncertainty of the same.
    scatter_u : float
        Standard deviation of the runs about the line beyond their stated uncertainties; 0: they do not.
    degrees_of_freedom : int
        Those of the scatter: points less two.
    """

    slope: Uncertain
    intercept: Uncertain
    band: tuple[float, ...]
    band_U: tuple[float, ...]
    scatter_u: float
    degrees_of_freedom: int


def fit_line(x: Sequence[float], figures: Sequence[RunFigure]) -> FittedLine:
    """Fit a straight line.

    Parameters
    ----------
    x : sequence of float
        At least two different values.
    figures : sequence of Figure
        One a value of x.

    Raises
    ------
    ValueError
        If all x are the same.
    """
    at = np.asarray(x, dtype=np.float64)
    if np.ptp(at) == 0.0:
        raise ValueError("a line needs two different places")
    joint = Figures.of(figures)
    least = _LEAST_OWN * np.array([figure.u for figure in figures]) + _ROUNDING * np.abs(joint.value)
    own = joint.own_u**2 + least**2
    centre = float(np.mean(at))  # about which slope and mean are nearly independent
    columns = np.column_stack((np.ones_like(at), at - centre))
    free = at.size - 2
    covariance = joint.contribution @ joint.contribution.T + np.diag(own)
    scatter = _scatter_variance(columns, joint.value, covariance) if free else None
    added = scatter or 0.0
    weights = columns.T / (own + added)
    operator = np.linalg.solve(weights @ columns, weights)
    mean, slope = operator

    def figure(weights: FloatArray) -> Uncertain:
        value = float(weights @ joint.value)
        if scatter is None:
            stated = joint.weighted(weights)
            return Uncertain(value, stated.u, stated.half_width_95)
        # Of one or two degrees of freedom the formula of Welch and Satterthwaite promises too much: 86 %.
        shared, seen = joint.weighted(weights, own=False), math.sqrt(float(weights**2 @ (own + scatter)))
        return Uncertain(value, math.hypot(shared.u, seen), shared.half_width_95_with(seen, free))

    line = [figure(mean + (place - centre) * slope) for place in at.tolist()]
    return FittedLine(
        slope=figure(slope),
        intercept=figure(mean - centre * slope),
        band=tuple(one.half_width_95 for one in line),
        band_U=tuple(one.expanded_uncertainty for one in line),
        scatter_u=math.sqrt(added),
        degrees_of_freedom=free,
    )


def _scatter_variance(columns: FloatArray, value: FloatArray, covariance: FloatArray) -> float | None:
    """Return the variance s² with which the residuals' χ² is what is expected, n - 2; 0 where it is less, and
    None where it is less than the median of χ²: nothing speaks for a scatter beyond what is stated.

    In an orthonormal basis of what no line can explain, s² adds to each eigenvalue of the covariance.
    """
    free = columns.shape[0] - columns.shape[1]
    basis = np.linalg.qr(columns, mode="complete")[0][:, columns.shape[1] :]
    values, vectors = np.linalg.eigh(basis.T @ covariance @ basis)
    squares = (vectors.T @ basis.T @ value) ** 2

    def chi2(variance: float) -> float:
        return float(np.sum(squares / (values + variance)))

    if chi2(0.0) <= _median_chi2(free):
        return None
    if chi2(0.0) <= free:
        return 0.0
    low, high = 0.0, float(np.sum(squares))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if chi2(middle) > free else (low, middle)
    return 0.5 * (low + high)


@lru_cache(maxsize=64)
def _median_chi2(degrees_of_freedom: int) -> float:
    from scipy.special import chdtri  # noqa: PLC0415 - slow to import, and seldom needed

    return float(chdtri(degrees_of_freedom, 0.5))
