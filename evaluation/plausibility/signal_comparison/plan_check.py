"""The force against what the plan expected of the specimen at the stroke that was reached.

A specimen may be 40 % softer or stiffer than its model, and a plan is no measurement: only what is off by
more than twice that is doubted. A tenth, ten times, tonnes and pounds taken for kN are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bufferstand.evaluation.facts import Finding, expected_turns
from bufferstand.evaluation.plausibility.run_view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.as_finding import SETTING, doubt
from bufferstand.evaluation.plausibility.signal_comparison.signal_fit import shown
from bufferstand.foundation.numbers import quantile

LEAST, MOST = 0.45, 2.2
"""Of a specimen that is what it is said to be the force is this many times the expected one, at least and at
most: 40 % softer or stiffer, and half of that again for a plan that knows it only so well."""
NEAR = 0.8
"""Strokes are alike that are within this ratio of each other."""
LEAST_KN = 5.0


@dataclass(frozen=True)
class PlanExpectation:
    """The run's greatest force as a multiple of the expected one, where the stroke lets them be compared.

    Attributes
    ----------
    ratio : float
    reached_mm, expected_mm : float
        Greatest stroke, and that which the plan expected.
    """

    ratio: float
    reached_mm: float
    expected_mm: float

    @property
    def as_far(self) -> bool:
        """Whether the stroke went as far as expected: a force that is less is too small then."""
        return self.reached_mm >= NEAR * self.expected_mm

    @property
    def no_farther(self) -> bool:
        """Whether it went no farther: a force that is more is too great then."""
        return self.reached_mm * NEAR <= self.expected_mm

    @property
    def known(self) -> bool:
        """Whether the ratio says something about the scale either way."""
        return self.as_far and self.no_farther


def outlook_of(look: RunView) -> PlanExpectation | None:
    """Return what the plan expected of the run's force against what came; None where it is not on record."""
    step = look.facts.step
    expected_kN, expected_mm = _number(step.get("expected_peak_force_kN")), _stroke_mm(step, look.facts.kind)
    if expected_kN is None or expected_kN < LEAST_KN or expected_mm is None or expected_mm <= 0.0:
        return None
    force, stroke = look.record.force_kN, look.record.stroke_mm
    if force.size < 2:
        return None
    low, high = quantile(force, 0.001), quantile(force, 0.999)
    peak_kN = high if high >= -low else low
    return PlanExpectation(peak_kN / expected_kN, quantile(stroke, 0.999), expected_mm)


def force_and_plan(look: RunView, outlook: PlanExpectation | None) -> list[Finding]:
    """Return whether the force is of another scale than the plan expected.

    Parameters
    ----------
    look : Look
    outlook : Outlook, optional
    """
    if outlook is None or outlook.ratio <= 0.0:
        return []  # a turned sign is found by the loops
    small = outlook.ratio < LEAST and outlook.as_far
    large = outlook.ratio > MOST and outlook.no_farther
    if not small and not large:
        return []
    text = (
        f"the greatest force is {shown(outlook.ratio)} of what the plan expected, at "
        f"{outlook.reached_mm:.3g} mm of {outlook.expected_mm:.3g} mm: another specimen than was "
        "planned for, or the force's factor is wrong; "
        f"look at the specimen and at the calibration of the channel “force” in {SETTING}"
    )
    return [doubt(look, "scale", "force", outlook.ratio, "", text)]


def _stroke_mm(step: Mapping[str, Any], kind: str) -> float | None:
    """Return the greatest stroke that the plan expected of the specimen [mm]."""
    turns = expected_turns(step, "static" if kind == "static" else "harmonic")
    if turns is not None:
        return turns.upper_mm
    mean, amplitude = _number(step.get("prestress_mm")), _number(step.get("amplitude_mm"))
    return None if mean is None or amplitude is None else mean + amplitude


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        return None
    return float(value)
