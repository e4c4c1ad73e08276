"""The condition on the temperature of the test: at the start of a cycle and during it.

Readings must cover the cycle (:mod:`evaluation.thermometry.coverage`). Where they do not, a valid reading
outside the range still breaks the condition; without one it cannot be told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from evaluation.record import FloatArray, Temperature
from evaluation.requirements.rows import Case, Limits, condition_row, shown
from evaluation.results import CycleResult, RequirementResult, Verdict
from evaluation.thermometry import Hole, longest_hole, read_at, readings_of

_IDENTITY = "temperature-range"


@dataclass(frozen=True)
class _Seen:
    """What one sensor shows of a cycle: lowest and highest temperature, and its longest silence."""

    sensor: Temperature
    coldest_C: float
    warmest_C: float
    hole: Hole


def temperature_range(case: Case, result: CycleResult) -> RequirementResult | None:
    """Return whether a cycle kept to the range; None where the limit set has none.

    The sensors on the specimen count, those in the air where it has none. One of them must cover the cycle;
    what all of them read counts.
    """
    conditions, cycle = case.limits.conditions, result.cycle
    low, high = conditions.temperature_min_C, conditions.temperature_max_C
    text = f"temperature {shown(low)} to {shown(high)} °C at the start of the cycle and during it"
    limits = Limits.of(low, high, "°C")
    if limits.nothing:
        return None
    specimen = [s for s in case.record.temperatures if s.role == "specimen"]
    sensors = specimen or list(case.record.temperatures)
    interval_s = conditions.reading_interval_max_s
    seen = [one for one in (_seen(s, cycle.start_s, cycle.end_s, interval_s) for s in sensors) if one]
    if not seen:
        why = f"no temperature on record within {interval_s:g} s of the cycle"
        return condition_row(case, _IDENTITY, cycle.index, text, limits, None, "inconclusive", why)
    coldest, warmest = min(one.coldest_C for one in seen), max(one.warmest_C for one in seen)
    above = warmest - (limits.upper if limits.upper is not None else np.inf)
    below = (limits.lower if limits.lower is not None else -np.inf) - coldest
    worst = warmest if above > below else coldest
    known = [s.accuracy_C for s in sensors if s.accuracy_C is not None]
    uncertainty = 2.0 * max(known) / float(np.sqrt(3.0)) if len(known) == len(sensors) else None
    what = "spring" if specimen else "ambient"
    why = f"{what} {coldest:.1f} to {warmest:.1f} °C"
    verdict: Verdict = "pass" if limits.meets(coldest) and limits.meets(warmest) else "fail"
    silent = [one for one in seen if one.hole.length_s > interval_s]
    if silent:
        why += "; " + "; ".join(f"{one.sensor.name} has {one.hole.text(interval_s)}" for one in silent)
    if verdict == "pass" and len(silent) == len(seen):
        verdict = "inconclusive"
    return condition_row(case, _IDENTITY, cycle.index, text, limits, worst, verdict, why, uncertainty)


def _seen(sensor: Temperature, start_s: float, end_s: float, interval_s: float) -> _Seen | None:
    """Return what a sensor shows of a cycle: its readings in it, and what they say of its ends.

    They say nothing of an end without a reading within ``interval_s``. None where nothing is left.
    """
    time_s, value_C = readings_of(sensor)
    hole = longest_hole(time_s, start_s, end_s)
    if hole is None:
        return None
    ends = read_at(time_s, value_C, np.array([start_s, end_s]), interval_s)
    inside = value_C[(time_s >= start_s) & (time_s <= end_s)]
    shown_C: FloatArray = np.concatenate((inside, ends[np.isfinite(ends)]))
    if shown_C.size == 0:
        return None
    return _Seen(sensor, float(np.min(shown_C)), float(np.max(shown_C)), hole)
