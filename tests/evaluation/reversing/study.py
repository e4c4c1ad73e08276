"""How far the figures of a run are from the stand's truth, in per cent and as shares of U."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.facts.results import CycleResult, Measured
from tests.evaluation.reversing.runs import Motion, Run, run_of
from tests.evaluation.reversing.truths import figures
from tests.evaluation.signals import Floats

NOT_ASKED = {
    "static": (
        "secant_stiffness_kN_per_mm",  # the preload makes a jump of the force at the lower turn
        "storage_stiffness_kN_per_mm",
        "loss_stiffness_kN_per_mm",
    ),
    "harmonic": (),
}
_NO_SHARE = 0.01
"""Of a figure below this (in its unit) a share of itself says nothing."""


@dataclass(frozen=True, eq=False)
class Compared:
    """Cycles of a run against the truth, by name of the figure and cycle: error and U, of the truth [%]."""

    run: Run
    cycles: tuple[CycleResult, ...]
    error_percent: dict[str, Floats]
    expanded_percent: dict[str, Floats]
    mean_Hz: Measured | None

    def over_U(self, name: str) -> Floats:  # noqa: N802
        """Return the errors of a figure in U; infinite where it has none."""
        with np.errstate(divide="ignore"):
            return np.abs(self.error_percent[name]) / self.expanded_percent[name]


def compared(motion: Motion, reversal_s: float, seed: int = 1, **settings: object) -> Compared:
    """Return the steady cycles of a sine, or the complete ones of static strokes, against the truth."""
    run = run_of(motion, reversal_s, seed, **settings)
    found = run.evaluated()
    chosen = tuple(
        r for r in found.cycles if (r.cycle.steady if motion.kind == "harmonic" else r.cycle.complete)
    )
    errors: dict[str, list[float]] = defaultdict(list)
    expanded: dict[str, list[float]] = defaultdict(list)
    for result in chosen:
        for name, true in figures(run, result.cycle).items():
            if abs(true) < _NO_SHARE or name in NOT_ASKED[motion.kind]:
                continue
            value = getattr(result.quantities, name)
            errors[name].append(100.0 * (value / true - 1.0))
            expanded[name].append(100.0 * (result.expanded_uncertainty.get(name) or 0.0) / abs(true))
    return Compared(
        run,
        chosen,
        {name: np.array(values) for name, values in errors.items()},
        {name: np.array(values) for name, values in expanded.items()},
        found.summary.values["frequency_Hz"] if found.summary is not None else None,
    )
