"""The runs of one specimen in order: before and after, and the sum of its proof loads."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from bufferstand.evaluation.across_runs.differences import UncertainValue, difference
from bufferstand.evaluation.across_runs.grouping import grouped, specimen_of
from bufferstand.evaluation.across_runs.run_means import assumption, basis_of
from bufferstand.evaluation.across_runs.temperature_comparison import (
    SAME_AMPLITUDE,
    SAME_FREQUENCY,
    SAME_SPEED,
    SAME_STROKE_MM,
)
from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.facts import (
    BeforeAfterEntry,
    ChangeEntry,
    ProofLoadEntry,
    ProofRunEntry,
    RunEvaluation,
    RunInTimeEntry,
)

PRELOAD = "preload_kN"
"""The preload is no figure of a cycle: it is what was judged (requirement ``preload``)."""
COMPARED = (PRELOAD, *(entry.name for entry in QUANTITIES if entry.shown.before_after))
_WARMER_K = 2.0


def _specimen(run: RunEvaluation) -> str:
    return str(run.facts.specimen.get("id") or "")


def before_after_entries(points: Sequence[RunEvaluation]) -> list[BeforeAfterEntry]:
    """Return each step that a specimen went through more than once: every later run against the first.

    Parameters
    ----------
    points : sequence of RunEvaluation
        A result for each run, or for each step of a run that has several.
    """
    usable = [
        p
        for p in points
        if p.facts.kind in ("static", "harmonic")
        and p.summary.cycles_used
        and p.facts.started is not None
        and _specimen(p)
    ]
    usable.sort(key=lambda p: (specimen_of(p), p.facts.kind, _started_s(p), p.facts.id))
    found: list[BeforeAfterEntry] = []
    # Only runs of one specimen are compared with each other: an archive has many of them.
    of_specimens = groupby(usable, key=lambda p: (specimen_of(p), p.facts.kind))
    for ordered in (group for _, own in of_specimens for group in grouped(list(own), _same_step)):
        first, *later = ordered
        if len({_started_s(p) for p in ordered}) > 1:
            found.append(
                {
                    "specimen": _specimen(first),
                    "kind": first.facts.kind,
                    "before": _one(first),
                    "after": [{**_one(p), "changes": _changes(first, p)} for p in later],
                    "warnings": [*_warmer(first, later), *assumption(basis_of(ordered))],
                }
            )
    return found


def _started_s(run: RunEvaluation) -> float:
    return 0.0 if run.facts.started is None else run.facts.started.timestamp()


def _same_step(one: RunEvaluation, two: RunEvaluation) -> bool:
    def within(name: str, share: float, least: float) -> bool:
        a, b = _mean(one, name), _mean(two, name)
        return a is not None and b is not None and abs(a - b) <= max(share * max(abs(a), abs(b)), least)

    if one.facts.kind == "static":
        return within("stroke_min_mm", 0.0, SAME_STROKE_MM) and within(
            "speed_loading_max_mm_per_s", SAME_SPEED, 0.0
        )
    return (
        within("prestress_mm", 0.0, SAME_STROKE_MM)
        and within("amplitude_mm", SAME_AMPLITUDE, 0.5)
        and within("frequency_Hz", SAME_FREQUENCY, 0.0)
    )


def _mean(run: RunEvaluation, name: str) -> float | None:
    measured = run.summary.values.get(name)
    return None if measured is None else measured.value


def _one(run: RunEvaluation) -> RunInTimeEntry:
    return {
        "run": run.facts.id,
        "path": run.facts.path,
        "started": None if run.facts.started is None else run.facts.started.isoformat(),
        "temperature_C": _mean(run, "temperature_start_C"),
    }


def _changes(first: RunEvaluation, other: RunEvaluation) -> dict[str, ChangeEntry]:
    """Return what changed, with U: errors that both runs have in common cancel as far as they act alike."""
    changes: dict[str, ChangeEntry] = {}
    for name in COMPARED:
        before, after = _value(first, name), _value(other, name)
        if before is None or after is None:
            continue
        apart = difference(after, before)
        changes[name] = {
            "before": before.value,
            "after": after.value,
            "change": apart.value,
            "relative_change": apart.relative,
            "expanded_uncertainty": apart.expanded_uncertainty,
            "coverage_factor": 2.0,
            "half_width_95": apart.half_width_95,
            "beyond": apart.beyond,
        }
    return changes


def _value(run: RunEvaluation, name: str) -> UncertainValue | None:
    measured = run.preload if name == PRELOAD else run.summary.values.get(name)
    if measured is None or measured.value is None:
        return None
    shared = None
    if run.shared_errors is not None:
        shared = run.shared_errors.of("preload" if name == PRELOAD else name)
    if shared is None:
        return UncertainValue(measured.value, measured.expanded_uncertainty)
    return UncertainValue(measured.value, measured.expanded_uncertainty, shared)


def _warmer(first: RunEvaluation, later: Sequence[RunEvaluation]) -> list[str]:
    temperatures = [_mean(r, "temperature_start_C") for r in (first, *later)]
    known = [t for t in temperatures if t is not None]
    if len(known) < len(temperatures):
        return ["not every run has a temperature: what is due to it is not known"]
    if max(known) - min(known) <= _WARMER_K:
        return []
    return [f"temperatures differ by {max(known) - min(known):.1f} K: the changes hold the effect of that"]


def proof_load_entries(runs: Sequence[RunEvaluation]) -> list[ProofLoadEntry]:
    """Return the complete load cycles of each proof load of each specimen, over all runs."""
    proof = [r for r in runs if r.facts.kind == "proof" and r.facts.proof_load and _specimen(r)]

    def key(run: RunEvaluation) -> tuple[tuple[str, bool], str]:
        return specimen_of(run), str(run.facts.proof_load)

    found: list[ProofLoadEntry] = []
    for ((specimen, _), load), group in groupby(sorted(proof, key=key), key=key):
        own: list[ProofRunEntry] = [
            {
                "run": run.facts.id,
                "path": run.facts.path,
                "load_cycles": len(run.summary.cycles_used),
                "verdict": run.verdict,
            }
            for run in group
        ]
        cycles = sum(each["load_cycles"] for each in own)
        found.append({"specimen": specimen, "proof_load": load, "load_cycles": cycles, "runs": own})
    return found
