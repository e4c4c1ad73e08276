"""Warns of largest speeds that noise makes too large, in runs whose channels state no uncertainty."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.evaluation.facts import CycleResult, Loop
from bufferstand.evaluation.loops import cut_loops
from bufferstand.evaluation.numerics import noise_sigma
from bufferstand.evaluation.quantities import SPEED_WINDOW
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty.noise import Spectrum, stroke_spectrum, white
from bufferstand.evaluation.uncertainty.speed_noise import BY_NOISE_AT_ENDS, LEAST_WINDOW, speed_lean

_WORTH_A_WORD = 0.02
"""Share of a speed: so far as strokes may differ and still be called alike."""
_LOOKED_AT = 3
"""Cycles that are tried."""


def noisy_speed_warnings(record: Record, results: Sequence[CycleResult]) -> list[str]:
    """Return a warning where noise makes the largest speeds too large by more than 2 %, as found by trying.

    Parameters
    ----------
    record : Record
        As its cycles were evaluated.
    results : sequence of CycleResult
    """
    known = [r for r in results if r.cycle.complete and r.quantities.speed_loading_max_mm_per_s]
    chosen = known[:: max(1, -(-len(known) // _LOOKED_AT))]
    sigma_mm = noise_sigma(record.stroke_mm) if chosen else 0.0
    tried = [r for r in chosen if _may_be(r, record, sigma_mm)]
    if not tried:
        return []
    noise = stroke_spectrum(record, [r.cycle for r in results if r.cycle.complete])
    stacks = cut_loops(record, [r.cycle for r in tried], alone=True)
    loops = [stack.loop(row) for stack in stacks for row in range(len(stack.cycles))]
    shares = [_too_large(record, r, loop, noise) for r, loop in zip(tried, loops, strict=True)]
    share = sum(shares) / len(chosen)
    if share < _WORTH_A_WORD:
        return []
    text = f"speeds: noise of the stroke makes the largest speeds some {100.0 * share:.0f} % too large"
    why = "and no U tells it, for want of stated accuracies"
    return [f"{text}, {why}: state those of the channels, or measure the stroke with less noise"]


def _may_be(result: CycleResult, record: Record, sigma_mm: float) -> bool:
    """Say whether noise could do so at all: by the noise of a slope at the end of a branch."""
    cycle, speed = result.cycle, result.quantities.speed_loading_max_mm_per_s or 0.0
    first, last = np.searchsorted(record.time_s, (cycle.start_s, cycle.top.time_s)).tolist()
    count = max(2, last - first)
    window = max(LEAST_WINDOW, SPEED_WINDOW * count)
    step_s = (cycle.top.time_s - cycle.start_s) / count
    u = sigma_mm * float(np.sqrt(12.0 / (window * (window**2 - 1.0)))) / step_s
    return bool(BY_NOISE_AT_ENDS * u > _WORTH_A_WORD * speed)


def _too_large(record: Record, result: CycleResult, loop: Loop, noise: Spectrum | None) -> float:
    """Return by how much noise makes the largest speeds of a cycle too large, as a share: mean of both."""
    cycle, figures = result.cycle, result.quantities
    branches = (
        (loop.loading, figures.speed_loading_max_mm_per_s),
        (loop.unloading, figures.speed_unloading_max_mm_per_s),
    )
    first, last = np.searchsorted(record.time_s, (cycle.start_s, cycle.end_s)).tolist()
    own = noise or white(record.stroke_sampling.sigma, cycle.duration_s / (last - first))
    made_by = (last - first, own, cycle.index)
    leans = [speed_lean(loop, part, *made_by).mean / speed for part, speed in branches if speed]
    return sum(leans) / len(leans)
