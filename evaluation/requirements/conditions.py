"""Conditions of the static test: was it carried out as the standard says?

A condition is met (``pass``), broken (``fail``), or cannot be told from the record (``inconclusive``).
"""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from evaluation.quantities import SPEED_WINDOW, TEMPERATURE_STALE_S
from evaluation.record import Temperature
from evaluation.requirements.rows import Case, Limits, row
from evaluation.results import CycleResult, RequirementResult, Verdict

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
    """Return every condition of the static test, judged cycle by cycle where it concerns cycles."""
    judged = [_cycle_count(case)]
    rest = _rest_after_assembly(case)
    if rest is not None:
        judged.append(rest)
    needed = case.cycles[: case.limits.conditions.cycles]
    for position, result in enumerate(needed):
        judged.append(_temperature(case, result))
        judged.append(_speed(case, result))
        if position > 0:
            judged.append(_pause(case, needed[position - 1], result))
        judged.append(_immediate_unloading(case, result))
        judged.append(_full_release(case, result, last=position == len(needed) - 1))
        judged.append(full_stroke(case, result))
    return judged


def _condition(
    case: Case,
    identity: str,
    cycle: int | None,
    text: str,
    limits: Limits,
    measured: float | None,
    verdict: Verdict,
    why: str,
    uncertainty: float | None = None,
) -> RequirementResult:
    return row(
        case,
        identity,
        cycle,
        text,
        limits,
        verdict,
        why,
        measured=measured,
        clause=case.limits.conditions.clause,
        condition=True,
        uncertainty=uncertainty,
    )


def _cycle_count(case: Case) -> RequirementResult:
    wanted, found = case.limits.conditions.cycles, len(case.cycles)
    verdict: Verdict = "pass" if found >= wanted else "fail"
    why = f"{found} complete cycles found"
    if found > wanted:
        why += f", the first {wanted} are judged"
    limits = Limits(float(wanted), None, "cycles")
    return _condition(
        case, "cycle-count", None, f"{wanted} complete cycles", limits, float(found), verdict, why
    )


def _rest_after_assembly(case: Case) -> RequirementResult | None:
    conditions = case.limits.conditions
    system = case.facts.specimen.get("elastic_system")
    if system is not None and system not in conditions.rest_systems:
        return None
    systems = ", ".join(conditions.rest_systems)
    text = f"at least {conditions.rest_min_h:g} h between assembly and test ({systems})"
    limits = Limits(conditions.rest_min_h, None, "h")
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
        return _condition(case, "rest-after-assembly", None, text, limits, None, "inconclusive", why)
    if started.tzinfo is None:
        started = started.replace(tzinfo=UTC)
    rest_h = (started - assembled).total_seconds() / 3600.0
    met = rest_h >= conditions.rest_min_h
    why = f"{rest_h:.1f} h after assembly"
    verdict: Verdict = "pass" if met else "fail"
    return _condition(case, "rest-after-assembly", None, text, limits, rest_h, verdict, why)


def _moment(value: object) -> datetime | None:
    if isinstance(value, str):
        try:
            value = datetime.fromisoformat(value)
        except ValueError:
            return None
    if not isinstance(value, datetime):
        return None
    return value if value.tzinfo is not None else value.replace(tzinfo=UTC)


def _temperature(case: Case, result: CycleResult) -> RequirementResult:
    conditions = case.limits.conditions
    low, high = conditions.temperature_min_C, conditions.temperature_max_C
    text = f"temperature {low:g} to {high:g} °C at the start of the cycle and during it"
    limits = Limits(low, high, "°C")
    cycle = result.cycle
    specimen = [s for s in case.record.temperatures if s.role == "specimen"]
    sensors = specimen or list(case.record.temperatures)
    spans = [s for s in (_span(sensor, cycle.start_s, cycle.end_s) for sensor in sensors) if s is not None]
    if not spans:
        why = "no temperature on record within the cycle"
        return _condition(case, "temperature-range", cycle.index, text, limits, None, "inconclusive", why)
    coldest, warmest = min(s[0] for s in spans), max(s[1] for s in spans)
    worst = warmest if warmest - high > low - coldest else coldest
    met = coldest >= low and warmest <= high
    known = [s.accuracy_C for s in sensors if s.accuracy_C is not None]
    uncertainty = 2.0 * max(known) / float(np.sqrt(3.0)) if len(known) == len(sensors) else None
    what = "spring" if specimen else "ambient"
    why = f"{what} {coldest:.1f} to {warmest:.1f} °C"
    verdict: Verdict = "pass" if met else "fail"
    return _condition(case, "temperature-range", cycle.index, text, limits, worst, verdict, why, uncertainty)


def _span(sensor: Temperature, start_s: float, end_s: float) -> tuple[float, float] | None:
    """Return the lowest and highest reading of a sensor during a cycle, its ends interpolated."""
    good = np.isfinite(sensor.time_s) & np.isfinite(sensor.temperature_C)
    time, value = sensor.time_s[good], sensor.temperature_C[good]
    if time.size == 0:
        return None
    if min(np.min(np.abs(time - start_s)), np.min(np.abs(time - end_s))) > TEMPERATURE_STALE_S:
        return None
    inside = value[(time >= start_s) & (time <= end_s)]
    readings = np.concatenate((inside, np.interp([start_s, end_s], time, value)))
    return float(np.min(readings)), float(np.max(readings))


def _speed(case: Case, result: CycleResult) -> RequirementResult:
    highest = case.limits.conditions.speed_max_mm_per_s
    text = f"stroke speed at most {highest:g} mm/s in both directions"
    limits = Limits(None, highest, "mm/s")
    up = result.quantities.speed_loading_max_mm_per_s
    down = result.quantities.speed_unloading_max_mm_per_s
    index = result.cycle.index
    if up is None or down is None:
        return _condition(
            case, "speed-limit", index, text, limits, None, "inconclusive", "too few samples for a speed"
        )
    measured = max(up, down)
    # What noise alone adds to the largest of many slopes must not break a test run right at the limit.
    noise = 3.0 * _speed_noise(case, result)
    verdict: Verdict = "pass" if measured <= highest + noise else "fail"
    why = f"loading {up:.4g} mm/s, unloading {down:.4g} mm/s"
    if highest < measured <= highest + noise:
        why += "; above the limit by no more than the noise of the stroke"
    return _condition(case, "speed-limit", index, text, limits, measured, verdict, why)


def _speed_noise(case: Case, result: CycleResult) -> float:
    """Return the standard deviation that noise of the stroke gives to a smoothed speed [mm/s]."""
    cycle, time = result.cycle, case.record.time_s
    samples = np.searchsorted(time, [cycle.start_s, cycle.top.time_s, cycle.top.leave_s, cycle.end_s])
    count = max(5.0, SPEED_WINDOW * float(min(samples[1] - samples[0], samples[3] - samples[2])))
    branch_s = min(cycle.top.time_s - cycle.start_s, cycle.end_s - cycle.top.leave_s)
    sigma = case.prepared[cycle.index].noise.stroke_mm
    return sigma * float(np.sqrt(12.0 / count)) / (SPEED_WINDOW * branch_s)


def _pause(case: Case, before: CycleResult, result: CycleResult) -> RequirementResult:
    longest = case.limits.conditions.pause_max_s
    pause = max(0.0, result.cycle.start_s - before.cycle.end_s)
    met = pause <= longest
    verdict: Verdict = "pass" if met else "fail"
    return _condition(
        case,
        "pause-limit",
        result.cycle.index,
        f"pause before the cycle at most {longest:g} s",
        Limits(None, longest, "s"),
        pause,
        verdict,
        f"{pause:.1f} s after cycle {before.cycle.index}",
    )


def _immediate_unloading(case: Case, result: CycleResult) -> RequirementResult:
    longest = case.limits.conditions.dwell_max_s
    dwell = result.cycle.top.dwell_s
    verdict: Verdict = "pass" if dwell <= longest else "fail"
    why = f"{dwell:.2f} s at the upper turning point"
    return _condition(
        case,
        "immediate-unloading",
        result.cycle.index,
        f"unloading follows at once (dwell at most {longest:g} s)",
        Limits(None, longest, "s"),
        dwell,
        verdict,
        why,
    )


def _full_release(case: Case, result: CycleResult, *, last: bool) -> RequirementResult:
    conditions, cycle = case.limits.conditions, result.cycle
    stroke = cycle.stroke_min_mm
    force = float(case.prepared[cycle.index].loop.force_kN[0])
    when = "before the cycle"
    if last and cycle.stroke_end_mm > stroke:
        stroke, force = cycle.stroke_end_mm, float(case.prepared[cycle.index].loop.force_kN[-1])
        when = "after the cycle"
    # Judged by the stroke alone: at first contact the force is anything up to the preload.
    verdict: Verdict = "pass" if stroke <= conditions.residual_stroke_max_mm else "fail"
    text = (
        f"fully released before the cycle, and after the last (residual stroke at most "
        f"{conditions.residual_stroke_max_mm:g} mm)"
    )
    why = f"{stroke:.2f} mm and {force:.1f} kN {when}"
    limits = Limits(None, conditions.residual_stroke_max_mm, "mm")
    return _condition(case, "full-release", cycle.index, text, limits, stroke, verdict, why)


def full_stroke(case: Case, result: CycleResult) -> RequirementResult:
    """Return whether a cycle went to full stroke, or to the force up to which energies count."""
    applies, cap = case.limits.applies, case.limits.energy.force_cap_kN
    nominal = float(case.facts.specimen.get("max_stroke_mm") or applies.stroke_mm)
    least = min(nominal, applies.stroke_mm - applies.stroke_tolerance_mm)
    reached = result.cycle.stroke_max_mm
    force = result.quantities.force_max_kN or 0.0
    full = reached >= least - 3.0 * result.cycle.top.u_stroke_mm or force >= cap
    verdict: Verdict = "pass" if full else "inconclusive"
    why = f"{reached:.2f} mm at {force:.0f} kN" + ("" if full else ": the record stops short of full stroke")
    limits = Limits(least, None, "mm")
    text = f"cycle to full stroke (at least {least:g} mm, or {cap:g} kN)"
    drawn = case.drawn.get(result.cycle.index)
    uncertainty = None if drawn is None else 2.0 * float(np.std(drawn["stroke_max_mm"]))
    return _condition(
        case, "full-stroke", result.cycle.index, text, limits, reached, verdict, why, uncertainty
    )
