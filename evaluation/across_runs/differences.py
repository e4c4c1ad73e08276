"""Differences of uncertain values, and whether they exceed their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bufferstand.evaluation.across_runs.combine import Figures, RunFigure
from bufferstand.evaluation.facts import SharedContributions

_COVERAGE = 2.0


@dataclass(frozen=True)
class UncertainValue:
    """A value with its expanded uncertainty U (k = 2), where one is known.

    ``shared``: what of its standard uncertainty other values have, too
    (:mod:`bufferstand.evaluation.across_runs`).
    """

    value: float
    expanded_uncertainty: float | None = None
    shared: SharedContributions = field(default_factory=SharedContributions)


@dataclass(frozen=True)
class Difference:
    """A value less its reference.

    Attributes
    ----------
    value : float
        The difference, in the unit of both.
    relative : float or None
        As a share of the reference's amount; None where that is 0.
    expanded_uncertainty : float or None
        U of the difference (k = 2); None where U of either is not known.
    normalised : float or None
        E_n = difference / U (ISO 13528, 9.7); None without U.
    half_width_95 : float or None
        Half-width that holds 95 %: less than U where one rectangular error rules.
    """

    value: float
    relative: float | None
    expanded_uncertainty: float | None
    normalised: float | None
    half_width_95: float | None = None

    @property
    def beyond(self) -> bool | None:
        """Whether the difference is greater than its expanded uncertainty; None where U is not known."""
        return None if self.normalised is None else abs(self.normalised) > 1.0


@dataclass(frozen=True)
class Equivalence:
    """How far one of several values is from their mean, and what the uncertainties permit."""

    deviation: float
    expanded_uncertainty: float | None


def difference(value: UncertainValue, reference: UncertainValue) -> Difference:
    """Return a value less its reference. Errors that both name cancel as far as they act alike on both."""
    apart = value.value - reference.value
    relative = apart / abs(reference.value) if reference.value else None
    joint = _joint((reference, value))
    if joint is None:
        return Difference(apart, relative, None, None)
    spread = joint.weighted(np.array([-1.0, 1.0]))
    expanded = _COVERAGE * spread.u
    return Difference(apart, relative, expanded, apart / expanded if expanded else None, spread.half_width_95)


def equivalences(values: Sequence[UncertainValue]) -> tuple[float, tuple[Equivalence, ...]]:
    """Return the mean of several values, and each one's degree of equivalence with it (d_i, U(d_i)).

    The mean of n values holds each of them, and errors that all have leave the deviation from it: d_i is the
    weighted sum of the values with the weights δ_ij − 1/n.

    Raises
    ------
    ValueError
        If there are fewer than two values.
    """
    n = len(values)
    if n < 2:
        raise ValueError("a degree of equivalence needs two values or more")
    mean = sum(v.value for v in values) / n
    joint = _joint(values)
    weights = np.eye(n) - 1.0 / n
    return mean, tuple(
        Equivalence(one.value - mean, None if joint is None else _COVERAGE * joint.weighted(own).u)
        for one, own in zip(values, weights, strict=True)
    )


def _joint(values: Sequence[UncertainValue]) -> Figures | None:
    """Return the values with what they share; None where one of them has no uncertainty."""
    known = [
        RunFigure(v.value, v.expanded_uncertainty / _COVERAGE, v.shared)
        for v in values
        if v.expanded_uncertainty is not None
    ]
    return Figures.of(known) if len(known) == len(values) else None
