"""The longest dwell at the upper turning point that the record allows.

A dwell is found by its level (:mod:`bufferstand.evaluation.cycles.dwells`). One that is shorter than noise
and speed let it be found, or that lies between rows, is not found and may be there all the same. Its bound is
the time between the last row that is surely below the top and the first one that is so again, less what the
way from and to these rows takes at the greatest speed of the branch."""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.cycles import EASED_S
from bufferstand.evaluation.facts import CycleResult
from bufferstand.evaluation.gaps import alike_within
from bufferstand.evaluation.requirements.conditions.spans import ValueSpan, rows_read, unsure_s
from bufferstand.evaluation.requirements.conditions.speed import branch_speed
from bufferstand.evaluation.requirements.rows import Case

_NOISE = 3.0
"""The row itself may lie so many standard deviations of its noise nearer to the top."""


def dwell_span(case: Case, result: CycleResult) -> ValueSpan:
    """Return how long a complete cycle may have dwelt at its upper turning point [s]."""
    top = result.cycle.top
    hidden_s = _hidden_s(case, result)
    why = "how long it dwelt is known no better by the noise and the distance of the rows about the top"
    if top.dwell_s == 0.0:
        # A stand eases into its turn: what it takes for that is no dwell.
        return ValueSpan(0.0, hidden_s if hidden_s > EASED_S else 0.0, why)
    by_rows_s = unsure_s(case, top.time_s) + unsure_s(case, top.leave_s)
    return ValueSpan(max(0.0, top.dwell_s - by_rows_s), max(top.dwell_s + by_rows_s, hidden_s), why)


def _hidden_s(case: Case, result: CycleResult) -> float:
    """Return the longest time that the stroke can have spent at the top [s]."""
    cycle = result.cycle
    time_s, stroke_mm = rows_read(case, cycle.start_s, cycle.end_s)
    if time_s.size == 0:
        return cycle.duration_s
    sampling = case.record.stroke_sampling
    peak = int(np.argmax(stroke_mm))
    # Of a fitted top beyond all rows nothing is known; of a row beyond the top its noise is.
    top_mm = min(cycle.stroke_max_mm, float(stroke_mm[peak]))
    below = np.flatnonzero(stroke_mm < top_mm - alike_within(case.record.stroke_mm, sampling))
    before, behind = below[below < peak], below[below > peak]
    since_s, until_s, way_s = cycle.start_s, cycle.end_s, 0.0
    if before.size:
        since_s, from_mm = float(time_s[before[-1]]), float(stroke_mm[before[-1]])
        way_s += _way_s(case, top_mm - from_mm, cycle.start_s, cycle.top.time_s, sampling.sigma)
    if behind.size:
        until_s, to_mm = float(time_s[behind[0]]), float(stroke_mm[behind[0]])
        way_s += _way_s(case, top_mm - to_mm, cycle.top.leave_s, cycle.end_s, sampling.sigma)
    return max(0.0, until_s - since_s - way_s) + 2.0 * case.record.moment_error_s


def _way_s(case: Case, way_mm: float, start_s: float, end_s: float, sigma_mm: float) -> float:
    """Return the least time that a way beside the top took [s]: at the greatest speed of its branch."""
    speed = branch_speed(case.record, start_s, end_s, sigma_mm)
    if speed is None or speed.measured <= 0.0:
        return 0.0
    return max(0.0, way_mm - _NOISE * sigma_mm) / speed.measured
