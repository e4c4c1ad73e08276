"""Fits every family to the same runs with the same weights, and says which of them the runs tell apart."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bufferstand.foundation import BadInput
from bufferstand.model.families.data import FamilyData
from bufferstand.model.families.family import Family
from bufferstand.model.identification import CycleCheck, FixedParts, correlation_of, held_out_of

Floats = NDArray[np.float64]

_STEP = 1e-5
_REFUSED = 1e3
_ROUNDS = 40
_LEAST_SINGULAR = 1e-6
COVERAGE = 1.959963984540054
TOLD_APART = 10.0
"""Difference of BIC above which one family is told from another (Kass and Raftery 1995: very strong)."""


@dataclass(frozen=True)
class FittedParameter:
    """A parameter of a family with its 95 % interval."""

    name: str
    symbol: str
    unit: str
    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class FittedFamily:
    """A family fitted to runs.

    Attributes
    ----------
    family : Family
    vector : array
    parameters : tuple of FittedParameter
        Beside the curves.
    count : int
        Number of all that was fitted, curves included.
    square : float
        Mean of the squared weighted residuals; 1 is noise.
    samples : int
        Number of these residuals.
    correlation : float
        By how many each effective sample stands (docs/identification.md).
    held_out : tuple of CycleCheck
        Cycles against a fit that did not see them.
    held_out_square : float
        Mean of their squared weighted residuals.
    cost_us : float
        Time of one evaluation over its nodes [us], on this machine.
    """

    family: Family
    vector: Floats
    parameters: tuple[FittedParameter, ...]
    count: int
    square: float
    samples: int
    correlation: float
    held_out: tuple[CycleCheck, ...]
    held_out_square: float
    cost_us: float

    def bic(self, effective: float) -> float:
        """Return the Bayesian information criterion over so many effective samples: less is better."""
        return effective * math.log(self.square) + self.count * math.log(effective)


@dataclass(frozen=True, eq=False)
class FamilyRanking:
    """All families, the likeliest first.

    Attributes
    ----------
    fitted : tuple of FittedFamily
    effective : float
        Effective number of samples: that of the family with the least held-out residuals.
    """

    fitted: tuple[FittedFamily, ...]
    effective: float

    def over_best(self, one: FittedFamily) -> float:
        """Return by how much a family's BIC exceeds the least."""
        return one.bic(self.effective) - self.fitted[0].bic(self.effective)

    @property
    def not_told_apart(self) -> tuple[FittedFamily, ...]:
        """The families that these runs do not tell from the likeliest, itself left out."""
        return tuple(one for one in self.fitted[1:] if self.over_best(one) < TOLD_APART)


def rank_families(
    families: Sequence[Family], frame: FixedParts, spring: Floats, data: Sequence[FamilyData]
) -> FamilyRanking:
    """Fit families to the same nodes and rank them.

    Parameters
    ----------
    families : sequence of Family
    frame : FixedParts
        Knots of the curves.
    spring : array
        Vector of our own model to begin with; its curves only.
    data : sequence of FamilyData

    Raises
    ------
    BadInput
        If no family can follow the runs, or there are too few measurements.
    """
    fitted = [one for family in families if (one := _fitted(family, frame, spring, data)) is not None]
    if not fitted:
        raise BadInput("no family can follow these runs", remedy="check units and signs of the records")
    best = min(fitted, key=lambda one: one.held_out_square or one.square)
    effective = max(best.samples / best.correlation, 2.0)
    return FamilyRanking(tuple(sorted(fitted, key=lambda one: one.bic(effective))), effective)


def _fitted(
    family: Family, frame: FixedParts, spring: Floats, data: Sequence[FamilyData]
) -> FittedFamily | None:
    start = family.start(frame, spring)
    problem = _Fit(family, frame, data)
    if problem.residuals(start).size <= 2 * start.size:
        raise BadInput(
            f"{problem.residuals(start).size} usable measurements cannot determine {start.size} parameters",
            remedy="give more runs, or fewer knots",
        )
    vector, jacobian = problem.minimised(start)
    rest = list(problem.parts(vector))
    residuals = np.concatenate(rest)
    square = float(np.mean(residuals**2))
    if square >= 0.9 * _REFUSED**2:
        return None
    begun = time.perf_counter()
    problem.residuals(vector)
    cost = (time.perf_counter() - begun) / sum(one.x_mm.size for one in data)
    correlation = correlation_of(rest)
    spread = _spread(jacobian, family.scales(frame, vector)) * math.sqrt(square * correlation)
    checks, held_square = _held_out(problem, vector)
    return FittedFamily(
        family, vector, _parameters(family, frame, vector, spread), vector.size, square, residuals.size,
        correlation, checks, held_square, 1e6 * cost,
    )  # fmt: skip


class _Fit:
    """Weighted residuals of one family over experiments, and their least squares."""

    def __init__(self, family: Family, frame: FixedParts, data: Sequence[FamilyData]) -> None:
        self.family, self.frame, self.data = family, frame, tuple(data)
        self._count = sum(int(np.count_nonzero(one.experiment.used)) for one in data)

    def parts(self, vector: Floats) -> Iterator[Floats]:
        """Yield the residuals of every experiment."""
        for one in self.data:
            yield one.residuals(self.family.force_kN(self.frame, vector, one))

    def residuals(self, vector: Floats) -> Floats:
        """Return all residuals; large ones where curves cross."""
        try:
            return np.concatenate(list(self.parts(vector)))
        except BadInput:
            return np.full(self._count, _REFUSED)

    def jacobian(self, vector: Floats) -> Floats:
        """Return the derivative by every entry, by differences that stay within the bounds."""
        base = self.residuals(vector)
        steps = _STEP * self.family.scales(self.frame, vector)
        _, high = self.family.bounds(self.frame)
        columns = []
        for place, size in enumerate(steps.tolist()):
            step = -size if vector[place] + size > high[place] else size
            moved = vector.copy()
            moved[place] += step
            columns.append((self.residuals(moved) - base) / step)
        return np.stack(columns, axis=1)

    def minimised(self, start: Floats) -> tuple[Floats, Floats]:
        """Return the minimum and the Jacobian there."""
        low, high = self.family.bounds(self.frame)
        scale = self.family.scales(self.frame, start)
        inside = np.clip(start, low + 1e-9 * scale, high - 1e-9 * scale)
        found = least_squares(
            self.residuals, inside, jac=self.jacobian, bounds=(low, high), x_scale=scale,
            ftol=1e-4, xtol=1e-6, gtol=1e-10, max_nfev=_ROUNDS,
        )  # fmt: skip
        return found.x, np.asarray(found.jac, dtype=np.float64)


def _held_out(problem: _Fit, vector: Floats) -> tuple[tuple[CycleCheck, ...], float]:
    """Fit again without one cycle in five; return what the fit says of those, and their mean square."""
    held = held_out_of([one.experiment for one in problem.data])
    if not any(np.any(out) for out in held):
        return (), 0.0
    pairs = list(zip(problem.data, held, strict=True))
    seen = _Fit(
        problem.family, problem.frame, [one.with_used(one.experiment.used & ~out) for one, out in pairs]
    )
    fitted, _ = seen.minimised(vector)
    checks: list[CycleCheck] = []
    rest: list[Floats] = []
    for one, out in pairs:
        judged = one.with_used(out)
        force = problem.family.force_kN(problem.frame, fitted, judged)
        checks += judged.checked(force)
        rest.append(judged.residuals(force))
    return tuple(checks), float(np.mean(np.concatenate(rest) ** 2))


def _spread(jacobian: Floats, scale: Floats) -> Floats:
    """Return the standard deviation of every entry for unit noise; what nothing tells of stays finite."""
    _, singular, rows = np.linalg.svd(jacobian * scale, full_matrices=False)
    return np.asarray(scale * np.sqrt(np.sum((rows.T / np.maximum(singular, _LEAST_SINGULAR)) ** 2, axis=1)))


def _parameters(
    family: Family, frame: FixedParts, vector: Floats, spread: Floats
) -> tuple[FittedParameter, ...]:
    first = family.points(frame)
    found = []
    for number, law in enumerate(family.laws):
        at = first + number
        bounds = (law.to_vector(law.low), law.to_vector(law.high))
        low, value, high = (
            law.to_value(float(np.clip(vector[at] + side * COVERAGE * spread[at], *bounds)))
            for side in (-1.0, 0.0, 1.0)
        )
        found.append(FittedParameter(law.name, law.symbol, law.unit, value, low, high))
    return tuple(found)
