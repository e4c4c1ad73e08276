"""The evaluation document (docs/evaluation-document.md), key by key. No NaN; what is missing is null."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np

from bufferstand.evaluation.across_runs import (
    RecordingIdentity,
    before_after_entries,
    each_once,
    find_trends,
    mixture,
    points_of,
    proof_load_entries,
)
from bufferstand.evaluation.across_runs.conformity import Purpose, candidate_of, decide_purposes
from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.document.evidence import comparison_entries, evidence_entry, plain
from bufferstand.evaluation.facts import (
    CycleEntry,
    CycleResult,
    EvaluationDocument,
    Expanded,
    Extreme,
    ExtremeEntry,
    HistoryEntry,
    Options,
    RequirementEntry,
    RequirementResult,
    RunEntry,
    RunEvaluation,
    RunFacts,
    RunHistory,
    RunIdentityEntry,
    StepEntry,
    StepResult,
    Summary,
    SummaryEntry,
    TogetherEntry,
    Trend,
    TrendEntry,
    budget_entry,
)
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.requirements import LimitSet
from bufferstand.recording.finding import run_files

SCHEMA: Final = "bufferstand/evaluation/1"
_PATHS = [quantity.path for quantity in QUANTITIES]
_NO_SAMPLES = Record(np.zeros(0), np.zeros(0), np.zeros(0))
LIGHT = RunEvaluation(RunFacts("", "harmonic"), _NO_SAMPLES, (), Summary((), {}), (), None, ())
"""A result that has only what trends and comparisons are made from; fill in facts, summary, mean loop."""


def evaluate_paths(
    paths: Sequence[Path],
    options: Options | None = None,
    limit_set: LimitSet | None = None,
    conformity: Sequence[str] = (),
) -> EvaluationDocument:
    """Evaluate run files, campaign folders or archives, and return the evaluation document.

    Parameters
    ----------
    paths : sequence of Path
        Run files (``.h5``), or folders that are searched for them.
    options : Options, optional
        How to evaluate: decision rule, draws, moving mass, inspectors' files.
    limit_set : LimitSet, optional
        Limits to judge by; the shipped set by default.
    conformity : sequence of str
        Runs that are the conformity test of their specimen, by id or path.

    Raises
    ------
    BadInput
        If a path does not exist, holds no run file, or a run file cannot be evaluated, or ``conformity``
        names none of them.
    """
    options = options or Options()
    document = assemble([evaluate_entry(path, options, limit_set) for path in run_files(paths)], conformity)
    document["decision_rule"] = options.decision_rule
    return document


def evaluate_entry(
    path: Path, options: Options | None = None, limit_set: LimitSet | None = None
) -> tuple[RunEntry, RunEvaluation]:
    """Evaluate one run file into its entry of the document, and a result without samples for the trends.

    Small enough to be kept for ten thousand runs, or to be sent from another process.

    Raises
    ------
    BadInput
        If it cannot be read or evaluated.
    """
    run = evaluate_file(path, options, limit_set)
    return run_entry(run), replace(run, record=_NO_SAMPLES, cycles=())


def assemble(
    parts: Iterable[tuple[RunEntry, RunEvaluation]], conformity: Sequence[str] = ()
) -> EvaluationDocument:
    """Return the evaluation document of entries made by :func:`evaluate_entry`, in their order, each once.

    Raises
    ------
    BadInput
        If ``conformity`` names a run that is none of them, or can be no conformity test.
    """
    parts = list(parts)
    told = each_once([_recording(run) for _, run in parts])
    parts = [parts[place] for place in told.kept]
    decided = decide_purposes([candidate_of(run) for _, run in parts], told.counted(conformity))
    together = what_runs_say_together([run for _, run in parts])
    return {
        "schema": SCHEMA,
        "software": {"version": version("bufferstand")},
        "runs": [
            _with_purpose(entry, purpose) for (entry, _), purpose in zip(parts, decided.purposes, strict=True)
        ],
        "trends": together["trends"],
        "temperature_comparisons": together["temperature_comparisons"],
        "before_after": together["before_after"],
        "proof_load_totals": together["proof_load_totals"],
        "warnings": [*told.warnings, *together["warnings"]],
        "copies": [copy.entry() for copy in told.copies],
        "conformity": [statement.entry() for statement in decided.statements],
    }


def _with_purpose(entry: RunEntry, purpose: Purpose) -> RunEntry:
    entry = entry.copy()
    entry["purpose"], entry["purpose_why"] = purpose.purpose, purpose.why
    return entry


def _recording(run: RunEvaluation) -> RecordingIdentity:
    facts = run.facts
    return RecordingIdentity(
        facts.path, facts.id, facts.sha256, facts.samples_sha256, facts.campaign, facts.started
    )


def what_runs_say_together(runs: Sequence[RunEvaluation]) -> TogetherEntry:
    """Return what runs say together: trends, comparisons, totals, and ``warnings`` of them as a set.

    Simulated and real runs are never points of one trend, nor compared with each other.

    Each step of a run is a point; one whose means are of spoiled cycles is none (the run's warnings say so).
    """
    points = [point for run in runs for point in points_of(run) if not point.unfit]
    return {
        "trends": [_trend(trend) for trend in find_trends(points)],
        "temperature_comparisons": comparison_entries(points),
        "before_after": before_after_entries(points),
        "proof_load_totals": proof_load_entries(runs),
        "warnings": list(mixture(runs)),
    }


def evaluate_file(
    path: Path, options: Options | None = None, limit_set: LimitSet | None = None
) -> RunEvaluation:
    """Evaluate one run file.

    Raises
    ------
    BadInput
        If it cannot be read or evaluated.
    """
    # What evaluates takes a second to import, and an archive in which nothing changed does without.
    from bufferstand.evaluation.loading import load_run  # noqa: PLC0415
    from bufferstand.evaluation.run import evaluate_run  # noqa: PLC0415

    record, facts = load_run(path)
    return evaluate_run(record, facts, options, limit_set)


def evaluation_document(runs: Sequence[RunEvaluation]) -> EvaluationDocument:
    """Return the evaluation document of runs that were evaluated."""
    return assemble([(run_entry(run), run) for run in runs])


def run_entry(run: RunEvaluation) -> RunEntry:
    """Return the entry of one run."""
    history, evidence = _history(run.history), evidence_entry(run)
    return {
        "run": _identity(run.facts),
        "cycles": [_cycle(result) for result in run.cycles],
        "summary": None if run.steps else _summary(run.summary),
        "steps": [_step(step) for step in run.steps],
        "extremes": _extremes(run.extremes),
        "holds": history["holds"],
        "residual_strokes": history["residual_strokes"],
        "settling": history["settling"],
        "cumulated_energy_J": history["cumulated_energy_J"],
        "requirements": [_requirement(row) for row in run.requirements],
        "verdict": run.verdict,
        "warnings": list(run.warnings),
        "notes": list(run.notes),
        "plausibility": [finding.entry() for finding in run.findings],
        "limit_set": None if run.limit_set is None else dict(run.limit_set),
        "inspection": None if run.inspection is None else dict(run.inspection),
        "half_width_95": None if run.steps else _half_widths(run.summary),
        "missing": None if run.steps else _missing(run.summary),
        "budget": budget_entry(run.budget),
        "shared_errors": None if run.shared_errors is None else run.shared_errors.entry(),
        "skew_sensitivity": evidence["skew_sensitivity"],
        "draw_wires": evidence["draw_wires"],
        "inertia_correction": evidence["inertia_correction"],
        "impact": evidence["impact"],
        "first_contact": evidence["first_contact"],
    }


def _identity(facts: RunFacts) -> RunIdentityEntry:
    entry: RunIdentityEntry = {
        "path": facts.path,
        "id": facts.id,
        "sha256": facts.sha256,
        "kind": facts.kind,
        "specimen": dict(facts.specimen),
        "purpose": facts.purpose,
        "simulated": facts.simulated,
    }
    if facts.zero is not None:
        entry["zero"] = dict(facts.zero)
    return entry


def _summary(summary: Summary) -> SummaryEntry:
    return {
        "cycles_used": list(summary.cycles_used),
        **{
            name: {
                "value": measured.value,
                "expanded_uncertainty": measured.expanded_uncertainty,
                "coverage_factor": measured.coverage_factor,
            }
            for name, measured in summary.values.items()
        },
    }


def _half_widths(summary: Summary) -> dict[str, float | None]:
    return {name: measured.half_width_95 for name, measured in summary.values.items()}


def _missing(summary: Summary) -> dict[str, str]:
    return {name: measured.missing for name, measured in summary.values.items() if measured.missing}


def _step(step: StepResult) -> StepEntry:
    return {
        "index": step.index,
        "start_s": step.start_s,
        "end_s": step.end_s,
        "cycles": list(step.cycles),
        "summary": _summary(step.summary),
        "extremes": _extremes(step.extremes),
        "half_width_95": _half_widths(step.summary),
        "missing": _missing(step.summary),
        "budget": budget_entry(step.budget),
        "skew_sensitivity": plain(step.skew_sensitivity),
        "shared_errors": None if step.shared_errors is None else step.shared_errors.entry(),
    }


def _cycle(result: CycleResult) -> CycleEntry:
    cycle = result.cycle
    entry: CycleEntry = {
        "index": cycle.index,
        "start_s": cycle.start_s,
        "end_s": cycle.end_s,
        "complete": cycle.complete,
        "steady": cycle.steady,
    }
    for (*groups, key), value in zip(_PATHS, result.quantities, strict=True):
        (entry.setdefault(groups[0], {}) if groups else entry)[key] = value
    return entry | {
        "expanded_uncertainty": dict(result.expanded_uncertainty),
        "why": list(cycle.why),
        "missing": dict(result.missing),
    }


def _history(history: RunHistory | None) -> HistoryEntry:
    known = history or RunHistory()
    return {
        "holds": [plain(hold) for hold in known.holds],
        "residual_strokes": [plain(stroke) for stroke in known.residual_strokes],
        "settling": [plain(one) for one in known.settling],
        "cumulated_energy_J": plain(known.cumulated),
    }


def _extremes(extremes: Mapping[str, Extreme]) -> dict[str, ExtremeEntry]:
    return {name: _extreme(extreme) for name, extreme in extremes.items()}


def _extreme(extreme: Extreme) -> ExtremeEntry:
    return {
        "value": extreme.value,
        "expanded_uncertainty": extreme.expanded_uncertainty,
        "coverage_factor": extreme.coverage_factor,
        "half_width_95": extreme.half_width_95,
        "time_s": extreme.time_s,
        "channel": extreme.channel,
        "cycle": extreme.cycle,
        "doubt": extreme.doubt,
    }


def _requirement(row: RequirementResult) -> RequirementEntry:
    return {
        "standard": row.standard,
        "edition": row.edition,
        "clause": row.clause,
        "source": row.source,
        "id": row.id,
        "cycle": row.cycle,
        "condition": row.condition,
        "requirement": row.requirement,
        "stroke_mm": row.stroke_mm,
        "measured": row.measured,
        "expanded_uncertainty": row.expanded_uncertainty,
        "lower_limit": row.lower_limit,
        "upper_limit": row.upper_limit,
        "unit": row.unit,
        "conformance_probability": row.conformance_probability,
        "verdict": row.verdict,
        "why": row.why,
    }


def _trend(trend: Trend) -> TrendEntry:
    return {
        "quantity": trend.quantity,
        "prestress_mm": trend.prestress_mm,
        "amplitude_mm": trend.amplitude_mm,
        "runs": list(trend.runs),
        "frequency_Hz": list(trend.frequency_Hz),
        "values": list(trend.values),
        "expanded_uncertainty": list(trend.expanded_uncertainty),
        "temperature_C": list(trend.temperature_C),
        "slope_per_Hz": trend.slope_per_Hz,
        "intercept": trend.intercept,
        "slope_standard_uncertainty_per_Hz": trend.slope_u_per_Hz,
        "intercept_standard_uncertainty": trend.intercept_u,
        "slope_half_width_95_per_Hz": trend.slope_half_width_95_per_Hz,
        "intercept_half_width_95": trend.intercept_half_width_95,
        "slope_expanded_uncertainty_per_Hz": _expanded(trend.slope_expanded),
        "slope_coverage_factor": _coverage(trend.slope_expanded),
        "intercept_expanded_uncertainty": _expanded(trend.intercept_expanded),
        "intercept_coverage_factor": _coverage(trend.intercept_expanded),
        "confidence_band": list(trend.band),
        "line_expanded_uncertainty": list(trend.band_expanded),
        "scatter_standard_uncertainty": trend.scatter_u,
        "shared_errors": trend.shared,
        "warnings": list(trend.warnings),
    }


def _expanded(expanded: Expanded | None) -> float | None:
    return None if expanded is None else expanded.uncertainty


def _coverage(expanded: Expanded | None) -> float | None:
    return None if expanded is None else expanded.coverage_factor
