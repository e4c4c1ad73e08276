"""The reference of a run: the motion that its step requires, or the one that the plan expected.

A step that asks for the piston's stroke (``compensate = false``) asks nothing of the specimen. The machine
gives way under the force, so the specimen makes less of that stroke. How much less, the plan has worked out,
and the run file has it in ``step.estimates`` (docs/run-file.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

MEAN, AMPLITUDE = "prestress_mm", "amplitude_mm"
"""Figures of a step that the piston may be asked for; its frequency is everybody's."""


@dataclass(frozen=True)
class PlannedValue:
    """One figure of a step.

    Parameters
    ----------
    value : float
        What the specimen was to do: asked of it, or expected of it by the plan.
    of_piston : float or None
        What was asked of the piston, where ``value`` is what the plan expected; None where it was asked.
    """

    value: float
    of_piston: float | None = None


@dataclass(frozen=True)
class PlannedTurns:
    """Lower and upper turn that the plan expected of the specimen [mm]."""

    lower_mm: float
    upper_mm: float

    @property
    def mean_mm(self) -> float:
        """Half the sum of the turns [mm]."""
        return 0.5 * (self.lower_mm + self.upper_mm)

    @property
    def amplitude_mm(self) -> float:
        """Half the distance of the turns [mm]."""
        return 0.5 * (self.upper_mm - self.lower_mm)


def held_against(step: Mapping[str, Any], name: str) -> PlannedValue | None:
    """Return what a harmonic run is compared with, None where nothing is on record.

    Parameters
    ----------
    step : mapping
        ``step`` of the run's metadata.
    name : str
        ``prestress_mm``, ``amplitude_mm`` or ``frequency_Hz``.
    """
    asked = _number(step.get(name))
    if asked is None or step.get("compensate") is not False or name not in (MEAN, AMPLITUDE):
        return None if asked is None else PlannedValue(asked)
    expected = expected_turns(step, "harmonic")
    if expected is None:
        return None
    return PlannedValue(expected.mean_mm if name == MEAN else expected.amplitude_mm, asked)


def expected_turns(step: Mapping[str, Any], motion: str) -> PlannedTurns | None:
    """Return where the plan expected the specimen to turn, None where that is not on record.

    Of a step with several motions of that kind no single pair of turns stands for all of them: None, too.

    Parameters
    ----------
    step : mapping
        ``step`` of the run's metadata.
    motion : str
        ``harmonic`` or ``static``.
    """
    motions, estimates = step.get("motions") or (), step.get("estimates") or ()
    found = [
        estimate.get("turns")
        for one, estimate in zip(motions, estimates, strict=False)
        if isinstance(one, Mapping) and isinstance(estimate, Mapping) and one.get("motion") == motion
    ]
    if len(found) != 1 or not isinstance(found[0], Mapping):
        return None
    lower_mm, upper_mm = _number(found[0].get("lower_mm")), _number(found[0].get("upper_mm"))
    return None if lower_mm is None or upper_mm is None else PlannedTurns(lower_mm, upper_mm)


def _number(value: object) -> float | None:
    """Return a value as a finite number, None where it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) else None
