"""The condition on the temperature of the test: at the start of a cycle and during it.

Readings must cover the cycle (:mod:`bufferstand.evaluation.quantities.temperature.coverage`). Where they do
not, a valid reading in it that is outside of the range still breaks the condition; without one it cannot be
told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.cycles import EASED_S
from bufferstand.evaluation.facts import CycleResult, RequirementResult, Verdict
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.quantities.temperature import TemperatureGap, longest_hole, read_at, readings_of
from bufferstand.evaluation.record import Temperature
from bufferstand.evaluation.requirements.conditions.spans import unsure_s
from bufferstand.evaluation.requirements.rows import Case, RowLimits, condition_row, shown

_IDENTITY = "temperature-range"
_SLOW_S = 1.0
"""A specimen of some ten kilograms does not change its temperature by what counts in so many seconds."""


@dataclass(frozen=True)
class _Seen:
    """What one sensor shows of a cycle: lowest and highest temperature, and its longest silence.

    ``surely_C``: so cold and so warm it was in the cycle, wherever in their steps of time its ends are.
    ``at_start_C``: by the line between the readings about its start, however far these are apart. What comes
    after its end says nothing of it: a specimen may be warmed in a pause.
    """

    sensor: Temperature
    coldest_C: float
    warmest_C: float
    hole: TemperatureGap
    surely_C: tuple[float, float]
    at_start_C: float


def temperature_range(case: Case, result: CycleResult) -> RequirementResult | None:
    """Return whether a cycle kept to the range; None where the limit set has none.

    The sensors on the specimen count, those in the air where it has none. One of them must cover the cycle;
    what all of them read counts. A reading breaks it that was taken in the cycle; what those beside it say of
    its ends, and are outside of the range, leaves it open.
    """
    conditions, cycle = case.limits.conditions, result.cycle
    low, high = conditions.temperature_min_C, conditions.temperature_max_C
    text = f"temperature {shown(low)} to {shown(high)} °C at the start of the cycle and during it"
    limits = RowLimits.of(low, high, "°C")
    if limits.nothing:
        return None
    specimen = [s for s in case.record.temperatures if s.role == "specimen"]
    sensors = specimen or list(case.record.temperatures)
    interval_s = conditions.reading_interval_max_s
    ends_s = np.array([cycle.start_s, cycle.end_s])
    by_s = np.array([unsure_s(case, moment) for moment in ends_s.tolist()])
    missing_s = _missing_s(case, result)
    seen = [one for one in (_seen(s, ends_s, by_s, missing_s, interval_s) for s in sensors) if one]
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
    verdict: Verdict = "pass"
    why = f"{what} {coldest:.1f} to {warmest:.1f} °C"
    silent = [one for one in seen if one.hole.length_s > interval_s]
    if silent:
        why += "; " + "; ".join(f"{one.sensor.name} has {one.hole.text(interval_s)}" for one in silent)
    if any(_breaks(limits, *one.surely_C) for one in seen):
        verdict = "fail"
    elif not all(limits.meets(v) for v in (coldest, warmest, *(s.at_start_C for s in seen))):
        verdict, why = (
            "inconclusive",
            f"{why}; whether it was out of the range within the cycle is not on record",
        )
    elif len(silent) == len(seen):
        verdict = "inconclusive"
    elif unknown := _unknown(case, result):
        verdict, why = "inconclusive", f"{why}; {unknown}"
    return condition_row(case, _IDENTITY, cycle.index, text, limits, worst, verdict, why, uncertainty)


def _breaks(limits: RowLimits, coldest_C: float, warmest_C: float) -> bool:
    """Say whether it was surely colder or warmer than permitted: so cold at least, and so warm at least."""
    below = limits.lower is not None and coldest_C < limits.lower
    return below or (limits.upper is not None and warmest_C > limits.upper)


def _missing_s(case: Case, result: CycleResult) -> FloatArray:
    """Return how much of a cycle lies beyond the record [s]: as much as the longest one is longer, (2,)."""
    cycle = result.cycle
    longest_s = max((own.cycle.duration_s for own in case.strokes if own.cycle.complete), default=np.inf)
    more_s = max(0.0, longest_s - cycle.duration_s)
    return np.array([more_s if turn.method == "cut" else 0.0 for turn in (cycle.start, cycle.end)])


def _unknown(case: Case, result: CycleResult) -> str:
    """Return why readings do not cover a cycle though their stamps are near enough, or nothing."""
    cycle = result.cycle
    inside = (h for h in case.holes if h.unknown and h.end_s > cycle.start_s and h.start_s < cycle.end_s)
    return next((f"how long the cycle lasted is not known: {hole.text}" for hole in inside), "")


def _seen(
    sensor: Temperature, ends_s: FloatArray, by_s: FloatArray, missing_s: FloatArray, interval_s: float
) -> _Seen | None:
    """Return what a sensor shows of a cycle: its readings in it, and what they say of its ends, (2,).

    They say nothing of an end without a reading within ``interval_s``. None where nothing is left. The ends
    are known to ``by_s``, and beyond the record lies ``missing_s``; besides, a stand may ease out of a rest
    and into it within the noise of the stroke, so that the cycle must be covered for so much longer.
    """
    time_s, value_C = readings_of(sensor)
    outward = np.array([-1.0, 1.0])
    covered_s = ends_s + outward * (by_s + EASED_S + missing_s)
    hole = longest_hole(time_s, float(covered_s[0]), float(covered_s[1]))
    if hole is None:
        return None
    ends = read_at(time_s, value_C, ends_s, interval_s)
    inside = value_C[(time_s >= ends_s[0]) & (time_s <= ends_s[1])]
    shown_C: FloatArray = np.concatenate((inside, ends[np.isfinite(ends)]))
    if shown_C.size == 0:
        return None
    surely_C = _surely(time_s, value_C, ends_s, by_s, interval_s)
    at_start_C = float(np.interp(ends_s[0], time_s, value_C))
    return _Seen(sensor, float(np.min(shown_C)), float(np.max(shown_C)), hole, surely_C, at_start_C)


def _surely(
    time_s: FloatArray, value_C: FloatArray, ends_s: FloatArray, by_s: FloatArray, interval_s: float
) -> tuple[float, float]:
    """Return how cold and how warm it surely was in a cycle whose ends are known to ``by_s`` [°C].

    By the readings in it, and those so near to an end that a specimen has its temperature then; and between
    the readings before and behind an end, where it was no warmer than both nor colder. Infinite where nothing
    is sure.
    """
    near_s = np.where(by_s <= _SLOW_S, by_s, -by_s)
    inside = (time_s >= ends_s[0] - near_s[0]) & (time_s <= ends_s[1] + near_s[1])
    before = np.searchsorted(time_s, ends_s - by_s, side="right") - 1
    behind = np.searchsorted(time_s, ends_s + by_s)
    known = (before >= 0) & (behind < time_s.size)
    before, behind = before[known], behind[known]
    joined = time_s[behind] - time_s[before] <= interval_s
    beside = value_C[np.array((before[joined], behind[joined]))]
    sure = value_C[inside]
    coldest = min(np.min(sure, initial=np.inf), np.min(np.max(beside, axis=0), initial=np.inf))
    warmest = max(np.max(sure, initial=-np.inf), np.max(np.min(beside, axis=0), initial=-np.inf))
    return float(coldest), float(warmest)
