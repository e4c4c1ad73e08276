"""From a run file or a campaign folder to the source of a report."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from evaluation.record import Record, Temperature, make_record
from evaluation.report.fields import load_fields
from evaluation.report.source import ReportRun, Source
from foundation.canonical import file_hash
from foundation.errors import BadInput
from recording.runfile import Run, open_run

_EARLIEST = datetime.min.replace(tzinfo=UTC)


def run_files(path: Path) -> list[Path]:
    """Return the run files that a path stands for: itself, ``runs/*.h5``, or ``*.h5``.

    Raises
    ------
    BadInput
        If there is none.
    """
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise BadInput(
            "there is no such file or folder", file=path, remedy="name a run file or a campaign folder"
        )
    for folder in (path / "runs", path):
        if found := sorted(folder.glob("*.h5")):
            return found
    raise BadInput(
        "no run files in this folder",
        file=path,
        remedy="name a run file (*.h5), or a folder with run files or with runs/ in it",
    )


def read_source(path: Path, document: Mapping[str, Any]) -> Source:
    """Read the runs of a report and join each with its entry in the evaluation document.

    Parameters
    ----------
    path : Path
        A run file or a campaign folder.
    document : mapping
        The evaluation document of these runs (contracts § 4).

    Returns
    -------
    Source
        Runs in the order of their start.

    Raises
    ------
    BadInput
        If there are no runs, none can be read, the document lacks one of them or is of another content.
    """
    files = run_files(path)
    folder = path if path.is_dir() else path.parent
    opened: list[Run] = []
    findings = [
        f"{left.name}: a journal that was never sealed; its run is not in this report"
        for left in sorted(files[0].parent.glob("*.journal"))
        if path.is_dir()
    ]
    for file in files:
        try:
            opened.append(open_run(file))
        except BadInput as error:
            if path.is_file() or len(files) == 1:
                raise
            findings.append(f"{file.name} could not be read and is not in this report: {error.problem}")
    if not opened:
        raise BadInput("none of the run files can be read", file=path, remedy="see “bufferstand verify”")
    opened.sort(key=_order)
    entries = _entries(document)
    runs = tuple(_report_run(number, run, entries) for number, run in enumerate(opened, start=1))
    name = path.stem if path.is_file() else path.resolve().name
    return Source(name, runs, document, load_fields(folder), tuple(findings))


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


def _report_run(number: int, run: Run, entries: Mapping[str, Mapping[str, Any]]) -> ReportRun:
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
    record, problem = _record(run)
    events = tuple((event.time_s or 0.0, event.kind, event.text) for event in run.events)
    return ReportRun(
        number, run.path.name, file_hash(run.path), run.metadata, events, evaluated, record, problem
    )


def _record(run: Run) -> tuple[Record | None, str]:
    try:
        s, f = run.series("stroke"), run.series("force")
        t = [
            Temperature(n, run.series(n).time_s, run.series(n).value, place=run.streams[n].channels[n].place)
            for n in run.streams
            if n.startswith("temp")
        ]
        return make_record(s.time_s, s.value, f.value, temperatures=t), ""
    except BadInput as error:
        return None, error.message()
