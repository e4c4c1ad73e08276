"""The strokes of a static test as they happened: which are judged, how many there were, what is not known.

A stroke keeps its number whether it can be evaluated or not: the limits on the first one are never those of
the second.
"""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.facts import CycleResult, RequirementResult
from bufferstand.evaluation.requirements.conditions.spans import ValueSpan, spanned_row
from bufferstand.evaluation.requirements.rows import Case, RowLimits, condition_row, shown

ROSE = 0.05
"""A stroke has begun where it rose by this share of the last one's range: what rises less is no stroke."""


def judged_strokes(case: Case) -> tuple[CycleResult, ...]:
    """Return the strokes that are judged: the first, as many as the set asks for; all where it does not."""
    wanted = case.limits.conditions.cycles
    return case.strokes if isinstance(wanted, str) else case.strokes[:wanted]


def not_evaluated(
    case: Case, identity: str, text: str, limits: RowLimits, result: CycleResult
) -> RequirementResult:
    """Return the condition of a stroke that happened but cannot be evaluated."""
    return condition_row(
        case, identity, result.cycle.index, text, limits, None, "inconclusive", why_not(result)
    )


def why_not(result: CycleResult) -> str:
    """Return why a stroke that happened cannot be evaluated."""
    return f"stroke {result.cycle.index} happened but is not evaluated: {'; '.join(result.cycle.why)}"


def bridged_why(limits: RowLimits, value: float, bound: float) -> str:
    """Return that what is not on record may bring a value to the other side of a limit, or nothing."""
    if limits.meets(value - bound) == limits.meets(value + bound):
        return ""
    return f"what is not on record may change it by {bound:.2g} {limits.unit}"


def _is_cut(stroke: CycleResult) -> bool:
    """Say whether the record begins or ends within a stroke."""
    cycle = stroke.cycle
    ends = {cycle.start.method, cycle.end.method}
    return cycle.bounded and not cycle.complete and bool(ends & {"cut", "edge"})


def begins_another(case: Case) -> bool:
    """Say whether the record ends within a stroke that is to be judged, behind the last one that is found.

    Then the stroke found last is not the last one, and what is left of it is the next one's to answer for.
    """
    wanted = case.limits.conditions.cycles
    if not case.strokes or (not isinstance(wanted, str) and len(case.strokes) >= wanted):
        return False
    last = case.strokes[-1].cycle
    behind = case.record.stroke_mm[case.record.time_s > last.end.leave_s]
    return bool(behind.size) and float(np.max(behind)) - last.end.leave_mm > ROSE * last.range_mm


def cycle_count(case: Case) -> RequirementResult | None:
    """Return whether there were as many strokes as the set asks for; None where it asks for none.

    Strokes that happened count, evaluated or not. Neither too few nor enough are certain where a hole before
    the last stroke that is judged may hide one, or where the record begins or ends within one.
    """
    wanted, found = case.limits.conditions.cycles, len(case.strokes)
    limits = RowLimits.of(wanted, "none", "cycles")
    if limits.nothing:
        return None
    whole = found - sum(_is_cut(stroke) for stroke in case.strokes)
    least = 0 if limits.lower is None else int(limits.lower)
    why = f"{whole} complete cycles found"
    if missing := [str(s.cycle.index) for s in case.strokes if not (s.cycle.complete or _is_cut(s))]:
        why = f"{whole} cycles found, of which cannot be evaluated: {', '.join(missing)}"
    if limits.lower is not None and whole > least:
        why += f", the first {least} are judged"
    last = judged_strokes(case)[-1].cycle.index if case.strokes else 0
    most = float(found + begins_another(case))
    span = ValueSpan(float(whole), most, "the record begins or ends within a further one")
    if case.numbering.begun:
        span = ValueSpan(float(whole), np.inf, case.numbering.begun)
    if hidden := [d.why for d in case.numbering.hidden if d.first <= last or whole < least]:
        span = ValueSpan(0.0, np.inf, hidden[0])
    text = f"{shown(wanted)} complete cycles"
    return spanned_row(case, "cycle-count", None, text, limits, span, why, float(whole))
