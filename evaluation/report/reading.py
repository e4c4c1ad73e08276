"""From a run file or a campaign folder to the source of a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from evaluation.document import evaluate_file, evaluation_document
from evaluation.load import load_run
from evaluation.record import Record
from evaluation.report.fields import load_fields
from evaluation.report.source import ReportRun, Source
from evaluation.requirements.limit_set import LimitSet
from evaluation.results import Options
from foundation.canonical import file_hash
from foundation.errors import BadInput
from recording.catalogue import run_files
from recording.runfile import Run, open_run

_EARLIEST = datetime.min.replace(tzinfo=UTC)


@dataclass(frozen=True, eq=False)
class Loaded:
    """A run file as read: the run, its samples (None if it holds none), and what is wrong with them."""

    run: Run
    record: Record | None
    problem: str


def load_files(path: Path) -> tuple[list[Loaded], list[str]]:
    """Read the run files of a report, and say which could not be read.

    Returns
    -------
    (list of Loaded, list of str)
        Runs in the order of their start, and findings about the other files of the folder.

    Raises
    ------
    BadInput
        If there are no runs, or none can be read.
    """
    files = run_files([path])
    findings = [
        f"{left.name}: a journal that was never sealed; its run is not in this report"
        for left in sorted(path.rglob("*.journal") if path.is_dir() else ())
    ]
    loaded = []
    for file in files:
        try:
            record, facts = load_run(file)
            run = open_run(file)
        except BadInput as error:
            if len(files) == 1:
                raise
            findings.append(f"{file.name} could not be read and is not in this report: {error.problem}")
            continue
        loaded.append(Loaded(run, record if record.time_s.size else None, "; ".join(facts.problems)))
    if not loaded:
        raise BadInput("none of the run files can be read", file=path, remedy="see “bufferstand verify”")
    return sorted(loaded, key=lambda one: _order(one.run)), findings


def read_source(
    path: Path,
    document: Mapping[str, Any] | None = None,
    options: Options | None = None,
    limit_set: LimitSet | None = None,
) -> Source:
    """Read the runs of a report and join each with its evaluation.

    Parameters
    ----------
    path : Path
        A run file or a campaign folder.
    document : mapping, optional
        The evaluation document of these runs (contracts § 4); without one they are evaluated here.
    options : Options, optional
        How to evaluate where they are evaluated here.
    limit_set : LimitSet, optional
        Limits to judge by then; the shipped set by default.

    Returns
    -------
    Source
        Runs in the order of their start.

    Raises
    ------
    BadInput
        If there are no runs, none can be read, the document lacks one of them or is of another content.
    """
    loaded, findings = load_files(path)
    options = options or Options()
    rule: str | None = options.decision_rule
    if document is None:
        document = evaluation_document([evaluate_file(one.run.path, options, limit_set) for one in loaded])
    else:
        rule = document.get("decision_rule")
    entries = _entries(document)
    runs = tuple(_report_run(number, one, entries) for number, one in enumerate(loaded, start=1))
    name = path.stem if path.is_file() else path.resolve().name
    fields = load_fields(path if path.is_dir() else path.parent)
    return Source(name, runs, document, fields, tuple(findings), rule)


def _order(run: Run) -> tuple[datetime, int, str]:
    try:
        started = datetime.fromisoformat(str(run.metadata["run"].get("started_utc")))
    except ValueError:
        started = _EARLIEST
    if started.tzinfo is None:
        started = started.replace(tzinfo=UTC)
    return started, int(run.metadata["run"].get("step_index") or 0), run.path.name


def _entries(document: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    if not str(document.get("schema", "")).startswith("bufferstand/evaluation/1"):
        raise BadInput(
            "not an evaluation document", place="schema", remedy="make one with “bufferstand evaluate --json”"
        )
    return {str(entry["run"]["id"]): entry for entry in document.get("runs") or []}


def _report_run(number: int, loaded: Loaded, entries: Mapping[str, Mapping[str, Any]]) -> ReportRun:
    run = loaded.run
    evaluated = entries.get(run.id)
    if evaluated is None:
        raise BadInput(
            f"the evaluation document lacks run “{run.id}”",
            file=run.path,
            remedy="evaluate the whole folder again",
        )
    stated = evaluated["run"].get("sha256")
    if stated and stated != run.sha256:
        raise BadInput(
            f"the evaluation document is of another content of run “{run.id}”",
            file=run.path,
            remedy="evaluate the run file again",
        )
    return ReportRun(
        number=number,
        file=run.path.name,
        sha256=file_hash(run.path),
        metadata=run.metadata,
        events=tuple((event.time_s, event.kind, event.text) for event in run.events),
        evaluated=evaluated,
        record=loaded.record,
        problem=loaded.problem,
    )
