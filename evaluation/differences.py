"""Values with their uncertainties: how far apart they are, and whether that is beyond what is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Value:
    """A value with its expanded uncertainty U (k = 2), where one is known."""

    value: float
    expanded_uncertainty: float | None = None


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
    """

    value: float
    relative: float | None
    expanded_uncertainty: float | None
    normalised: float | None

    @property
    def beyond(self) -> bool | None:
        """Whether the difference is greater than its expanded uncertainty; None where U is not known."""
        return None if self.normalised is None else abs(self.normalised) > 1.0


@dataclass(frozen=True)
class Equivalence:
    """How far one of several values is from their mean, and what the uncertainties permit."""

    deviation: float
    expanded_uncertainty: float | None


def difference(value: Value, reference: Value) -> Difference:
    """Return a value less its reference, the errors of both taken as independent.

    What both share (the same transducers) cancels in a difference of values near each other, so that U is an
    upper bound then.
    """
    apart = value.value - reference.value
    known = (value.expanded_uncertainty, reference.expanded_uncertainty)
    expanded = None if None in known else math.hypot(*(u for u in known if u is not None))
    return Difference(
        apart,
        apart / abs(reference.value) if reference.value else None,
        expanded,
        apart / expanded if expanded else None,
    )


def equivalences(values: Sequence[Value]) -> tuple[float, tuple[Equivalence, ...]]:
    """Return the mean of several values, and each one's degree of equivalence with it (d_i, U(d_i)).

    The mean m of n independent values holds each of them, so that
    u²(d_i) = (1 − 2/n) u_i² + Σ u_j² / n².

    Raises
    ------
    ValueError
        If there are fewer than two values.
    """
    n = len(values)
    if n < 2:
        raise ValueError("a degree of equivalence needs two values or more")
    mean = sum(v.value for v in values) / n
    known = [v.expanded_uncertainty for v in values]
    squares = None if None in known else sum(u * u for u in known if u is not None)
    out = []
    for one in values:
        expanded = None
        if squares is not None and one.expanded_uncertainty is not None:
            expanded = math.sqrt((1.0 - 2.0 / n) * one.expanded_uncertainty**2 + squares / n**2)
        out.append(Equivalence(one.value - mean, expanded))
    return mean, tuple(out)
