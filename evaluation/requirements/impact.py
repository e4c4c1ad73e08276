"""The impact test judged, on imported records: stored energy of the category, absorbed energy ratio."""

from __future__ import annotations

from evaluation.requirements.rows import Case, Limits, drawn_ratio, judged, row
from evaluation.results import CycleResult, RequirementResult


def judge_impact(case: Case) -> list[RequirementResult]:
    """Return the requirements of the impact test for every complete cycle of an impact run.

    The category is that of the specimen; without one, or without a complete cycle, nothing can be concluded.
    """
    category = case.facts.specimen.get("category")
    if not case.cycles:
        why = "no complete cycle on record"
        none = Limits(None, None, "J")
        return [
            row(case, identity, None, text, none, "inconclusive", why, clause=case.limits.impact.clause)
            for identity, text in (
                ("stored-energy-category", "stored energy of the category"),
                ("absorbed-energy-ratio", "absorbed over stored energy"),
            )
        ]
    return [
        requirement
        for result in case.cycles
        for requirement in (_stored(case, result, category), _ratio(case, result))
    ]


def _stored(case: Case, result: CycleResult, category: object) -> RequirementResult:
    impact = case.limits.impact
    index, stored = result.cycle.index, result.quantities.stored_energy_J
    drawn = case.drawn.get(index)
    identity = "stored-energy-category"
    least = impact.stored_min_J.get(str(category))
    limits = Limits(least, None, "J")
    if least is None or stored is None:
        text = "stored energy of the category"
        why = "the specimen's category is not on record" if category is None else "no stored energy"
        return row(
            case, identity, index, text, limits, "inconclusive", why, measured=stored, clause=impact.clause
        )
    energies = None if drawn is None else drawn["stored_energy_J"]
    text = f"stored energy of category {category}"
    return judged(case, identity, index, text, limits, stored, energies, impact.clause)


def _ratio(case: Case, result: CycleResult) -> RequirementResult:
    impact = case.limits.impact
    index, ratio = result.cycle.index, result.quantities.damping
    identity, limits = "absorbed-energy-ratio", Limits(impact.ratio_min, None, "1")
    text = f"absorbed over stored energy at least {impact.ratio_min:g}"
    if ratio is None:
        why = "the stored energy is not positive"
        return row(case, identity, index, text, limits, "inconclusive", why, clause=impact.clause)
    drawn = drawn_ratio(case.drawn.get(index))
    return judged(case, identity, index, text, limits, ratio, drawn, impact.clause)
