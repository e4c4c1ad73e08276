"""Conditions of the static test: was it carried out as the standard says?

A condition is met (``pass``), broken (``fail``), or cannot be told from the record (``inconclusive``). The
record gives each value as a span (:mod:`bufferstand.evaluation.requirements.conditions.spans`): what may lie
between its rows and in its holes is in it."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from bufferstand.evaluation.facts import CycleResult, RequirementResult, TurningPoint, Verdict
from bufferstand.evaluation.requirements.conditions.block_detection import block_contact
from bufferstand.evaluation.requirements.conditions.contact_bound import highest_contact
from bufferstand.evaluation.requirements.conditions.dwell import dwell_span
from bufferstand.evaluation.requirements.conditions.spans import ValueSpan, rows_read, spanned_row, unsure_s
from bufferstand.evaluation.requirements.conditions.speed import between_rows, branch_speed
from bufferstand.evaluation.requirements.conditions.strokes import (
    begins_another,
    bridged_why,
    cycle_count,
    judged_strokes,
    not_evaluated,
)
from bufferstand.evaluation.requirements.conditions.temperature import temperature_range
from bufferstand.evaluation.requirements.limit_set import known
from bufferstand.evaluation.requirements.rows import Case, RowLimits, condition_row, shown

_SPEEDS = ("speed_loading_max_mm_per_s", "speed_unloading_max_mm_per_s")
_ARRIVING = 0.02
"""A hole that begins in this last (first) share of a stroke is one of the pause behind (before) it."""
_SMALL_NOISE = 0.01
"""Noise that adds no more than this share of the limit to a speed is that of a test run right at it."""
_DAY_H = 24.0
_RUN_WIDE = ("cycle-count", "rest-after-assembly")
_BEFORE_CYCLE = ("temperature-range", "speed-limit", "pause-limit", "immediate-unloading", "full-release")


def governing(conditions: list[RequirementResult], cycle: int) -> list[RequirementResult]:
    """Return the conditions that govern the results of a cycle: those of the run and those of that cycle.

    ``full-stroke`` is not among them: it governs only what depends on the end of the stroke.
    """
    return [
        c for c in conditions if c.id in _RUN_WIDE or (c.id in _BEFORE_CYCLE and c.cycle in (None, cycle))
    ]


def static_conditions(case: Case) -> list[RequirementResult]:
    """Return every condition of the static test, judged cycle by cycle where it concerns cycles.

    Those that the limit set says there are none of are left out. A stroke that happened and cannot be
    evaluated has its conditions all the same: those that need it are inconclusive.
    """
    judged = [cycle_count(case), _rest_after_assembly(case)]
    needed = judged_strokes(case)
    for position, result in enumerate(needed):
        judged += [temperature_range(case, result), _speed(case, result)]
        if position > 0:
            judged.append(_pause(case, needed[position - 1], result))
        judged.append(_immediate_unloading(case, result))
        last = position == len(needed) - 1 and not begins_another(case)
        judged.append(_full_release(case, result, last=last))
        judged.append(full_stroke(case, result))
    return [_of_a_stroke(case, condition) for condition in judged if condition is not None]


def _of_a_stroke(case: Case, condition: RequirementResult) -> RequirementResult:
    """Return a condition, not decided where what it is read from may be several strokes."""
    if condition.cycle is None or condition.verdict == "inconclusive" or not case.numbering.hidden:
        return condition
    own = next(stroke.cycle for stroke in case.strokes if stroke.cycle.index == condition.cycle)
    # Of a pause it is enough that the motion behind it begins on record.
    until_s = own.start_s + _ARRIVING * own.duration_s if condition.id == "pause-limit" else own.end_s
    doubt = case.numbering.within(own, until_s)
    if not doubt:
        return condition
    return replace(
        condition, verdict="inconclusive", why=f"{condition.why}; which stroke it was is not known: {doubt}"
    )


def _met(limits: RowLimits, value: float) -> Verdict:
    return "pass" if limits.meets(value) else "fail"


def _rest_after_assembly(case: Case) -> RequirementResult | None:
    conditions = case.limits.conditions
    least = RowLimits.of(conditions.rest_min_h, "none", "h")
    system = case.facts.specimen.get("elastic_system")
    if least.nothing or (system is not None and system not in conditions.rest_systems):
        return None
    limits, asked = least, f"at least {shown(conditions.rest_min_h)} h"
    if case.limits.readings.rest == "exactly":
        spread = known(conditions.rest_tolerance_h)
        hours = least.lower
        limits = RowLimits(None, None, "h", unfilled=True)
        if spread is not None and hours is not None:
            limits = RowLimits(hours - spread, hours + spread, "h")
        asked = f"{shown(conditions.rest_min_h)} h ± {shown(conditions.rest_tolerance_h)} h"
    systems = ", ".join(conditions.rest_systems)
    text = f"{asked} between assembly and test ({systems})"
    assembled, started = _moment(case.facts.specimen.get("assembled")), case.facts.started
    missing = [
        what
        for what, value in (
            ("elastic system", system),
            ("date of assembly", assembled),
            ("start of the test", started),
        )
        if value is None
    ]
    if assembled is None or started is None or system is None:
        why = f"not on record: {', '.join(missing)}"
        return condition_row(case, "rest-after-assembly", None, text, limits, None, "inconclusive", why)
    if started.tzinfo is None:
        started = started.replace(tzinfo=UTC)
    rest_h = (started - assembled).total_seconds() / 3600.0
    why = f"{rest_h:.1f} h after assembly"
    span = ValueSpan(rest_h, rest_h)
    if _is_day(case.facts.specimen.get("assembled")):
        span = ValueSpan(rest_h - _DAY_H, rest_h, "when on that day it was assembled is not on record")
    return spanned_row(case, "rest-after-assembly", None, text, limits, span, why, rest_h)


def _is_day(value: object) -> bool:
    """Say whether a moment is no more than a date, which stands for its first hour."""
    return isinstance(value, str) and len(value) <= len("2026-01-01")


def _moment(value: object) -> datetime | None:
    if isinstance(value, str):
        try:
            value = datetime.fromisoformat(value)
        except ValueError:
            return None
    if not isinstance(value, datetime):
        return None
    return value if value.tzinfo is not None else value.replace(tzinfo=UTC)


def _speed(case: Case, result: CycleResult) -> RequirementResult | None:
    highest = case.limits.conditions.speed_max_mm_per_s
    text = f"stroke speed at most {shown(highest)} mm/s in both directions"
    limits = RowLimits.of("none", highest, "mm/s")
    if limits.nothing:
        return None
    cycle = result.cycle
    if not cycle.complete:
        return not_evaluated(case, "speed-limit", text, limits, result)
    sigma = case.prepared[cycle.index].noise.stroke_mm
    branches = [
        branch_speed(case.record, start_s, end_s, sigma)
        for start_s, end_s in ((cycle.start_s, cycle.top.time_s), (cycle.top.leave_s, cycle.end_s))
    ]
    known_branches = [branch for branch in branches if branch is not None]
    if len(known_branches) < len(branches):
        why = "too few samples for a speed"
        return condition_row(case, "speed-limit", cycle.index, text, limits, None, "inconclusive", why)
    up, down = known_branches
    measured = max(up.measured, down.measured)
    # What noise alone adds to the largest of many slopes must not break a test run right at the limit.
    least = max(branch.measured - branch.noise for branch in known_branches)
    noise = measured - least
    small = limits.upper is None or noise <= _SMALL_NOISE * limits.upper
    gaps = max(abs(result.gap_limits.get(name, 0.0)) for name in _SPEEDS)
    unrecorded = max(0.0, gaps - noise)
    ends = ((cycle.start, cycle.top), (cycle.top, cycle.end))
    rows = max(_between_rows(case, start, end) for start, end in ends)
    most = max((least if small else measured) + unrecorded, rows)
    span = ValueSpan(max(0.0, least - unrecorded), most, "noise and what is not on record leave it open")
    why = f"loading {up.measured:.4g} mm/s, unloading {down.measured:.4g} mm/s"
    if span.verdict(limits) == "pass" and not limits.meets(measured):
        why += "; above the limit by no more than the noise of the stroke"
    return spanned_row(case, "speed-limit", cycle.index, text, limits, span, why, measured)


def _between_rows(case: Case, start: TurningPoint, end: TurningPoint) -> float:
    """Return the largest speed of a branch that its rows may hide [mm/s]."""
    first_s, last_s = start.leave_s, end.time_s
    time_s, stroke_mm = rows_read(case, first_s, last_s)
    time_s = np.concatenate(([first_s], time_s, [last_s]))
    stroke_mm = np.concatenate(([start.leave_mm], stroke_mm, [end.stroke_mm]))
    return between_rows(time_s, stroke_mm, last_s - first_s)


def _pause(case: Case, before: CycleResult, result: CycleResult) -> RequirementResult | None:
    longest = case.limits.conditions.pause_max_s
    limits = RowLimits.of("none", longest, "s")
    if limits.nothing:
        return None
    text = f"pause before the cycle at most {shown(longest)} s"
    if "cut" in (before.cycle.end.method, result.cycle.start.method):
        return not_evaluated(case, "pause-limit", text, limits, result)
    start_s, end_s, number = result.cycle.start_s, before.cycle.end_s, before.cycle.index
    arriving_s = end_s - _ARRIVING * before.cycle.duration_s
    wide = [h for h in case.holes if h.wide and h.end_s > arriving_s and h.start_s <= start_s]
    pause: float | None = max(0.0, start_s - end_s)
    why = f"{pause:.1f} s after cycle {number}"
    by_s = unsure_s(case, end_s) + unsure_s(case, start_s)
    span = ValueSpan(
        max(0.0, start_s - end_s - by_s), max(0.0, start_s - end_s) + by_s, "rows are so far apart"
    )
    if wide and not any(hole.unknown for hole in wide):
        # The strokes beside it may have ended and begun anywhere in it.
        longest_s = max(start_s, wide[-1].end_s) - min(arriving_s, wide[0].start_s)
        pause, why = None, f"no more than {longest_s:.1f} s after cycle {number}: {wide[0].text}"
        span = ValueSpan(0.0, longest_s, "when the strokes beside it ended and began is not on record")
    elif hidden := [d for d in case.numbering.hidden if arriving_s <= d.start_s <= start_s]:
        unknown = any(doubt.unknown for doubt in hidden)
        why = f"{why} by the time stamps"
        span = ValueSpan(0.0, np.inf if unknown else span.most, hidden[0].why)
    return spanned_row(case, "pause-limit", result.cycle.index, text, limits, span, why, pause)


def _immediate_unloading(case: Case, result: CycleResult) -> RequirementResult | None:
    longest = case.limits.conditions.dwell_max_s
    limits = RowLimits.of("none", longest, "s")
    if limits.nothing:
        return None
    text = f"unloading follows at once (dwell at most {shown(longest)} s)"
    if not result.cycle.complete:
        return not_evaluated(case, "immediate-unloading", text, limits, result)
    dwell, index = result.cycle.top.dwell_s, result.cycle.index
    why = f"{dwell:.2f} s at the upper turning point"
    return spanned_row(case, "immediate-unloading", index, text, limits, dwell_span(case, result), why, dwell)


def _full_release(case: Case, result: CycleResult, *, last: bool) -> RequirementResult | None:
    largest, cycle = case.limits.conditions.residual_stroke_max_mm, result.cycle
    limits = RowLimits.of("none", largest, "mm")
    if limits.nothing:
        return None
    text = (
        f"fully released before the cycle, and after the last (residual stroke at most {shown(largest)} mm)"
    )
    if not cycle.complete:
        return not_evaluated(case, "full-release", text, limits, result)
    stroke = cycle.stroke_min_mm
    force = float(case.prepared[cycle.index].loop.force_kN[0])
    when = "before the cycle"
    if last and cycle.stroke_end_mm > stroke:
        stroke, force = cycle.stroke_end_mm, float(case.prepared[cycle.index].loop.force_kN[-1])
        when = "after the cycle"
    recorded_mm = stroke
    stroke -= case.zero_mm
    # Judged by the stroke alone: at first contact the force is anything up to the preload.
    verdict = _met(limits, stroke)
    why = f"{stroke:.2f} mm and {force:.1f} kN {when}"
    if verdict == "fail" and (unseen := _not_seen(case, limits, recorded_mm)):
        verdict, why = "inconclusive", f"{why}; {unseen}"
    if verdict == "pass" and case.zero_mm and not limits.meets(stroke + _contact_u_mm(case)):
        verdict, why = "inconclusive", f"{why}; the contact is known to ± {_contact_u_mm(case):.2f} mm only"
    if unsure := bridged_why(limits, stroke, abs(result.gap_limits.get("stroke_min_mm", 0.0))):
        verdict, why = "inconclusive", f"{why}; {unsure}"
    # After a stroke that may be a later one than the last judged, nobody asks for release.
    doubt = case.numbering.uncertain(cycle.index)
    if doubt and verdict == "fail" and limits.meets(cycle.stroke_min_mm - case.zero_mm):
        verdict, why = "inconclusive", f"{why}; that it is the last one judged is not known: {doubt}"
    return condition_row(case, "full-release", cycle.index, text, limits, stroke, verdict, why)


def _contact_u_mm(case: Case) -> float:
    """Return the expanded uncertainty of first contact, where strokes are counted from it."""
    return 0.0 if case.contact is None else case.contact.expanded_uncertainty or 0.0


def _not_seen(case: Case, limits: RowLimits, recorded_mm: float) -> str:
    """Return why the record does not show that a stroke is a residual one, or nothing.

    What is left counts from first contact. A zero that is off looks the same as a stroke that is left, so it
    is left only if it is wherever the record allows the contact to be.
    """
    highest_mm, shown_by = highest_contact(case)
    if highest_mm is not None and not limits.meets(recorded_mm - highest_mm):
        return ""
    return f"that it is no zero of the stroke that is off, the record does not show: {shown_by}"


def full_stroke(case: Case, result: CycleResult) -> RequirementResult | None:
    """Return whether a cycle went to full stroke, or to the force up to which energies count.

    By the reading ``static_extent = "proof-load"`` it must have reached the proof load F1 instead. None
    where no limit of the set depends on the end of the stroke.
    """
    energy = case.limits.energy
    if {energy.stored_min_J, energy.ratio_first_min, energy.ratio_later_min} == {"none"}:
        return None
    if not result.cycle.complete:
        text = "cycle to full stroke"
        return not_evaluated(case, "full-stroke", text, RowLimits(None, None, "mm"), result)
    reached, force = result.cycle.stroke_max_mm - case.zero_mm, result.quantities.force_max_kN or 0.0
    proof = case.limits.proof_load("F1") if case.limits.readings.static_extent == "proof-load" else None
    contact = _contact_text(case, result)
    # What is not on record may have gone further; whether it went so far is not known.
    least_mm, least_kN = (
        value - abs(result.gap_limits.get(name, 0.0))
        for value, name in ((reached, "stroke_max_mm"), (force, "force_max_kN"))
    )
    if proof is not None:
        limits = RowLimits.of(proof.force_min_kN, "none", "kN")
        shows = f"{force:.0f} kN at {reached:.2f} mm{contact}"
        verdict: Verdict = "pass" if limits.meets(least_kN) else "inconclusive"
        text = f"cycle to the proof load {proof.id} (at least {shown(proof.force_min_kN)} kN)"
        return condition_row(case, "full-stroke", result.cycle.index, text, limits, force, verdict, shows)
    least = _full_stroke_mm(case)
    cap = known(energy.force_cap_kN)
    capped = cap is not None and least_kN >= cap
    full = capped or (least is not None and least_mm >= least - 3.0 * result.cycle.top.u_stroke_mm)
    limits = RowLimits(least, None, "mm", unfilled=least is None and not capped)
    why = f"{reached:.2f} mm at {force:.0f} kN{contact}"
    if least is not None and not full:
        why += ": the record stops short of full stroke"
    goal = "the full stroke is not known" if least is None else f"at least {least:g} mm"
    capped_at = "" if cap is None else f", or {cap:g} kN"
    text = f"cycle to full stroke ({goal}{capped_at})"
    drawn = case.drawn.get(result.cycle.index)
    uncertainty = None if drawn is None else 2.0 * float(np.std(drawn["stroke_max_mm"]))
    verdict = "pass" if full else "inconclusive"
    return condition_row(
        case, "full-stroke", result.cycle.index, text, limits, reached, verdict, why, uncertainty
    )


def _full_stroke_mm(case: Case) -> float | None:
    """Return from which stroke on a cycle counts as full: the specimen's own, or the set's less tolerance."""
    applies = case.limits.applies
    own, nominal = case.facts.specimen.get("max_stroke_mm"), known(applies.stroke_mm)
    if nominal is None:
        return None if own is None else float(own)
    return min(float(own or nominal), nominal - (known(applies.stroke_tolerance_mm) or 0.0))


def _contact_text(case: Case, result: CycleResult) -> str:
    loop = case.prepared[result.cycle.index].loop
    contact_mm = block_contact(loop, case.limits.conditions.block_slope_ratio)
    return "" if contact_mm is None else f", block contact from {contact_mm:.1f} mm"
