"""Uncertainty of single readings of force and stroke from what their channels state (JCGM 100)."""

from __future__ import annotations

from math import hypot, sqrt

from bufferstand.evaluation.facts import RunFacts
from bufferstand.evaluation.uncertainty import COVERAGE, SHAPE_SHARE, mean_of_wires

_RECTANGULAR = sqrt(3.0)


def force_expanded_kN(facts: RunFacts, force_kN: float) -> float | None:  # noqa: N802 - the unit's own letters
    """Return U of a force reading [kN]: accuracy and zero, rectangular; None where no accuracy is stated."""
    stated = facts.force_uncertainty
    if stated is None or stated.accuracy_percent is None:
        return None
    scale_kN = abs(force_kN) * stated.accuracy_percent / 100.0
    return COVERAGE * hypot(scale_kN, stated.zero or 0.0) / _RECTANGULAR


def stroke_difference_expanded_mm(facts: RunFacts, difference_mm: float) -> float | None:
    """Return U of the difference of two strokes [mm]; None where the wires do not state their accuracy.

    The zero cancels. The linearity errors at both ends are taken as independent, which is an upper bound for
    strokes that are near to each other.
    """
    wires = mean_of_wires(facts.stroke_uncertainty)
    if wires is None:
        return None
    scale_mm = abs(difference_mm) * wires.scale / _RECTANGULAR
    return COVERAGE * hypot(scale_mm, sqrt(2.0) * SHAPE_SHARE * wires.linearity_mm)
