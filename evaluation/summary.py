"""Means over the cycles of a run, with the uncertainty of the mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from evaluation.record import FloatArray
from evaluation.results import CycleResult, Measured, Quantities, Summary
from evaluation.uncertainty import COVERAGE
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

    def add(self, drawn: Mapping[str, FloatArray]) -> None:
        """Add the drawn figures of one cycle, arrays of shape (N,) by name."""
        for name, values in drawn.items():
            self.sums[name] = self.sums.get(name, 0.0) + values
            self.counts[name] = self.counts.get(name, 0) + 1

    def standard_uncertainty(self, name: str, cycles: int) -> float | None:
        """Return u of the mean over ``cycles`` cycles, or None where not every cycle gave draws."""
        if self.counts.get(name) != cycles:
            return None
        return float(np.std(self.sums[name])) / cycles


def summarise(cycles: Sequence[CycleResult], used: tuple[int, ...], draws: MeanOfDraws) -> Summary:
    """Return the means over the cycles used.

    The standard uncertainty joins that of the channels with the scatter between the cycles (standard
    deviation of the mean, from three cycles on). A figure that one of the cycles lacks has no mean.
    """
    chosen = [c for c in cycles if c.cycle.index in used]
    values = {}
    for name in SUMMARY_NAMES:
        numbers = [getattr(c.quantities, name) for c in chosen]
        if not numbers or any(number is None for number in numbers):
            values[name] = Measured(None)
            continue
        mean = float(np.mean(numbers))
        u = draws.standard_uncertainty(name, len(numbers))
        if u is None:
            values[name] = Measured(mean)
            continue
        scatter = float(np.std(numbers, ddof=1)) / float(np.sqrt(len(numbers))) if len(numbers) > 2 else 0.0
        values[name] = Measured(mean, COVERAGE * float(np.hypot(u, scatter)))
    return Summary(used, values)
