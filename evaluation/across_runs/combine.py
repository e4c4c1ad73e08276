"""Uncertainty of a weighted sum of figures of several runs that have errors in common.

JCGM 100, 5.2.2: u²(Σ aᵢ yᵢ) = Σ aᵢ aⱼ u(yᵢ, yⱼ). With the standard contribution c of every shared error to
every figure that is Σ_s (Σᵢ aᵢ cᵢₛ)² + Σᵢ aᵢ² oᵢ², where oᵢ is what a run has of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from bufferstand.evaluation.facts import SharedContributions
from bufferstand.evaluation.numerics import FloatArray

PROBABILITY = 0.95
"""Probability that a ``half_width_95`` covers."""
COVERAGE = 2.0
"""Coverage factor of an expanded uncertainty."""
NORMAL_95 = 1.959964
_HALVINGS, _FEW_HALVINGS = 40, 14
_NODES = 400


@dataclass(frozen=True)
class RunFigure:
    """A figure of a run: its value, its standard uncertainty, and what of that other runs have, too.

    Without any of that all is the run's own.
    """

    value: float
    u: float
    shared: SharedContributions = field(default_factory=SharedContributions)

    @property
    def own_u(self) -> float:
        """Standard uncertainty by what is this run's alone: noise, turning points, scatter, bounds."""
        return math.sqrt(max(0.0, self.u**2 - self.shared.explained_u**2))


@dataclass(frozen=True, eq=False)
class Figures:
    """Several figures: shared contributions, shape (n, S), those of the runs' own, shape (n,)."""

    value: FloatArray
    contribution: FloatArray
    own_u: FloatArray
    rectangular: FloatArray
    """1 where a source is drawn from a rectangle, else 0, shape (S,)."""

    @classmethod
    def of(cls, figures: Sequence[RunFigure]) -> Figures:
        """Return the figures of several runs, in their order."""
        sources = list(dict.fromkeys(source for figure in figures for source in figure.shared.by_source))
        rows = [[figure.shared.by_source.get(source, 0.0) for source in sources] for figure in figures]
        return cls(
            np.array([figure.value for figure in figures]),
            np.array(rows, dtype=np.float64).reshape(len(figures), len(sources)),
            np.array([figure.own_u for figure in figures]),
            np.array([float(source.distribution == "rectangular") for source in sources]),
        )

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the values, shape (n, n)."""
        return np.asarray(self.contribution @ self.contribution.T + np.diag(self.own_u**2))

    def weighted(self, weights: FloatArray, *, own: bool = True) -> Spread:
        """Return the uncertainty of a weighted sum of the values; without ``own`` what is shared of it."""
        shared = (weights @ self.contribution) ** 2
        variance = float(np.sum(shared))
        if own:
            variance += float(np.sum((weights * self.own_u) ** 2))
        largest = float(np.max(shared * self.rectangular, initial=0.0))
        return Spread(math.sqrt(variance), largest / variance if variance > 0.0 else 0.0)


@dataclass(frozen=True)
class Spread:
    """Standard uncertainty, and which share of its square the largest rectangular error has."""

    u: float
    rectangle: float = 0.0

    @property
    def half_width_95(self) -> float:
        """Half-width that holds 95 %: of a normal error 1.96 u, of a rectangular one 1.65 u."""
        return coverage_factor_95(round(self.rectangle, 3)) * self.u

    def half_width_95_with(self, seen_u: float, degrees_of_freedom: int) -> float:
        """Return the half-width that holds 95 % of this error and one that few residuals were asked for.

        The latter has Student's distribution (JCGM 101, 6.4.9): a normal one whose variance is that of the
        residuals, seen_u² ν / χ². Joined in quadrature, their half-widths would hold 98 % where both are
        alike and ν is 2, and still more with one degree of freedom.

        Parameters
        ----------
        seen_u : float
            Standard uncertainty by the residuals.
        degrees_of_freedom : int
            Theirs, ν.
        """
        from scipy.special import ndtr, stdtrit  # noqa: PLC0415 - slow to import, and seldom needed

        whole = math.hypot(self.u, seen_u)
        student = float(stdtrit(degrees_of_freedom, 0.5 * (1.0 + PROBABILITY)))
        if self.u <= 1e-3 * whole:
            return student * whole
        normal = (1.0 - self.rectangle) * self.u**2 + seen_u**2 * _inverse_chi2(degrees_of_freedom)
        s = np.sqrt(normal) / whole
        a = max(math.sqrt(3.0 * self.rectangle) * self.u / whole, 1e-3)

        def integral(z: FloatArray) -> FloatArray:
            return np.asarray(z * ndtr(z) + np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi))

        def below(x: float) -> float:
            return float(np.mean(s / (2.0 * a) * (integral((x + a) / s) - integral((x - a) / s))))

        # No less than either alone, and no more than both in quadrature.
        either = self.half_width_95 / whole, student * seen_u / whole
        return whole * _quantile(below, max(either), 1.01 * math.hypot(*either), _FEW_HALVINGS)


@lru_cache(maxsize=1001)
def coverage_factor_95(rectangle: float) -> float:
    """Return k for 95 % of the sum of one rectangular error and a normal one (EA-4/02, S9 to S10).

    Parameters
    ----------
    rectangle : float
        Share of the variance that the rectangular error has, 0 … 1. What else there is counts as normal:
        right to 1.3 % of k whatever it is made of.
    """
    a, s = math.sqrt(3.0 * rectangle), math.sqrt(max(0.0, 1.0 - rectangle))
    if s < 1e-3:
        return PROBABILITY * math.sqrt(3.0)
    if a < 1e-3:
        return NORMAL_95

    def below(x: float) -> float:
        """Return the distribution function: the mean of the normal one over the rectangle."""
        return s / (2.0 * a) * (_integral((x + a) / s) - _integral((x - a) / s))

    return _quantile(below, 1.0, 3.0)


def _quantile(below: Callable[[float], float], low: float, high: float, halvings: int = _HALVINGS) -> float:
    """Return the place below which half of what is not to be covered lies above, by halving."""
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) < 0.5 * (1.0 + PROBABILITY) else (low, middle)
    return 0.5 * (low + high)


@lru_cache(maxsize=64)
def _inverse_chi2(degrees_of_freedom: int) -> FloatArray:
    """Return ν / χ² at evenly spread probabilities of χ², shape (M,)."""
    from scipy.special import gammaincinv  # noqa: PLC0415 - slow to import, and seldom needed

    shares = (np.arange(_NODES) + 0.5) / _NODES
    return np.asarray(0.5 * degrees_of_freedom / gammaincinv(0.5 * degrees_of_freedom, shares))


def _integral(z: float) -> float:
    """Return the integral of the standard normal distribution function from -∞ to z."""
    below = 0.5 * math.erfc(-z / math.sqrt(2.0))
    return z * below + math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
