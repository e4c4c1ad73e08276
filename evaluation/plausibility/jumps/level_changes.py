"""Forces that step from one cycle to the next: all of the loop (gain), or both ends of it alike (offset).

An amplifier that is switched while the force is small, at a turn or in a pause leaves no leap, but other
cycles after it than before. Springs soften from stroke to stroke, the first time most, and heat softens them
little by little; they do not harden, and they do not step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.facts import Finding, FindingKind
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.jumps.spring_limits import (
    FIRST_SOFTER,
    HARDER,
    LONGER,
    PER_K,
    RECOVERS_S,
    RESTED,
    SOFTER_SINGLE,
    STEADY_K,
    TIRED,
    UNKNOWN_K,
)
from bufferstand.evaluation.plausibility.jumps.uneven_strokes import uneven_stroke
from bufferstand.evaluation.plausibility.run_view import CycleSeries, RunView, pass_of, series_of, ways_of
from bufferstand.foundation.numbers import median

SOFTER = 0.03
"""A loop that shrinks by this share from one cycle to the next, beyond what heat makes, has another gain …"""
STANDS_OUT, STANDS_OUT_SINGLE = 4.0, 3.0
"""… and by so many times the largest change between the cycles before and after; of single strokes, by so
many: their softening is their change."""
OFFSET = 0.02
"""Both ends of the loop move by this share of its force range …"""
EVEN = 0.35
"""… by the same within this share of it …"""
AREA = 0.5
"""… and the area changes by less than this share of that."""
AREA_OF_GAIN = (0.5, 1.6)
"""The area of a loop whose gain changes does so as its force range does, in logarithms."""
_FEWEST = 8
_REACHED = 0.97
_NEAR = 4
_CLEARER = 1.15


class LevelChange(NamedTuple):
    """A level that changes between row ``last`` and row ``first`` of a series, by ``size``."""

    last: int
    first: int
    size: float


def level_jumps(look: RunView) -> list[Finding]:
    """Return where the forces of like cycles step from one to the next.

    Parameters
    ----------
    look : Look
    """
    found = []
    single = look.facts.kind != "harmonic"
    for figures in series_of(look):
        series = _at_one_stroke(look, figures) if single else figures
        if gain := _gain_step(series, single=single):
            text = f"all forces change by {np.expm1(gain.size):+.1%}"
            found.append(_finding(look, series, gain, "gain-jump", float(np.exp(gain.size)), "1", text))
        elif offset := _offset_step(series):
            size = look.sign * offset.size
            text = f"all forces move by {size:+.3g} kN"
            found.append(_finding(look, series, offset, "offset-jump", size, "kN", text))
    if not found and look.facts.kind == "static" and (stroke := uneven_stroke(look)):
        found.append(stroke)
    return found


def _at_one_stroke(look: RunView, series: CycleSeries) -> CycleSeries:
    """Return single strokes with the force at one stroke that all reach for their greatest one.

    They end where the stand happens to end them, and are stiffest there.
    """
    numbers = set(series.index.tolist())
    ways = [
        way for way in ways_of([r.cycle for r in look.results if r.cycle.index in numbers]) if way.way > 0
    ]
    passes = [pass_of(look, way) for way in ways]
    if any(one.stroke_mm.size < _FEWEST for one in passes):
        return series
    low_mm = max(float(one.stroke_mm[0]) for one in passes)
    at_mm = low_mm + _REACHED * (min(float(one.stroke_mm[-1]) for one in passes) - low_mm)
    upper_kN = [float(np.interp(at_mm, one.stroke_mm, one.force_kN)) for one in passes]
    return replace(series, upper_kN=np.array(upper_kN))


def _candidates(level: FloatArray, least: float) -> Iterator[tuple[LevelChange, float]]:
    """Return the larger changes of a level, each with the largest change between cycles beside it.

    Over one boundary or over a cycle between: the one in which something happened is neither like those
    before it nor like those after.
    """
    for gap in (1, 2):
        change = level[gap:] - level[:-gap]
        for last in np.flatnonzero(np.abs(change) > least).tolist():
            first = last + gap
            before, after = level[max(0, last - _NEAR) : last + 1], level[first : first + _NEAR + 1]
            beside = np.concatenate((np.diff(before), np.diff(after)))
            wander = gap * float(np.max(np.abs(beside))) if beside.size else np.nan
            yield LevelChange(last, first, float(change[last])), wander


def _gain_step(series: CycleSeries, *, single: bool) -> LevelChange | None:
    """Return the clearest step of the force range (logarithm) that the area goes along with."""
    if np.any(series.force_range <= 0.0) or np.any(series.absorbed_J <= 0.0):
        return None
    size, area = np.log(series.force_range), np.log(series.absorbed_J)
    best = None
    for step, wander in _candidates(size, min(HARDER, SOFTER)):
        by_area = float(area[step.first] - area[step.last]) / step.size
        if not AREA_OF_GAIN[0] < by_area < AREA_OF_GAIN[1]:
            continue
        least = _least_of_single(series, step) if single else HARDER if step.size > 0.0 else SOFTER
        if np.isnan(wander) and step.size < 0.0:
            least = FIRST_SOFTER
        least += _by_heat(series, step, single=single)
        if not np.isnan(wander):
            least = max(least, (STANDS_OUT_SINGLE if single else STANDS_OUT) * wander)
        best = _clearer(best, step, least)
    return best


def _by_heat(series: CycleSeries, step: LevelChange, *, single: bool) -> float:
    """Return what the temperature of the specimen may make of a change; unknown, what it may have been."""
    heat_K = float(series.temperature_C[step.first] - series.temperature_C[step.last])
    if np.isnan(heat_K):  # strokes warm a spring: none is harder by it
        return PER_K * UNKNOWN_K if single and step.size < 0.0 else 0.0
    return PER_K * abs(heat_K) if abs(heat_K) > STEADY_K else 0.0


def _least_of_single(series: CycleSeries, step: LevelChange) -> float:
    """Return from which size on a change between two single strokes is none of the spring."""
    pauses = series.pause_s[step.last + 1 : step.first + 1]
    before_s = float(series.pause_s[step.last])
    if step.size > 0.0:
        rested = float(np.max(pauses)) > max(LONGER * before_s, RECOVERS_S)
        return RESTED if rested else HARDER
    if step.last == 0:
        return FIRST_SOFTER
    return TIRED if LONGER * float(np.min(pauses)) < before_s else SOFTER_SINGLE


def _offset_step(series: CycleSeries) -> LevelChange | None:
    """Return the clearest step of both ends of the loop by the same [kN], the area left as it is."""
    middle, area = series.middle, np.abs(series.absorbed_J)
    scale = median(series.force_range)
    best = None
    for step, wander in _candidates(middle, OFFSET * scale):
        ends = [float(end[step.first] - end[step.last]) for end in (series.lower_kN, series.upper_kN)]
        if abs(ends[1] - ends[0]) > EVEN * abs(step.size) or not min(area[step.first], area[step.last]) > 0.0:
            continue
        if abs(float(np.log(area[step.first] / area[step.last]))) > AREA * abs(step.size) / scale:
            continue
        best = _clearer(best, step, 0.0 if np.isnan(wander) else STANDS_OUT * wander)
    return best


def _clearer(best: LevelChange | None, step: LevelChange, least: float) -> LevelChange | None:
    if abs(step.size) <= least or (best is not None and abs(step.size) <= _CLEARER * abs(best.size)):
        return best
    return step


def _finding(
    look: RunView,
    series: CycleSeries,
    step: LevelChange,
    kind: FindingKind,
    size: float,
    unit: str,
    change: str,
) -> Finding:
    last, first = int(series.index[step.last]), int(series.index[step.first])
    from_s, to_s = float(series.end_s[step.last]), float(series.start_s[step.first])
    text = (
        f"force jumps between cycles {last} and {first}: {change} at the same stroke, more than softening "
        "explains; gain or offset of the amplifier changed, or the specimen did (friction), and which of "
        "both sides is right is not on record: repeat the test"
    )
    return Finding(kind, "force", from_s, max(from_s, to_s), look.all_cycles, size, unit, text, "spoils")
