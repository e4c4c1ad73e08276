"""The impact test judged, on imported records: stored energy of the category, absorbed energy ratio.

A record may hold rebounds after the impact; the cycle that stores most is the impact, and is judged.
"""

from __future__ import annotations

from dataclasses import replace

from bufferstand.evaluation.facts import CycleResult, RequirementResult, Verdict
from bufferstand.evaluation.requirements.conditions import why_not
from bufferstand.evaluation.requirements.decision import govern
from bufferstand.evaluation.requirements.limit_set import Limit
from bufferstand.evaluation.requirements.rows import (
    Case,
    RowLimits,
    drawn_ratio,
    judged,
    row,
    shown,
    unfilled_why,
)


def judge_impact(case: Case) -> list[RequirementResult]:
    """Return the requirements of the impact test for the impact of a run, and its speed where it is stated.

    The category is that of the specimen; without one, or without a complete cycle, nothing can be concluded.
    """
    speed = _speed(case)
    results = _unless_missing(case, _energies(case))
    if speed is None:
        return results
    return [speed, *(govern(result, [speed]) for result in results)]


def _speed(case: Case) -> RequirementResult | None:
    """Return the condition on the impact speed; None where the set has none, or none is stated.

    The speed is the laboratory's word, without an uncertainty: its value alone decides.
    """
    speed, limits = (
        case.facts.impact_speed_km_h,
        RowLimits.of("none", case.limits.impact.speed_max_km_h, "km/h"),
    )
    if speed is None or limits.nothing:
        return None
    mass = case.facts.impact_mass_t
    why = f"stated by the laboratory: {speed:g} km/h" + ("" if mass is None else f", wagon of {mass:g} t")
    verdict: Verdict = "pass" if limits.meets(speed) else "fail"
    if limits.unfilled:
        verdict, why = "inconclusive", f"{why}; {unfilled_why(case)}"
    text = f"impact speed at most {shown(case.limits.impact.speed_max_km_h)} km/h"
    cited = case.limits.impact
    return row(
        case, "impact-speed", None, text, limits, verdict, why, measured=speed, cited=cited, condition=True
    )


def _unless_missing(case: Case, results: list[RequirementResult]) -> list[RequirementResult]:
    """Return results inconclusive where a stroke happened that cannot be evaluated: it may be the impact."""
    missing = next((stroke for stroke in case.strokes if not stroke.cycle.bounded), None)
    if missing is None:
        return results
    return [
        replace(r, verdict="inconclusive", conformance_probability=None, why=f"{r.why}; {why_not(missing)}")
        for r in results
    ]


def _energies(case: Case) -> list[RequirementResult]:
    category = case.facts.specimen.get("category")
    if not case.cycles:
        why = "no complete cycle on record"
        least = case.limits.impact.stored_min_J.get(str(category), "none")
        return [
            row(case, identity, None, text, limits, "inconclusive", why, cited=case.limits.impact)
            for identity, text, limits in (
                ("stored-energy-category", "stored energy of the category", RowLimits.of(least, "none", "J")),
                (
                    "absorbed-energy-ratio",
                    "absorbed over stored energy",
                    RowLimits.of(case.limits.impact.ratio_min, "none", "1"),
                ),
            )
        ]
    hit = max(case.cycles, key=lambda result: result.quantities.stored_energy_J or float("-inf"))
    requirements = [_stored(case, hit, category), _ratio(case, hit)]
    if len(case.cycles) == 1:
        return requirements
    others = f"the cycle of {len(case.cycles)} that stores most"
    return [replace(requirement, why=f"{requirement.why}; {others}") for requirement in requirements]


def _stored(case: Case, result: CycleResult, category: object) -> RequirementResult:
    impact = case.limits.impact
    index, stored = result.cycle.index, result.quantities.stored_energy_J
    drawn = case.drawn.get(index)
    identity = "stored-energy-category"
    least: Limit = impact.stored_min_J.get(str(category), "none")
    as_printed = case.limits.readings.comparator == "as-printed"
    limits = RowLimits.of(least, "none", "J", beyond=as_printed and str(category) in impact.printed_greater)
    if limits.nothing or stored is None:
        text = "stored energy of the category"
        why = "no stored energy" if stored is None else f"the limit set has no category {category}"
        if category is None:
            why = "the specimen's category is not on record"
        return row(case, identity, index, text, limits, "inconclusive", why, measured=stored, cited=impact)
    energies = None if drawn is None else drawn["stored_energy_J"]
    text = f"stored energy of category {category}"
    return judged(case, identity, index, text, limits, stored, energies, impact)


def _ratio(case: Case, result: CycleResult) -> RequirementResult:
    impact = case.limits.impact
    index, ratio = result.cycle.index, result.quantities.damping
    as_printed = case.limits.readings.comparator == "as-printed"
    beyond = as_printed and "ratio_min" in impact.printed_greater
    identity, limits = "absorbed-energy-ratio", RowLimits.of(impact.ratio_min, "none", "1", beyond=beyond)
    text = f"absorbed over stored energy at least {impact.ratio_min}"
    if ratio is None:
        why = "the stored energy is not positive"
        return row(case, identity, index, text, limits, "inconclusive", why, cited=impact)
    drawn = drawn_ratio(case.drawn.get(index))
    return judged(case, identity, index, text, limits, ratio, drawn, impact)
