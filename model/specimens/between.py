"""One figure of several specimens, each known with an uncertainty of its own: their mean, and their spread.

The mixed model y_k = mu + b_k + e_k, with b_k of variance tau² between the specimens and e_k of the known
variance u_k² of each fit. tau² by restricted maximum likelihood (Viechtbauer, J. Educ. Behav. Stat. 30 (2005)
261), its interval by the Q-profile (Viechtbauer, Stat. Med. 26 (2007) 37), the mean's by Hartung and Knapp.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import chi2
from scipy.stats import t as student

from bufferstand.foundation import BadInput

Floats = NDArray[np.float64]

LEAST_SPECIMENS = 3
"""Of two specimens there is a difference, but hardly a spread."""
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Between:
    """Mean and spread of a figure over specimens.

    Attributes
    ----------
    specimens : int
    mean, standard_uncertainty : float
        Of the family; k - 1 degrees of freedom.
    interval : tuple of float
        95 % of the mean.
    spread : float
        tau, the standard deviation between specimens, without what the fits do not know.
    spread_interval : tuple of float
        95 % of it.
    next_interval : tuple of float
        In which the next specimen's figure lies with 95 %, known exactly.
    own_share : float
        Share of what the figures scatter by that is the specimens' own (I²).
    """

    specimens: int
    mean: float
    standard_uncertainty: float
    interval: tuple[float, float]
    spread: float
    spread_interval: tuple[float, float]
    next_interval: tuple[float, float]
    own_share: float


@dataclass(frozen=True)
class GroupDifference:
    """Difference of two groups' means: second less first, its standard uncertainty and 95 % interval."""

    value: float
    standard_uncertainty: float
    interval: tuple[float, float]

    @property
    def distinguished(self) -> bool:
        """Whether 0 lies outside the interval."""
        return not self.interval[0] <= 0.0 <= self.interval[1]


def between_specimens(values: Sequence[float], uncertainties: Sequence[float]) -> Between:
    """Return mean and spread of a figure.

    Parameters
    ----------
    values, uncertainties : sequence of float
        Of each specimen, and its standard uncertainty; three or more.

    Raises
    ------
    BadInput
        If there are fewer than three.
    """
    y, v = np.asarray(values, dtype=np.float64), np.square(np.asarray(uncertainties, dtype=np.float64))
    count = y.size
    if count < LEAST_SPECIMENS:
        raise BadInput(
            f"{count} specimens do not tell how specimens vary", remedy="give three or more, or compare two"
        )
    v = np.maximum(v, 1e-12 * max(float(np.var(y)), 1e-300))
    tau2 = _restricted(y, v)
    mean, u = _mean(y, v, tau2)
    factor = float(student.ppf(0.5 + 0.5 * _CONFIDENCE, count - 1))
    ahead = float(student.ppf(0.5 + 0.5 * _CONFIDENCE, count - 2)) * math.sqrt(tau2 + u**2)
    typical = (count - 1) * np.sum(1.0 / v) / (np.sum(1.0 / v) ** 2 - np.sum(1.0 / v**2))
    return Between(
        count,
        mean,
        u,
        (mean - factor * u, mean + factor * u),
        math.sqrt(tau2),
        _profile(y, v),
        (mean - ahead, mean + ahead),
        float(tau2 / (tau2 + typical)),
    )


def difference_of(first: Between, second: Between) -> GroupDifference:
    """Return by how much the mean of a second group differs from that of the first (Welch, Satterthwaite)."""
    parts = (first.standard_uncertainty**2, second.standard_uncertainty**2)
    u = math.sqrt(sum(parts))
    freedom = u**4 / max(
        parts[0] ** 2 / (first.specimens - 1) + parts[1] ** 2 / (second.specimens - 1), 1e-300
    )
    half = float(student.ppf(0.5 + 0.5 * _CONFIDENCE, max(freedom, 1.0))) * u
    value = second.mean - first.mean
    return GroupDifference(value, u, (value - half, value + half))


def _restricted(y: Floats, v: Floats) -> float:
    """Return the tau² of the largest restricted likelihood; 0 where the fits alone explain the scatter."""

    def cost(tau2: float) -> float:
        w = 1.0 / (v + tau2)
        mean = np.sum(w * y) / np.sum(w)
        return float(0.5 * (-np.sum(np.log(w)) + np.log(np.sum(w)) + np.sum(w * (y - mean) ** 2)))

    most = 10.0 * float(np.var(y, ddof=1)) + float(np.max(v))
    found = minimize_scalar(cost, bounds=(0.0, most), method="bounded", options={"xatol": 1e-9 * most})
    return 0.0 if cost(0.0) <= found.fun else float(found.x)


def _mean(y: Floats, v: Floats, tau2: float) -> tuple[float, float]:
    """Return mean and standard uncertainty: that of the weights, or by the scatter if that is more."""
    w = 1.0 / (v + tau2)
    mean = float(np.sum(w * y) / np.sum(w))
    scatter = float(np.sum(w * (y - mean) ** 2) / (y.size - 1))
    return mean, math.sqrt(max(scatter, 1.0) / float(np.sum(w)))


def _profile(y: Floats, v: Floats) -> tuple[float, float]:
    """Return the 95 % interval of tau: where the generalised Q passes the quantiles of chi-squared."""

    def q(tau2: float) -> float:
        w = 1.0 / (v + tau2)
        return float(np.sum(w * (y - np.sum(w * y) / np.sum(w)) ** 2))

    ends = []
    for probability in (0.5 + 0.5 * _CONFIDENCE, 0.5 - 0.5 * _CONFIDENCE):
        wanted = float(chi2.ppf(probability, y.size - 1))
        if q(0.0) <= wanted:
            ends.append(0.0)
            continue
        most = float(np.var(y, ddof=1)) + float(np.max(v))
        while q(most) > wanted:
            most *= 2.0
        ends.append(math.sqrt(float(brentq(lambda tau2, level=wanted: q(tau2) - level, 0.0, most))))
    return ends[0], ends[1]
