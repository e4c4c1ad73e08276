"""The ring-spring check at overhaul (paper 2.2): preload, lengths, and what the inspector looked at.

Lengths come from the inspector's file; the length as the spring is held is the assembled one less the stroke
that the record shows at that force.
"""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np

from bufferstand.evaluation.facts import RequirementResult
from bufferstand.evaluation.requirements.checklist import judge_item
from bufferstand.evaluation.requirements.limit_set import Cited, ForceWindow, Limit, Maintenance, known
from bufferstand.evaluation.requirements.rows import Case, RowLimits, judged, row
from bufferstand.evaluation.requirements.stated_accuracy import (
    force_expanded_kN,
    stroke_difference_expanded_mm,
)
from bufferstand.evaluation.requirements.static import preload

HOLD_WINDOW = 0.02
"""Stroke at the holding force: line through the loading branch within ± this share of that force."""
_LEAST_SAMPLES = 4


def judge_maintenance(case: Case) -> list[RequirementResult]:
    """Return the four readings in their order, then the items of the visual inspection.

    A set may have either without the other.
    """
    items = [judge_item(case, item) for item in case.limits.inspection]
    limits = case.limits.maintenance
    if limits is None:
        return items
    inspected = case.inspection.inspection if case.inspection else None
    assembled = known(inspected.assembled_length_mm) if inspected else None
    final = known(inspected.final_length_mm) if inspected else None
    return [
        _preload(case, limits),
        _by_hand(
            case,
            "assembled-length",
            assembled,
            limits.assembled_length_min_mm,
            limits.assembled_length_max_mm,
        ),
        _held(case, limits, assembled),
        _by_hand(case, "final-length", final, limits.final_length_min_mm, limits.final_length_max_mm),
        *items,
    ]


def _preload(case: Case, limits: Maintenance) -> RequirementResult:
    window = ForceWindow(
        id="preload",
        clause=limits.clause,
        source=limits.source,
        stroke_mm=0.0,
        lower_kN=limits.preload_min_kN,
        upper_kN=limits.preload_max_kN,
    )
    if case.cycles:
        return replace(preload(case, case.cycles[0].cycle.index, window), stroke_mm=0.0)
    bounds = RowLimits.of(limits.preload_min_kN, limits.preload_max_kN, "kN")
    why = "no complete cycle on record"
    return row(case, "preload", None, "preload", bounds, "not-tested", why, cited=limits)


def _cited(case: Case) -> Cited:
    return case.limits.maintenance or Cited()


def _hand_uncertainty_mm(case: Case) -> float | None:
    inspected = case.inspection.inspection if case.inspection else None
    return known(inspected.length_expanded_uncertainty_mm) if inspected else None


def _by_hand(
    case: Case, identity: str, length_mm: float | None, lower: Limit, upper: Limit
) -> RequirementResult:
    limits, text = RowLimits.of(lower, upper, "mm"), identity.replace("-", " ")
    if length_mm is None:
        why = f"no {text} in an inspector's file for this specimen"
        return row(case, identity, None, text, limits, "not-tested", why, cited=_cited(case))
    return judged(
        case,
        identity,
        None,
        text,
        limits,
        length_mm,
        None,
        _cited(case),
        uncertainty=_hand_uncertainty_mm(case),
    )


def held_stroke(case: Case, force_kN: float) -> tuple[float, float] | None:
    """Return the stroke of the first complete cycle's loading branch at a force, and its slope there.

    In mm and mm/kN; None where the force was not reached.
    """
    if not case.cycles:
        return None
    loop = case.prepared[case.cycles[0].cycle.index].loop
    stroke, force = loop.stroke_mm[loop.loading], loop.force_kN[loop.loading]
    inside = np.abs(force - force_kN) <= HOLD_WINDOW * force_kN
    if np.count_nonzero(inside) < _LEAST_SAMPLES or np.max(force) < (1.0 - 0.5 * HOLD_WINDOW) * force_kN:
        return None
    at_mm, slope = np.polynomial.polynomial.polyfit(force[inside] - force_kN, stroke[inside], 1)
    return float(at_mm) - case.zero_mm, float(slope)


def _held_uncertainty_mm(case: Case, force_kN: float, stroke_mm: float, slope: float) -> float | None:
    """Return U of the length as held: by hand, by the wires, and by a force that is another one than read."""
    by_force = force_expanded_kN(case.facts, force_kN)
    by_hand, by_wire = _hand_uncertainty_mm(case), stroke_difference_expanded_mm(case.facts, stroke_mm)
    if by_hand is None or by_wire is None or by_force is None:
        return None
    return hypot(by_hand, by_wire, slope * by_force)


def _held(case: Case, limits: Maintenance, assembled_mm: float | None) -> RequirementResult:
    identity = f"length-at-{limits.hold_force_kN:g}kN"
    text = f"length at {limits.hold_force_kN:g} kN"
    bounds = RowLimits.of(limits.length_at_hold_min_mm, limits.length_at_hold_max_mm, "mm")
    held = held_stroke(case, limits.hold_force_kN)
    if held is None or assembled_mm is None:
        why = (
            f"the record does not reach {limits.hold_force_kN:g} kN"
            if held is None
            else (f"stroke {held[0]:.2f} mm at that force, but no assembled length in an inspector's file")
        )
        return row(case, identity, None, text, bounds, "not-tested", why, cited=limits)
    stroke, slope = held
    uncertainty = _held_uncertainty_mm(case, limits.hold_force_kN, stroke, slope)
    length = assembled_mm - stroke
    result = judged(case, identity, None, text, bounds, length, None, limits, uncertainty=uncertainty)
    return replace(result, why=f"{result.why}; {assembled_mm:.2f} mm less {stroke:.2f} mm of stroke")
