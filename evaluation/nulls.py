"""A value that cannot be had is null, with a warning that says why (contracts § 4): those yet unsaid."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from evaluation.alignment import SkewSensitivity
from evaluation.quantities import TEMPERATURE_STALE_S
from evaluation.results import CycleResult, RequirementResult, Summary
from evaluation.wires import DrawWires

_FEW_SAMPLES = ("speed_loading_max_mm_per_s", "speed_unloading_max_mm_per_s", "stroke_distortion")


def missing_warnings(
    results: Sequence[CycleResult],
    summary: Summary,
    requirements: Sequence[RequirementResult],
    skew: SkewSensitivity,
    wires: DrawWires | None,
    numbered: Callable[[Sequence[int]], str],
) -> list[str]:
    """Return a warning for every kind of missing value, each reason once.

    Parameters
    ----------
    results, summary, requirements, skew, wires
        What was found in the run.
    numbered : callable
        Puts numbers of cycles in words.
    """
    warnings = _temperatures(results, numbered)
    for name in _FEW_SAMPLES:
        lacking = [r.cycle.index for r in results if r.cycle.complete and getattr(r.quantities, name) is None]
        if lacking:
            warnings.append(f"{numbered(lacking)}: no {name}: too few samples")
    used = set(summary.cycles_used)
    chosen = [r for r in results if r.cycle.index in used]
    for name in (name for name, measured in summary.values.items() if measured.value is None):
        lacking = [r.cycle.index for r in chosen if getattr(r.quantities, name) is None]
        if lacking and len(lacking) < len(chosen):
            warnings.append(f"no mean of {name}: {numbered(lacking)} has none")
    warnings += _requirements(requirements)
    if skew.cycles and skew.form == "none":
        warnings.append(
            "no closed form for what 1 ms of skew changes: the run is neither harmonic nor static"
        )
    if skew.cycles and skew.damping_per_ms["by_shifting"] is None:
        warnings.append("no change of damping by skew: the stored energy is not positive")
    if wires is None:
        warnings.append("no comparison of draw wires: the record has one stroke channel")
    return warnings


def _temperatures(results: Sequence[CycleResult], numbered: Callable[[Sequence[int]], str]) -> list[str]:
    """Name the cycles without a temperature, where others have one."""
    without = [
        r.cycle.index
        for r in results
        if r.quantities.temperature_start_C is None or r.quantities.temperature_max_C is None
    ]
    known = any(r.quantities.temperature_max_C is not None for r in results)
    if not without or not known:
        return []
    text = f"no reading within {TEMPERATURE_STALE_S:g} s of its start or end"
    return [f"{numbered(without)}: no temperature: the sensors on the specimen have {text}"]


def _requirements(rows: Sequence[RequirementResult]) -> list[str]:
    def names(chosen: Sequence[RequirementResult]) -> str:
        return ", ".join(dict.fromkeys(row.id for row in chosen))

    warnings = []
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
