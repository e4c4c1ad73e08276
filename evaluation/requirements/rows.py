"""Rows of the table of requirements, and what every judgement needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from evaluation.error_model import Draws
from evaluation.record import FloatArray, Record
from evaluation.requirements.decision import conformance_probability, decide
from evaluation.requirements.limit_set import LimitSet
from evaluation.results import CycleResult, Options, RequirementResult, RunFacts, Verdict
from evaluation.uncertainty import CyclePropagation, expanded


@dataclass(frozen=True, eq=False)
class Case:
    """A run to be judged: its complete cycles in order, each with its prepared loop and drawn figures.

    ``draws`` is None, and ``drawn`` empty, where the channels state no uncertainty.
    """

    record: Record
    facts: RunFacts
    cycles: tuple[CycleResult, ...]
    prepared: Mapping[int, CyclePropagation]
    draws: Draws | None
    drawn: Mapping[int, Mapping[str, FloatArray]]
    limits: LimitSet
    options: Options


@dataclass(frozen=True)
class Limits:
    """Limits of one row, with their unit; None where there is none."""

    lower: float | None
    upper: float | None
    unit: str


def row(
    case: Case,
    identity: str,
    cycle: int | None,
    text: str,
    limits: Limits,
    verdict: Verdict,
    why: str,
    *,
    measured: float | None = None,
    clause: str = "",
    condition: bool = False,
    uncertainty: float | None = None,
    probability: float | None = None,
) -> RequirementResult:
    """Return one row with the identity of the limit set."""
    return RequirementResult(
        standard=case.limits.standard,
        edition=case.limits.edition,
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
    )


def judged(
    case: Case,
    identity: str,
    cycle: int,
    text: str,
    limits: Limits,
    measured: float,
    drawn: FloatArray | None,
    clause: str,
) -> RequirementResult:
    """Return the row of a measured value, judged by the decision rule in force."""
    uncertainty = None if drawn is None else expanded(drawn)
    verdict, why = decide(measured, uncertainty, limits.lower, limits.upper, case.options.decision_rule)
    probability = None
    if uncertainty is not None:
        probability = conformance_probability(measured, 0.5 * uncertainty, limits.lower, limits.upper)
    return row(
        case,
        identity,
        cycle,
        text,
        limits,
        verdict,
        why,
        measured=measured,
        clause=clause,
        uncertainty=uncertainty,
        probability=probability,
    )


def drawn_ratio(drawn: Mapping[str, FloatArray] | None) -> FloatArray | None:
    """Return absorbed over stored energy of every draw, or None."""
    if drawn is None or np.any(drawn["stored_energy_J"] <= 0.0):
        return None
    return np.asarray(drawn["absorbed_energy_J"] / drawn["stored_energy_J"])
