"""Rows of the table of requirements, and what every judgement needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bufferstand.evaluation.facts import (
    CycleResult,
    Finding,
    FirstContact,
    Inspection,
    Options,
    RequirementResult,
    RunFacts,
    Verdict,
)
from bufferstand.evaluation.gaps import BoundedReadings, Numbering, RecordGap
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility import SpoiledFigures
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.requirements.decision import conformance_probability, decide
from bufferstand.evaluation.requirements.limit_set import Cited, Limit, LimitSet, known
from bufferstand.evaluation.uncertainty import CyclePropagation, Draws, Regression, expanded


@dataclass(frozen=True, eq=False)
class Case:
    """A run to be judged: its complete cycles in order, each with its prepared loop and drawn figures.

    ``draws`` is None, and ``drawn`` empty, where the channels state no uncertainty. ``strokes`` are all
    cycles as they happened, complete or not; ``reread`` those of which something is not on record, from less
    of it (:mod:`bufferstand.evaluation.gaps.bounds`).
    """

    record: Record
    facts: RunFacts
    cycles: tuple[CycleResult, ...]
    prepared: Mapping[int, CyclePropagation]
    draws: Draws | None
    drawn: Mapping[int, Mapping[str, FloatArray]]
    limits: LimitSet
    options: Options
    inspection: Inspection | None = None
    """What the inspector of this run or specimen wrote down."""
    strokes: tuple[CycleResult, ...] = ()
    numbering: Numbering = field(default_factory=Numbering)
    reread: BoundedReadings = field(default_factory=BoundedReadings)
    regression: Regression | None = None
    """By which what was drawn of a figure says what it owes to the errors of the channels."""
    zero_mm: float = 0.0
    """Where strokes are counted from, on the recorded stroke: 0, or first contact."""
    contact: FirstContact | None = None
    """First contact as the record shows it."""
    spoiled: SpoiledFigures = field(default_factory=SpoiledFigures)
    """What of the record is not to be believed."""
    holes: tuple[RecordGap, ...] = ()
    """What is not on record, in order of time."""


@dataclass(frozen=True)
class RowLimits:
    """Limits of one row, with their unit; None where there is none.

    ``unfilled``: the limit set leaves a side to be filled in. ``beyond``: the lower limit itself fails.
    """

    lower: float | None
    upper: float | None
    unit: str
    unfilled: bool = False
    beyond: bool = False

    @classmethod
    def of(cls, lower: Limit, upper: Limit, unit: str, *, beyond: bool = False) -> RowLimits:
        """Return the limits of a row as a limit set states them."""
        return cls(known(lower), known(upper), unit, "fill-in" in (lower, upper), beyond)

    @property
    def nothing(self) -> bool:
        """Whether nothing at all is required."""
        return self.lower is None and self.upper is None and not self.unfilled

    def meets(self, value: float) -> bool:
        """Say whether a value keeps the limits that are known."""
        return (self.lower is None or value >= self.lower) and (self.upper is None or value <= self.upper)


def shown(limit: Limit) -> str:
    """Return a limit for a text."""
    return "(to be filled in)" if isinstance(limit, str) else f"{limit:g}"


def unfilled_why(case: Case) -> str:
    """Return why nothing can be concluded from a limit that was not filled in."""
    return f"limit set {case.limits.id} leaves the limit to be filled in from {case.limits.standard}"


def row(
    case: Case,
    identity: str,
    cycle: int | None,
    text: str,
    limits: RowLimits,
    verdict: Verdict,
    why: str,
    *,
    measured: float | None = None,
    cited: Cited | None = None,
    condition: bool = False,
    uncertainty: float | None = None,
    probability: float | None = None,
    by_hand: bool = False,
) -> RequirementResult:
    """Return one row with the identity of the limit set; ``cited`` is the section that states it.

    Where a channel that it is read from is not to be believed, nothing can be concluded from it, whatever
    the value: neither uncertainty nor probability are claimed then. What is answered ``by_hand`` is read
    from none.
    """
    clause, source = case.limits.reference(cited, identity)
    finding = None if by_hand else spoiling(case, identity, cycle)
    if finding is not None:
        verdict, uncertainty, probability = "inconclusive", None, None
        why = f"{finding.text} (without that: {why})"
    return RequirementResult(
        standard=case.limits.standard,
        edition=case.limits.edition or None,
        id=identity,
        cycle=cycle,
        requirement=text,
        measured=measured,
        expanded_uncertainty=uncertainty,
        lower_limit=limits.lower,
        upper_limit=limits.upper,
        unit=limits.unit,
        conformance_probability=probability,
        verdict=verdict,
        why=why,
        condition=condition,
        clause=clause,
        source=source,
    )


def spoiling(case: Case, identity: str, cycle: int | None) -> Finding | None:
    """Return the finding because of which nothing can be concluded from a row, if there is one."""
    # A single event is picked among all cycles: what spoils one of them may have changed the choice.
    single = case.facts.kind in ("impact", "proof")
    return case.spoiled.of_row(identity, None if single else cycle)


def condition_row(
    case: Case,
    identity: str,
    cycle: int | None,
    text: str,
    limits: RowLimits,
    measured: float | None,
    verdict: Verdict,
    why: str,
    uncertainty: float | None = None,
) -> RequirementResult:
    """Return the row of a condition; where the limit set leaves it open, inconclusive unless broken."""
    if limits.unfilled and verdict != "fail":
        verdict, why = "inconclusive", f"{why}; {unfilled_why(case)}"
    return row(
        case,
        identity,
        cycle,
        text,
        limits,
        verdict,
        why,
        measured=measured,
        cited=case.limits.conditions,
        condition=True,
        uncertainty=uncertainty,
    )


def judged(
    case: Case,
    identity: str,
    cycle: int | None,
    text: str,
    limits: RowLimits,
    measured: float,
    drawn: FloatArray | None,
    cited: Cited,
    *,
    uncertainty: float | None = None,
    condition: bool = False,
) -> RequirementResult:
    """Return the row of a measured value, judged by the decision rule in force.

    Its U is that of ``drawn``, or ``uncertainty`` where nothing was drawn. A value that keeps every known
    limit beside one that is not filled in is inconclusive.
    """
    if drawn is not None:
        uncertainty = expanded(drawn)
    verdict, why = decide(
        measured,
        uncertainty,
        limits.lower,
        limits.upper,
        case.options.decision_rule,
        beyond=limits.beyond,
    )
    if limits.unfilled and verdict not in ("fail", "conditional-fail"):
        verdict, why = "inconclusive", unfilled_why(case)
    probability = None
    if uncertainty is not None and not limits.unfilled:
        probability = conformance_probability(measured, 0.5 * uncertainty, limits.lower, limits.upper)
    result = row(
        case,
        identity,
        cycle,
        text,
        limits,
        verdict,
        why,
        measured=measured,
        cited=cited,
        condition=condition,
        uncertainty=uncertainty,
        probability=probability,
    )
    if drawn is None or case.regression is None:
        return result
    return replace(result, shared=case.regression.contributions(drawn))


def drawn_ratio(drawn: Mapping[str, FloatArray] | None) -> FloatArray | None:
    """Return absorbed over stored energy of every draw, or None."""
    if drawn is None or np.any(drawn["stored_energy_J"] <= 0.0):
        return None
    return np.asarray(drawn["absorbed_energy_J"] / drawn["stored_energy_J"])
