"""Figures of several runs in one: uncertainty of a weighted sum, whose parts have errors in common.

JCGM 100, 5.2.2: u²(Σ aᵢ yᵢ) = Σ aᵢ aⱼ u(yᵢ, yⱼ). With the standard contribution c of every shared error to
every figure that is Σ_s (Σᵢ aᵢ cᵢₛ)² + Σᵢ aᵢ² oᵢ², where oᵢ is what a run has of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from evaluation.across_runs.shared import Owed
from evaluation.record import FloatArray

PROBABILITY = 0.95
"""Probability that a ``half_width_95`` covers."""
NORMAL_95 = 1.959964
_HALVINGS = 40


@dataclass(frozen=True)
class Figure:
    """A figure of a run: its value, its standard uncertainty, and what of that other runs have, too.

    Without any of that all is the run's own.
    """

    value: float
    u: float
    shared: Owed = field(default_factory=Owed)

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
    def of(cls, figures: Sequence[Figure]) -> Figures:
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

    def weighted(self, weights: FloatArray) -> Spread:
        """Return the uncertainty of a weighted sum of the values."""
        shared = (weights @ self.contribution) ** 2
        own = float(np.sum((weights * self.own_u) ** 2))
        variance = float(np.sum(shared)) + own
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

    low, high = 1.0, 3.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) < 0.5 * (1.0 + PROBABILITY) else (low, middle)
    return 0.5 * (low + high)


def _integral(z: float) -> float:
    """Return the integral of the standard normal distribution function from -∞ to z."""
    below = 0.5 * math.erfc(-z / math.sqrt(2.0))
    return z * below + math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
