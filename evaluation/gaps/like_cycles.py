"""Bounds for a hole from similar cycles: the same hole is opened where the samples are on record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.cycles import STEADY_FREQUENCY, STEADY_STROKE
from bufferstand.evaluation.facts import Cycle, CycleResult
from bufferstand.evaluation.gaps.bridging import RecordGap
from bufferstand.evaluation.record import Record

LEAST, MOST = 3, 6
"""So many like cycles show what a hole changes."""


def choose_donors(
    wanted: Sequence[CycleResult], results: Sequence[CycleResult], holed: Mapping[int, tuple[RecordGap, ...]]
) -> dict[int, list[Cycle]]:
    """Return, of each wanted cycle that has some, like cycles to open its holes in; no two beside each other.

    Parameters
    ----------
    wanted, results : sequence of CycleResult
        The wanted ones, and all of the run.
    holed : mapping of int to tuple of Hole
        Cycles with holes of their own.
    """
    free = [r.cycle for r in results if r.cycle.steady and r.cycle.index not in holed]
    taken: set[int] = set()
    chosen: dict[int, list[Cycle]] = {}
    for result in wanted:
        own: list[Cycle] = []
        order = np.argsort([abs(cycle.index - result.cycle.index) for cycle in free], kind="stable")
        for cycle in (free[at] for at in order.tolist()):
            beside = {cycle.index - 1, cycle.index, cycle.index + 1}
            if len(own) < MOST and not beside & taken and _alike(result.cycle, cycle):
                own.append(cycle)
                taken.add(cycle.index)
        if len(own) >= LEAST:
            chosen[result.cycle.index] = own
    return chosen


def _alike(one: Cycle, other: Cycle) -> bool:
    """Say whether two cycles go the same way in the same time."""
    tolerance_mm = STEADY_STROKE * one.range_mm
    return (
        abs(one.stroke_min_mm - other.stroke_min_mm) <= tolerance_mm
        and abs(one.stroke_max_mm - other.stroke_max_mm) <= tolerance_mm
        and abs(one.duration_s / other.duration_s - 1.0) <= STEADY_FREQUENCY
    )


def opened(
    record: Record, cycle: Cycle, holes: Sequence[RecordGap], donors: Sequence[Cycle]
) -> NDArray[np.intp]:
    """Return the samples that are missing when a cycle's holes are opened in others at the same place."""
    time = record.time_s
    lost = []
    for donor in donors:
        share = donor.duration_s / cycle.duration_s
        inside = np.searchsorted(time, (donor.start_s, donor.end_s))
        step_s = donor.duration_s / max(1, int(inside[1] - inside[0]))
        for hole in holes:
            start_s = donor.start_s + share * (hole.start_s - cycle.start_s)
            before = int(np.searchsorted(time, start_s - 0.5 * step_s))
            count = max(1, round(hole.length_s / step_s) - 1)
            lost.append(np.arange(before + 1, min(before + 1 + count, time.size - 1)))
    return np.concatenate(lost)
