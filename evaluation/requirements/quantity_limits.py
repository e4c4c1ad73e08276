"""Limits on any quantity of any kind of run, as ``[[requirement]]`` of a limit set states them.

What is judged is the mean over the cycles that the run's results are from, with its U; of a quantity that is
an extreme of all samples (``force_max_kN`` …) that extreme. Of a record with several steps each is judged.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.facts import (
    DecisionRule,
    Extreme,
    Finding,
    Measured,
    RequirementResult,
    RunFacts,
    Summary,
    Verdict,
)
from bufferstand.evaluation.requirements.decision import conformance_probability, decide
from bufferstand.evaluation.requirements.limit_set import LimitSet, QuantityLimit
from bufferstand.evaluation.requirements.rows import RowLimits

_SPEEDS = {"speed_max_mm_per_s": "mm/s"}
"""Extremes that are no quantity of a cycle, with their unit."""


@dataclass(frozen=True)
class JudgedPart:
    """A run, or a step of it: its name (empty: the run), its means and its extremes."""

    name: str
    summary: Summary
    extremes: Mapping[str, Extreme]


def judge_quantities(
    limits: LimitSet,
    facts: RunFacts,
    parts: Sequence[JudgedPart],
    rule: DecisionRule,
    spoiling: Iterable[Finding] = (),
) -> list[RequirementResult]:
    """Return a row for each ``[[requirement]]`` that asks something of a run, for each of its parts.

    Parameters
    ----------
    limits : LimitSet
    facts : RunFacts
        Its kind decides which requirements are meant for it.
    parts : sequence of JudgedPart
    rule : "simple" or "guard-band"
    spoiling : iterable of Finding
        What of the record is not to be believed.

    Returns
    -------
    list of RequirementResult
        None for a part that lies outside of ``where``. One of which that is not known is inconclusive.
    """
    spoiling = tuple(spoiling)
    found = []
    for required in limits.requirement:
        if required.kind != facts.kind:
            continue
        for part in parts:
            outside, unknown = _place(required, part)
            if not outside:
                found.append(_judged(limits, required, part, rule, unknown, spoiling))
    return found


def _place(required: QuantityLimit, part: JudgedPart) -> tuple[bool, str]:
    """Return whether a part lies outside of ``where``, and why that is not known."""
    unknown = ""
    for name, (low, high) in required.where.items():
        value = _figure(name, part)[0]
        if value is None:
            unknown = unknown or f"it is not known whether {name} is from {low:g} to {high:g}"
        elif not low <= value <= high:
            return True, ""
    return False, unknown


def _figure(name: str, part: JudgedPart) -> tuple[float | None, float | None, str]:
    """Return value, U, and what speaks against it."""
    figure: Extreme | Measured | None = part.extremes.get(name)
    if isinstance(figure, Extreme):
        missing = "" if figure.value is not None else f"the record has no {name}"
        return figure.value, figure.expanded_uncertainty, figure.doubt or missing
    figure = part.summary.values.get(name)
    if figure is None:
        return None, None, "no complete and steady cycle is on record"
    return figure.value, figure.expanded_uncertainty, "" if figure.value is not None else figure.missing


def _judged(
    limits: LimitSet,
    required: QuantityLimit,
    part: JudgedPart,
    rule: DecisionRule,
    unknown: str,
    spoiling: Sequence[Finding],
) -> RequirementResult:
    """Return the row of a requirement for a part of the run."""
    name = required.quantity
    unit = _SPEEDS.get(name) or QUANTITIES.named(name).unit
    bounds = RowLimits.of(required.lower, required.upper, "" if unit == "1" else unit)
    value, expanded, against = _figure(name, part)
    finding = _spoils(name, part, spoiling)
    against = (finding.text if finding is not None else "") or against or unknown
    probability = None
    verdict: Verdict
    if against or value is None:
        verdict, why = "inconclusive", against or "it has no value"
        expanded = None if finding is not None else expanded
    else:
        verdict, why = decide(value, expanded, bounds.lower, bounds.upper, rule)
        if bounds.unfilled and verdict not in ("fail", "conditional-fail"):
            verdict = "inconclusive"
            why = f"limit set {limits.id} leaves the limit to be filled in from {limits.standard}"
        elif expanded is not None:
            probability = conformance_probability(value, 0.5 * expanded, bounds.lower, bounds.upper)
    clause, source = limits.reference(required)
    return RequirementResult(
        standard=limits.standard,
        edition=limits.edition or None,
        id=required.id,
        cycle=None,
        requirement=_text(required, part),
        measured=value,
        expanded_uncertainty=expanded,
        lower_limit=bounds.lower,
        upper_limit=bounds.upper,
        unit=bounds.unit,
        conformance_probability=probability,
        verdict=verdict,
        why=why,
        clause=clause,
        source=source,
    )


def _spoils(name: str, part: JudgedPart, spoiling: Sequence[Finding]) -> Finding | None:
    """Return the finding that spoils a mean: in one of its cycles, on a channel that it is read from."""
    if name in part.extremes:
        return None  # the doubt of an extreme is its own
    reads, used = QUANTITIES.named(name).reads, set(part.summary.cycles_used)
    return next((one for one in spoiling if one.quantity in reads and used & set(one.cycles)), None)


def _text(required: QuantityLimit, part: JudgedPart) -> str:
    """Return the requirement in words: of which quantity, and where."""
    text = required.text or required.quantity
    where = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in required.where.items())
    return text + (f" at {where}" if where else "") + (f" ({part.name})" if part.name else "")
