"""Which judgement a run gets: by its kind, its limit set and its specimen."""

from __future__ import annotations

from dataclasses import replace

from bufferstand.evaluation.facts import FirstContact, RequirementResult, RunFacts
from bufferstand.evaluation.requirements.contact_zero import beside
from bufferstand.evaluation.requirements.impact import judge_impact
from bufferstand.evaluation.requirements.limit_set import LimitSet
from bufferstand.evaluation.requirements.maintenance import judge_maintenance
from bufferstand.evaluation.requirements.proof import judge_proof
from bufferstand.evaluation.requirements.rows import Case
from bufferstand.evaluation.requirements.static import judge_static

_NO_TEST = {
    "conditioning": "whose cycles only prepare the specimen",
    "warm-up": "whose cycles only prepare the specimen",
    "force-cycles": "which turns at forces and not at the strokes of a test",
}
"""Kinds of step of which no limit set requires anything, and why."""


def why_not_judged(facts: RunFacts, limits: LimitSet) -> str:
    """Return why a run that could be judged is not, or nothing.

    Of harmonic runs nothing is required but what a ``[[requirement]]`` says.
    """
    if facts.kind == "harmonic" and not limits.asks_of("harmonic"):
        return ""
    if why := _no_test(facts):
        return why
    if not (limits.covers(facts.kind) or limits.asks_of(facts.kind)):
        return f"limit set {limits.id} has nothing on {facts.kind} runs"
    return limits.why_not_for(facts.specimen)


def has_limits_of_its_own(facts: RunFacts, limits: LimitSet) -> bool:
    """Say whether a ``[[requirement]]`` of a limit set is of a run's kind and specimen."""
    return limits.asks_of(facts.kind) and not _no_test(facts) and not limits.why_not_for(facts.specimen)


def is_judged(facts: RunFacts, limits: LimitSet) -> bool:
    """Say whether a limit set requires anything of a run."""
    return limits.covers(facts.kind) and not _no_test(facts) and not limits.why_not_for(facts.specimen)


def _no_test(facts: RunFacts) -> str:
    """Return why nothing is required of what a step does, empty where something is."""
    kind = facts.step.get("kind")
    why = _NO_TEST.get(kind) if isinstance(kind, str) else None
    return "" if why is None else f"the run is a {kind} step of its campaign, {why}"


def judge_with_contact(case: Case, contact: FirstContact | None) -> list[RequirementResult]:
    """Return every requirement and condition; where the stroke zero is off, as read from either zero.

    Parameters
    ----------
    case : Case
    contact : FirstContact or None
        As the record shows it.
    """
    case = replace(case, contact=contact)
    rows = judge(case)
    if contact is None or contact.stroke_mm is None or not contact.beyond:
        return rows
    return beside(rows, judge(replace(case, zero_mm=contact.stroke_mm)))


def judge(case: Case) -> list[RequirementResult]:
    """Return every requirement and condition of the case's limit set on its run."""
    if case.facts.kind == "impact":
        return judge_impact(case)
    if case.facts.kind == "proof":
        return judge_proof(case)
    static = {"conditions", "force", "energy"} & case.limits.model_fields_set
    return [*(judge_static(case) if static else ()), *judge_maintenance(case)]


def assumptions(facts: RunFacts, limits: LimitSet) -> list[str]:
    """Return warnings of what had to be assumed of the specimen."""
    applies = limits.applies
    warnings = []
    asked = ("kind", "max_stroke_mm") if not isinstance(applies.stroke_mm, str) else ("kind",)
    missing = [key for key in asked if facts.specimen.get(key) is None]
    if missing:
        stroke = "" if isinstance(applies.stroke_mm, str) else f" of {applies.stroke_mm:g} mm"
        named = " and ".join(missing)
        warnings.append(f"the specimen's {named} is not on record: judged as a {applies.specimen}{stroke}")
    if applies.elastic_systems and facts.specimen.get("elastic_system") is None:
        systems = ", ".join(applies.elastic_systems)
        warnings.append(f"the specimen's elastic_system is not on record: judged as {systems}")
    return warnings
