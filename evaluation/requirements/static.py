"""The static test judged: preload and force windows, stored energy, absorbed energy ratio (contracts § 4)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from evaluation.quantities import absorbed_energy_J, stored_energy_J
from evaluation.record import FloatArray
from evaluation.requirements.conditions import governing, static_conditions
from evaluation.requirements.decision import govern
from evaluation.requirements.limit_set import ForceWindow
from evaluation.requirements.rows import Case, Limits, drawn_ratio, judged, row
from evaluation.results import CycleResult, RequirementResult
from evaluation.uncertainty import CyclePropagation, LocalReading, force_draws

PRELOAD_FROM_MM, PRELOAD_TO_MM = 2.0, 10.0
"""Preload: line through the loading branch between these strokes, read at stroke 0 (standards.md 1.2)."""
PRELOAD_READING_MM = 0.5
"""Other reading of the preload, and always stated beside the first: the force at this stroke."""
FORCE_HALF_WIDTH_MM = 2.5
"""Forces at a stroke: parabola over ± this much of the loading branch, never a single sample."""
REACH_MM = 0.1
"""A window counts as reached if the stroke ends no more than this short of it."""


def judge_static(case: Case) -> list[RequirementResult]:
    """Return conditions and requirements of the static test, cycle by cycle.

    Parameters
    ----------
    case : Case
        A static run of a specimen that the limit set applies to.

    Returns
    -------
    list of RequirementResult
        Conditions of the run first, then per cycle conditions and requirements.
    """
    conditions = static_conditions(case)
    results: list[RequirementResult] = [c for c in conditions if c.cycle is None]
    for position, cycle in enumerate(case.cycles[: case.limits.conditions.cycles]):
        index = cycle.cycle.index
        own = [c for c in conditions if c.cycle == index]
        rules = governing(conditions, index)
        short = next(c for c in own if c.id == "full-stroke").verdict != "pass"
        requirements = [_force(case, cycle, window) for window in case.limits.force]
        requirements += [_stored(case, cycle, short), _ratio(case, cycle, position, short)]
        results += own + [govern(requirement, rules) for requirement in requirements]
    return results


def _force(case: Case, result: CycleResult, window: ForceWindow) -> RequirementResult:
    limits = Limits(window.lower_kN, window.upper_kN, "kN")
    prepared = case.prepared[result.cycle.index]
    index = result.cycle.index
    if window.stroke_mm == 0.0:
        return _preload(case, index, prepared, window)
    text = f"force at {window.stroke_mm:g} mm stroke, loading"
    top = result.cycle.stroke_max_mm
    if window.stroke_mm > top + REACH_MM:
        why = f"the stroke ended at {top:.2f} mm"
        return row(case, window.id, index, text, limits, "not-tested", why, clause=window.clause)
    first = max(window.stroke_mm - FORCE_HALF_WIDTH_MM, result.cycle.stroke_min_mm)
    last = min(window.stroke_mm + FORCE_HALF_WIDTH_MM, top)
    reading = prepared.fit(window.stroke_mm, first, last, 2)
    if reading is None:
        why = f"too few samples about {window.stroke_mm:g} mm"
        return row(case, window.id, index, text, limits, "inconclusive", why, clause=window.clause)
    return judged(
        case, window.id, index, text, limits, reading.force_kN, _drawn(case, reading), window.clause
    )


def _drawn(case: Case, reading: LocalReading) -> FloatArray | None:
    return None if case.draws is None else force_draws(case.draws, reading)


def _preload(case: Case, index: int, prepared: CyclePropagation, window: ForceWindow) -> RequirementResult:
    limits = Limits(window.lower_kN, window.upper_kN, "kN")
    line = prepared.fit(0.0, PRELOAD_FROM_MM, PRELOAD_TO_MM, 1)
    near = prepared.fit(PRELOAD_READING_MM, 0.0, 2.0 * PRELOAD_READING_MM, 1)
    extrapolated = case.options.preload_reading == "extrapolated"
    reading = line if extrapolated else near
    text = (
        f"preload: loading branch of {PRELOAD_FROM_MM:g} to {PRELOAD_TO_MM:g} mm extrapolated to 0"
        if extrapolated
        else f"preload: force at {PRELOAD_READING_MM:g} mm"
    )
    if reading is None:
        why = "too few samples on the first millimetres of the loading branch"
        return row(case, window.id, index, text, limits, "inconclusive", why, clause=window.clause)
    result = judged(
        case, window.id, index, text, limits, reading.force_kN, _drawn(case, reading), window.clause
    )
    other = near if extrapolated else line
    if other is None:
        return result
    place = f"at {PRELOAD_READING_MM:g} mm" if extrapolated else "extrapolated to 0"
    return replace(result, why=f"{result.why}; {other.force_kN:.1f} kN {place}")


def _capped_energies(case: Case, result: CycleResult) -> tuple[float, float, float | None]:
    """Return stored and absorbed energy up to the force cap, and the stroke of the cut (None: no cut)."""
    loop = case.prepared[result.cycle.index].loop
    above = np.flatnonzero(loop.force_kN[loop.loading] > case.limits.energy.force_cap_kN)
    if above.size == 0 or above[0] == 0:
        return stored_energy_J(loop), absorbed_energy_J(loop), None
    at = int(above[0])
    force, stroke = loop.force_kN, loop.stroke_mm
    share = (case.limits.energy.force_cap_kN - force[at - 1]) / (force[at] - force[at - 1])
    cut_mm = float(stroke[at - 1] + share * (stroke[at] - stroke[at - 1]))
    stored = float(
        np.trapezoid(np.append(force[:at], case.limits.energy.force_cap_kN), np.append(stroke[:at], cut_mm))
    )
    down = slice(loop.unload, None)
    falling_stroke, falling_force = stroke[down], force[down]
    below = falling_stroke <= cut_mm
    at_cut = float(np.interp(cut_mm, falling_stroke[::-1], falling_force[::-1]))
    returned = float(
        np.trapezoid(np.append(at_cut, falling_force[below]), np.append(cut_mm, falling_stroke[below]))
    )
    chord = 0.5 * (force[-1] + force[0]) * (stroke[0] - stroke[-1])
    return stored, stored + returned + float(chord), cut_mm


def _stored(case: Case, result: CycleResult, short: bool) -> RequirementResult:
    limits = case.limits.energy
    index = result.cycle.index
    stored, _, cut_mm = _capped_energies(case, result)
    drawn = case.drawn.get(index)
    energies = (
        None
        if drawn is None
        else drawn["stored_energy_J"] * (stored / float(np.mean(drawn["stored_energy_J"])))
    )
    text = f"stored energy at no more than {limits.force_cap_kN:g} kN"
    verdict = judged(
        case,
        "stored-energy",
        index,
        text,
        Limits(limits.stored_min_J, None, "J"),
        stored,
        energies,
        limits.clause,
    )
    if cut_mm is not None:
        verdict = replace(verdict, why=f"{verdict.why}; counted to {cut_mm:.2f} mm")
    if not short:
        return verdict
    if verdict.verdict in ("pass", "conditional-pass"):
        return replace(verdict, why=f"{verdict.why}, already at the stroke reached")
    return replace(
        verdict, verdict="inconclusive", why="not met at the stroke reached, which is short of full stroke"
    )


def _ratio(case: Case, result: CycleResult, position: int, short: bool) -> RequirementResult:
    energy = case.limits.energy
    index = result.cycle.index
    least = energy.ratio_first_min if position == 0 else energy.ratio_later_min
    limits = Limits(least, None, "1")
    text = f"absorbed over stored energy of the cycle at least {least:g}"
    stored, absorbed, _ = _capped_energies(case, result)
    if stored <= 0.0:
        why = "the stored energy is not positive"
        return row(
            case, "absorbed-energy-ratio", index, text, limits, "inconclusive", why, clause=energy.clause
        )
    drawn = drawn_ratio(case.drawn.get(index))
    verdict = judged(
        case, "absorbed-energy-ratio", index, text, limits, absorbed / stored, drawn, energy.clause
    )
    if not short:
        return verdict
    return replace(
        verdict,
        verdict="inconclusive",
        why="the ratio of a loop that stops short of full stroke is not that of the standard",
    )
