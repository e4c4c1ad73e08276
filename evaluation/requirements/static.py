"""The static test judged: preload, forces, energies (ids in docs/evaluation-document.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bufferstand.evaluation.facts import CycleResult, RequirementResult
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.quantities import absorbed_energy_J, stored_energy_J
from bufferstand.evaluation.requirements.conditions import (
    block_contact,
    governing,
    judged_strokes,
    static_conditions,
    why_not,
)
from bufferstand.evaluation.requirements.decision import govern
from bufferstand.evaluation.requirements.limit_set import Cited, ForceWindow, known
from bufferstand.evaluation.requirements.rows import (
    Case,
    RowLimits,
    drawn_ratio,
    judged,
    row,
    shown,
    spoiling,
    unfilled_why,
)
from bufferstand.evaluation.uncertainty import COVERAGE, CyclePropagation, LocalReading, force_draws

PRELOAD_FROM_MM, PRELOAD_TO_MM = 2.0, 10.0
"""Preload: line through the loading branch between these strokes, read at stroke 0 (docs/limit-sets.md)."""
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
    cycles = judged_strokes(case)
    for position, cycle in enumerate(cycles):
        index = cycle.cycle.index
        own = [c for c in conditions if c.cycle == index]
        rules = governing(conditions, index)
        short = any(c.id == "full-stroke" and c.verdict != "pass" for c in own)
        requirements: list[RequirementResult | None] = []
        if _binds(case, position, len(cycles)):
            requirements += [_force(case, cycle, window) for window in case.limits.force]
        requirements += [_stored(case, cycle, short), _ratio(case, cycle, position, short)]
        results += own + [govern(r, rules) for r in requirements if r is not None]
    return results


def _binds(case: Case, position: int, count: int) -> bool:
    """Say whether the force windows bind a cycle (``readings.force_cycles``)."""
    reading = case.limits.readings.force_cycles
    return reading == "all" or position == (0 if reading == "first" else count - 1)


def _unevaluated(
    case: Case, result: CycleResult, identity: str, text: str, limits: RowLimits, cited: Cited
) -> RequirementResult:
    """Return the requirement of a stroke that happened but cannot be evaluated."""
    return row(case, identity, result.cycle.index, text, limits, "inconclusive", why_not(result), cited=cited)


def _force(case: Case, result: CycleResult, window: ForceWindow) -> RequirementResult:
    return replace(_window(case, result, window), stroke_mm=known(window.stroke_mm))


def _window(case: Case, result: CycleResult, window: ForceWindow) -> RequirementResult:
    limits = RowLimits.of(window.lower_kN, window.upper_kN, "kN")
    index = result.cycle.index
    text = f"force at {shown(window.stroke_mm)} mm stroke, loading"
    if not result.cycle.complete:
        text = "preload" if window.stroke_mm == 0.0 else text
        return _unevaluated(case, result, window.id, text, limits, window)
    if window.stroke_mm == 0.0:
        return preload(case, index, window)
    top, stroke_mm = result.cycle.stroke_max_mm, known(window.stroke_mm)
    if stroke_mm is None:
        why = unfilled_why(case)
        return row(case, window.id, index, text, limits, "not-tested", why, cited=window)
    if stroke_mm + case.zero_mm > top + REACH_MM:
        why = f"the stroke ended at {top - case.zero_mm:.2f} mm"
        return row(case, window.id, index, text, limits, "not-tested", why, cited=window)
    return _read_force(case, result, window, stroke_mm)


def _read_force(case: Case, result: CycleResult, window: ForceWindow, stroke_mm: float) -> RequirementResult:
    """Return the row of a window that the cycle reached."""
    limits = RowLimits.of(window.lower_kN, window.upper_kN, "kN")
    prepared, top = case.prepared[result.cycle.index], result.cycle.stroke_max_mm
    index, text = result.cycle.index, f"force at {stroke_mm:g} mm stroke, loading"
    at = stroke_mm + case.zero_mm
    first = max(at - FORCE_HALF_WIDTH_MM, result.cycle.stroke_min_mm)
    last = min(at + FORCE_HALF_WIDTH_MM, top)
    reading = prepared.fit(at, first, last, 2)
    if reading is None:
        why = f"too few samples about {stroke_mm:g} mm"
        return row(case, window.id, index, text, limits, "inconclusive", why, cited=window)
    bound_kN = _bound_kN(case, index, reading, lambda own: own.fit(at, first, last, 2))
    drawn = _drawn(case, reading, bound_kN)
    verdict = judged(case, window.id, index, text, limits, reading.force_kN, drawn, window)
    verdict = _unstated(case, prepared, reading, verdict)
    contact_mm = block_contact(prepared.loop, case.limits.conditions.block_slope_ratio)
    if contact_mm is None or contact_mm >= last:
        return verdict
    why = f"{verdict.why}; the reading lies in block contact, which begins at {contact_mm:.1f} mm"
    if case.limits.readings.block_contact == "flag":
        return replace(verdict, why=why)
    return replace(verdict, verdict="inconclusive", why=why)


def _drawn(case: Case, reading: LocalReading, bound_kN: float) -> FloatArray | None:
    """Return the force of every draw; ``bound_kN`` is what is not on record there."""
    if case.draws is None:
        return None
    return np.asarray(force_draws(case.draws, reading) + bound_kN * case.draws.unrecorded)


def _unstated(
    case: Case, prepared: CyclePropagation, reading: LocalReading, result: RequirementResult
) -> RequirementResult:
    """Return a row without U, not decided where noise and hum alone may carry it across a limit.

    What the channels do not state nobody knows, and the value decides alone. What the record itself shows is
    known: a verdict that another phase of its hum would turn is none.
    """
    if case.draws is not None or result.measured is None or result.verdict not in ("pass", "fail"):
        return result
    own = reading.value_terms[len(reading.value_terms) - len(prepared.own.standard_u) :]
    u_kN = float(np.hypot(reading.value_gain, np.linalg.norm(own * prepared.own.standard_u)))
    limits = [limit for limit in (result.lower_limit, result.upper_limit) if limit is not None]
    if all(abs(result.measured - limit) > COVERAGE * u_kN for limit in limits):
        return result
    why = (
        f"{result.why}, by less than noise and hum on record make of it (± {COVERAGE * u_kN:.2g} kN); "
        "the channels state no accuracy"
    )
    return replace(result, verdict="inconclusive", why=why)


def _bound_kN(  # noqa: N802 - the unit's own letters
    case: Case, index: int, reading: LocalReading, read: Callable[[CyclePropagation], LocalReading | None]
) -> float:
    """Return by how much a reading may be wrong by what is not on record: by what less of it changes.

    Where less leaves nothing to read, by as much as the slope makes of the window.
    """
    if index not in case.reread:
        return 0.0

    def force_kN(own: CyclePropagation) -> float | None:  # noqa: N802
        found = read(own)
        return None if found is None else found.force_kN

    bound = case.reread.bound(index, reading.force_kN, force_kN)
    return abs(reading.slope) * FORCE_HALF_WIDTH_MM if bound is None else bound


def _pulled(case: Case, result: RequirementResult) -> RequirementResult:
    """Return the preload, not failed where it pulls, which no specimen does, and no contact is on record.

    A force that is below 0 at stroke 0 rises from contact behind it: by a zero that is off, or slack.
    """
    seen = case.contact is not None and case.contact.stroke_mm is not None
    pulls = result.measured is not None and result.measured + (result.expanded_uncertainty or 0.0) < 0.0
    if seen or not pulls or result.verdict != "fail":
        return result
    why = f"{result.why}; no specimen pulls, and that stroke 0 is first contact is not on record"
    return replace(result, verdict="inconclusive", why=why, conformance_probability=None)


def preload(case: Case, index: int, window: ForceWindow) -> RequirementResult:
    """Return the preload judged, by the reading of the limit set; ``why`` states the other reading."""
    prepared = case.prepared[index]
    limits = RowLimits.of(window.lower_kN, window.upper_kN, "kN")
    zero = case.zero_mm
    over_line = (zero, zero + PRELOAD_FROM_MM, zero + PRELOAD_TO_MM)
    about = (zero + PRELOAD_READING_MM, zero, zero + 2.0 * PRELOAD_READING_MM)
    line, near = prepared.fit(*over_line, 1), prepared.fit(*about, 1)
    extrapolated = (case.options.preload_reading or case.limits.readings.preload) == "extrapolated"
    reading = line if extrapolated else near
    text = (
        f"preload: loading branch of {PRELOAD_FROM_MM:g} to {PRELOAD_TO_MM:g} mm extrapolated to 0"
        if extrapolated
        else f"preload: force at {PRELOAD_READING_MM:g} mm"
    )
    if reading is None:
        why = "too few samples on the first millimetres of the loading branch"
        return row(case, window.id, index, text, limits, "inconclusive", why, cited=window)
    read_at = over_line if extrapolated else about
    drawn = _drawn(case, reading, _bound_kN(case, index, reading, lambda own: own.fit(*read_at, 1)))
    result = judged(case, window.id, index, text, limits, reading.force_kN, drawn, window)
    result = _pulled(case, _unstated(case, prepared, reading, result))
    other = near if extrapolated else line
    if other is None:
        return result
    place = f"at {PRELOAD_READING_MM:g} mm" if extrapolated else "extrapolated to 0"
    return replace(result, why=f"{result.why}; {other.force_kN:.1f} kN {place}")


def _capped_energies(case: Case, result: CycleResult) -> tuple[float, float, float | None]:
    """Return stored and absorbed energy up to the force cap, and the stroke of the cut (None: no cut)."""
    loop = case.prepared[result.cycle.index].loop
    cap, readings = known(case.limits.energy.force_cap_kN), case.limits.readings
    at = _crossing(loop.force_kN[loop.loading], cap, readings.force_cap_crossing)
    if cap is None or at is None:
        return stored_energy_J(loop), absorbed_energy_J(loop), None
    force, stroke = loop.force_kN, loop.stroke_mm
    share = (cap - force[at - 1]) / (force[at] - force[at - 1])
    cut_mm = float(stroke[at - 1] + share * (stroke[at] - stroke[at - 1]))
    stored = float(np.trapezoid(np.append(force[:at], cap), np.append(stroke[:at], cut_mm)))
    if readings.absorbed_energy == "whole-cycle":
        return stored, absorbed_energy_J(loop), cut_mm
    down = slice(loop.unload, None)
    falling_stroke, falling_force = stroke[down], force[down]
    below = falling_stroke <= cut_mm
    at_cut = float(np.interp(cut_mm, falling_stroke[::-1], falling_force[::-1]))
    returned = float(
        np.trapezoid(np.append(at_cut, falling_force[below]), np.append(cut_mm, falling_stroke[below]))
    )
    chord = 0.5 * (force[-1] + force[0]) * (stroke[0] - stroke[-1])
    return stored, stored + returned + float(chord), cut_mm


def _crossing(force_kN: FloatArray, cap_kN: float | None, which: str) -> int | None:
    """Return the first sample of the loading branch beyond the crossing of the cap, or None."""
    above = force_kN > (np.inf if cap_kN is None else cap_kN)
    if not np.any(above) or above[0]:
        return None
    if which == "first":
        return int(np.argmax(above))
    upward = np.flatnonzero(above[1:] & ~above[:-1]) + 1
    return int(upward[-1]) if above[-1] else None


def _beyond(case: Case, key: str) -> bool:
    return case.limits.readings.comparator == "as-printed" and key in case.limits.energy.printed_greater


def _stored(case: Case, result: CycleResult, short: bool) -> RequirementResult | None:
    limits = case.limits.energy
    least = RowLimits.of(limits.stored_min_J, "none", "J", beyond=_beyond(case, "stored_min_J"))
    if least.nothing:
        return None
    index = result.cycle.index
    text = "stored energy"
    if limits.force_cap_kN != "none":
        text += f" at no more than {shown(limits.force_cap_kN)} kN"
    if not result.cycle.complete:
        return _unevaluated(case, result, "stored-energy", text, least, limits)
    stored, _, cut_mm = _capped_energies(case, result)
    drawn = case.drawn.get(index)
    energies = (
        None
        if drawn is None
        else drawn["stored_energy_J"] * (stored / float(np.mean(drawn["stored_energy_J"])))
    )
    verdict = judged(
        case,
        "stored-energy",
        index,
        text,
        least,
        stored,
        energies,
        limits,
    )
    if cut_mm is not None:
        verdict = replace(verdict, why=f"{verdict.why}; counted to {cut_mm:.2f} mm")
    if limits.force_cap_kN == "fill-in" and verdict.verdict != "inconclusive":
        verdict = replace(verdict, verdict="inconclusive", why=unfilled_why(case))
    if not short or least.unfilled or spoiling(case, "stored-energy", index):
        return verdict
    if verdict.verdict in ("pass", "conditional-pass"):
        return replace(verdict, why=f"{verdict.why}, already at the stroke reached")
    return replace(
        verdict, verdict="inconclusive", why="not met at the stroke reached, which is short of full stroke"
    )


def _ratio(case: Case, result: CycleResult, position: int, short: bool) -> RequirementResult | None:
    """Return the absorbed energy ratio judged by the limit on the first stroke, or on a later one.

    Where it is not certain that the first one on record was the first, its verdict stands if the limit on a
    later one gives the same.
    """
    judgement = _ratio_by(case, result, short, first=position == 0)
    doubt = case.numbering.uncertain(result.cycle.index) if position == 0 else ""
    if judgement is None or not doubt:
        return judgement
    other = _ratio_by(case, result, short, first=False)
    if other is not None and other.verdict == judgement.verdict:
        return judgement
    return replace(
        judgement,
        verdict="inconclusive",
        conformance_probability=None,
        why=f"whether it is the first stroke is not known: {doubt}",
    )


def _ratio_by(case: Case, result: CycleResult, short: bool, *, first: bool) -> RequirementResult | None:
    energy = case.limits.energy
    index = result.cycle.index
    key = "ratio_first_min" if first else "ratio_later_min"
    least = energy.ratio_first_min if first else energy.ratio_later_min
    limits = RowLimits.of(least, "none", "1", beyond=_beyond(case, key))
    if limits.nothing:
        return None
    compared = "more than" if limits.beyond else "at least"
    text = f"absorbed over stored energy of the cycle {compared} {shown(least)}"
    if not result.cycle.complete:
        return _unevaluated(case, result, "absorbed-energy-ratio", text, limits, energy)
    stored, absorbed, _ = _capped_energies(case, result)
    if stored <= 0.0:
        why = "the stored energy is not positive"
        return row(case, "absorbed-energy-ratio", index, text, limits, "inconclusive", why, cited=energy)
    drawn = drawn_ratio(case.drawn.get(index))
    verdict = judged(case, "absorbed-energy-ratio", index, text, limits, absorbed / stored, drawn, energy)
    if energy.force_cap_kN == "fill-in" and verdict.verdict != "inconclusive":
        verdict = replace(verdict, verdict="inconclusive", why=unfilled_why(case))
    if not short or limits.unfilled or spoiling(case, "absorbed-energy-ratio", index):
        return verdict
    return replace(
        verdict,
        verdict="inconclusive",
        conformance_probability=None,
        why="the ratio of a loop that stops short of full stroke is not that of the standard",
    )
