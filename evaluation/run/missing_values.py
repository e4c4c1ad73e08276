"""Warnings for values that are null and of which nothing has said why yet (docs/evaluation-document.md)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bufferstand.evaluation.facts import CycleResult, DrawWires, RequirementResult, SkewSensitivity, Summary
from bufferstand.evaluation.record import Temperature
from bufferstand.evaluation.run.steps import StepFigures


def missing_warnings(
    results: Sequence[CycleResult],
    whole: StepFigures,
    requirements: Sequence[RequirementResult],
    wires: DrawWires | None,
    numbered: Callable[[Sequence[int]], str],
) -> list[str]:
    """Return a warning for every kind of missing value, each reason once.

    Parameters
    ----------
    results, whole, requirements, wires
        What was found in the run.
    numbered : callable
        Puts numbers of cycles in words.
    """
    warnings = []
    for place, summary, skew in _summaries(whole):
        used = set(summary.cycles_used)
        chosen = [r for r in results if r.cycle.index in used]
        for name in (name for name, measured in summary.values.items() if measured.value is None):
            lacking = [r.cycle.index for r in chosen if getattr(r.quantities, name) is None]
            if lacking and len(lacking) < len(chosen):
                warnings.append(f"{place}no mean of {name}: {numbered(lacking)} has none")
        if skew is None or not skew.cycles:
            continue
        if skew.form == "none":
            warnings.append(
                f"{place}no closed form for what 1 ms of skew changes: the run is neither harmonic nor static"
            )
        if skew.damping_per_ms["by_shifting"] is None:
            warnings.append(f"{place}no change of damping by skew: the stored energy is not positive")
    warnings += requirement_warnings(requirements)
    if wires is None:
        warnings.append("no comparison of draw wires: the record has one stroke channel")
    return warnings


def _summaries(whole: StepFigures) -> list[tuple[str, Summary, SkewSensitivity | None]]:
    """Return summary and effect of skew of the run, or of each of its steps, with words for which."""
    if not whole.steps:
        return [("", whole.summary, whole.skew_sensitivity)]
    return [(f"step {step.index}: ", step.summary, step.skew_sensitivity) for step in whole.steps]


def temperature_warnings(
    results: Sequence[CycleResult],
    temperatures: Sequence[Temperature],
    numbered: Callable[[Sequence[int]], str],
) -> list[str]:
    """Return why cycles of a specimen with a sensor have no temperature: where it is silent, and how long.

    Parameters
    ----------
    results, temperatures
        Of the run.
    numbered : callable
        Puts numbers of cycles in words.
    """
    if not any(sensor.role == "specimen" for sensor in temperatures):
        return []
    warnings = []
    for name, what in (
        ("temperature_start_C", "no temperature at the start"),
        ("temperature_max_C", "no highest temperature"),
    ):
        without = [r for r in results if getattr(r.quantities, name) is None]
        if not without:
            continue
        why = without[0].missing[name]
        first = "" if len(without) == 1 else f" (cycle {without[0].cycle.index})"
        warnings.append(f"{numbered([r.cycle.index for r in without])}: {what}: {why}{first}")
    return warnings


def _references(rows: Sequence[RequirementResult]) -> list[str]:
    """Say of which standard no edition or clause is on record."""
    warnings = []
    for standard in dict.fromkeys(row.standard for row in rows):
        own = [row for row in rows if row.standard == standard]
        without = list(dict.fromkeys(row.id for row in own if row.clause is None))
        every = len(without) == len({row.id for row in own})
        clause = "clause" if every else f"clause for {', '.join(without)}"
        missing = clause if without else ""
        if any(row.edition is None for row in own):
            missing = f"edition and no {clause}" if without else "edition"
        if missing:
            warnings.append(
                f"no {missing} of {standard} on record: the limit set has its numbers from "
                "another source (source of each requirement); a statement of conformity by it is a draft"
            )
    return warnings


def requirement_warnings(rows: Sequence[RequirementResult]) -> list[str]:
    """Return which requirements have no measured value, uncertainty, probability, edition or clause."""

    def names(chosen: Sequence[RequirementResult]) -> str:
        return ", ".join(dict.fromkeys(row.id for row in chosen))

    warnings = _references(rows)
    if unmeasured := [row for row in rows if row.measured is None]:
        warnings.append(f"no measured value of {names(unmeasured)}: the requirement says why")
    measured = [row for row in rows if row.measured is not None]
    if counted := [row for row in measured if row.condition and row.expanded_uncertainty is None]:
        warnings.append(
            f"no expanded uncertainty and conformance probability of {names(counted)}: conditions that are "
            "counted, or read from the record as it stands"
        )
    if other := [row for row in measured if not row.condition and row.expanded_uncertainty is None]:
        warnings.append(
            f"no expanded uncertainty and conformance probability of {names(other)}: none could be propagated"
        )
    certain = [
        r for r in measured if r.expanded_uncertainty is not None and r.conformance_probability is None
    ]
    if certain:
        warnings.append(
            f"no conformance probability of {names(certain)}: it is not judged by its uncertainty"
        )
    return warnings
