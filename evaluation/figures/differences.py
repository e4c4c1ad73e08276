"""Differences of several quantities over the steps of a comparison, each with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.figures.plot import Floats, Level, Plot, Points
from bufferstand.evaluation.wording import said

STEP_LABEL = said("Step of the comparison [No.]")
CHANGE_LABEL = said("Difference to the reference [%]")
_SPREAD = 0.5
"""Share of a step's width over which its points lie side by side."""


@dataclass(frozen=True, eq=False)
class ChangeSeries:
    """One quantity: step numbers, change and expanded uncertainty (0: unknown) in % of the reference."""

    label: str
    step: Floats
    change_percent: Floats
    expanded_uncertainty_percent: Floats


def changes_plot(series: Sequence[ChangeSeries], steps: int) -> Plot:
    """Return the changes over the steps; points of one step stand side by side."""
    shifts = np.linspace(-_SPREAD / 2.0, _SPREAD / 2.0, len(series)) if len(series) > 1 else np.zeros(1)
    points = tuple(
        Points(one.label, one.step + shift, one.change_percent, one.expanded_uncertainty_percent, tone)
        for tone, (one, shift) in enumerate(zip(series, shifts, strict=True))
    )
    lows = [float(np.min(one.change_percent - one.expanded_uncertainty_percent)) for one in series]
    highs = [float(np.max(one.change_percent + one.expanded_uncertainty_percent)) for one in series]
    low, high = min([0.0, *lows]), max([0.0, *highs])
    margin = 0.1 * (high - low) or 1.0
    return Plot(
        STEP_LABEL,
        CHANGE_LABEL,
        kind="trend",
        points=points,
        levels=(Level(0.0, said("no difference")),),
        x_range=(0.5, steps + 0.5),
        y_range=(low - margin, high + margin),
        height_mm=78.0,
        whole_x=True,
    )
