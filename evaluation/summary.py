"""Means over the cycles of a run, with the uncertainty of the mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from evaluation.record import FloatArray
from evaluation.results import CycleResult, Measured, Quantities, Summary
from evaluation.uncertainty import COVERAGE, NORMAL_95, half_width_95
from foundation.specimen import Kind

SUMMARY_NAMES = tuple(Quantities.__dataclass_fields__)
"""Every figure of a cycle is averaged."""


def cycles_used(kind: Kind, cycles: Sequence[CycleResult]) -> tuple[int, ...]:
    """Return the numbers of the cycles that represent a run: complete ones that are steady.

    An impact or a proof load is a single event: there, complete ones.
    """
    single = kind in ("impact", "proof")
    return tuple(c.cycle.index for c in cycles if c.cycle.complete and (single or c.cycle.steady))


@dataclass
class MeanOfDraws:
    """Sum of drawn figures over cycles: errors of the channels are common to all and do not average out."""

    sums: dict[str, FloatArray] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    drawn: int = 0
    """Cycles that were drawn; the noise of those that were not is no less averaged out."""

    def add(self, drawn: Mapping[str, FloatArray]) -> None:
        """Add the drawn figures of one cycle, arrays of shape (N,) by name."""
        self.drawn += 1
        for name, values in drawn.items():
            self.sums[name] = self.sums.get(name, 0.0) + values
            self.counts[name] = self.counts.get(name, 0) + 1

    def standard_uncertainty(self, name: str) -> float | None:
        """Return u of the mean over the cycles, or None where not every one that was drawn gave draws."""
        if not self.drawn or self.counts.get(name) != self.drawn:
            return None
        return float(np.std(self.sums[name])) / self.drawn

    def half_width_95(self, name: str) -> float:
        """Return the half-width about the mean that holds 95 % of the draws of the mean over the cycles."""
        return half_width_95(self.sums[name]) / self.drawn


def summarise(cycles: Sequence[CycleResult], used: tuple[int, ...], draws: MeanOfDraws) -> Summary:
    """Return the means over the cycles used.

    The standard uncertainty joins that of the channels with the scatter between the cycles (standard
    deviation of the mean, from three cycles on). A figure that one of the cycles lacks has no mean.
    """
    numbers_used = set(used)
    chosen = [c for c in cycles if c.cycle.index in numbers_used]
    values = {}
    for name in SUMMARY_NAMES:
        numbers = [getattr(c.quantities, name) for c in chosen]
        if not numbers or any(number is None for number in numbers):
            values[name] = Measured(None)
            continue
        mean = float(np.mean(numbers))
        u = draws.standard_uncertainty(name)
        if u is None:
            values[name] = Measured(mean)
            continue
        scatter = float(np.std(numbers, ddof=1)) / float(np.sqrt(len(numbers))) if len(numbers) > 2 else 0.0
        half_width = float(np.hypot(draws.half_width_95(name), NORMAL_95 * scatter))
        values[name] = Measured(mean, COVERAGE * float(np.hypot(u, scatter)), COVERAGE, half_width)
    return Summary(used, values)
