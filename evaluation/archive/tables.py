"""Both tables of an archive, and its document, written so that ten thousand runs fit."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.across_runs.conformity import Purpose
from bufferstand.evaluation.archive.evaluate import ArchiveEvaluation
from bufferstand.evaluation.archive.stored_run import StoredRun
from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.document import (
    OfRun,
    check_table_name,
    cycle_frame,
    write_cycle_csv,
    write_cycles,
    write_frames,
)
from bufferstand.evaluation.facts import EXTREME_NAMES

if TYPE_CHECKING:  # takes a third of a second, and a table of cycles in CSV does without
    import pandas as pd

PRETTY_RUNS = 20
"""A document of more runs is written a line a run."""


def cycles_frame(evaluation: ArchiveEvaluation) -> pd.DataFrame:
    """Return the table with a row a cycle (columns.

    :func:`bufferstand.evaluation.document.tables.cycle_table`).
    """
    return cycle_frame(*_cycles(evaluation))


def _cycles(evaluation: ArchiveEvaluation) -> tuple[OfRun, list[NDArray[np.float64]]]:
    return _of_run(evaluation), [run.cycle_numbers for run in evaluation.runs]


def _of_run(evaluation: ArchiveEvaluation) -> OfRun:
    runs = evaluation.runs
    return {
        "run": [run.facts["id"] for run in runs],
        "path": [run.path for run in runs],
        "kind": [run.facts["kind"] for run in runs],
        "specimen": [run.facts["specimen"].get("id") for run in runs],
        "sha256": [run.facts["sha256"] for run in runs],
        "settings_sha256": [evaluation.settings_entry["sha256"]] * len(runs),
        "version": [evaluation.software.text] * len(runs),
    }


def runs_frame(evaluation: ArchiveEvaluation) -> pd.DataFrame:
    """Return the table with a row a run, and one a file that is not counted: it could not be
    evaluated, or holds the recording of another one (``problem``).

    The row of a run with several steps has no means; a row for each of its steps follows, with the means of
    that step. ``part`` is the number of the step there, and empty in the rows of runs; what belongs to the
    run as a whole (verdict, warnings, requirements) stands in the row of the run alone.

    Columns: ``run``, ``path``, ``kind``, ``specimen``, ``started``, ``status``, ``verdict``, ``purpose``,
    ``cycles``, ``cycles_used``, the means by their names in the summary, ``U(…)`` of each, ``warnings``, the
    number of requirements of each verdict, ``limit_set``, ``problem``, ``sha256``, ``settings_sha256``,
    ``version``, ``part``, and the extremes of all samples (``extreme_force_max_kN`` …) with ``U(…)`` and
    ``time_s(…)`` of each.
    """
    import pandas as pd  # noqa: PLC0415

    both = zip(evaluation.runs, evaluation.decided.purposes, strict=True)
    rows: list[dict[str, Any]] = [
        row for run, purpose in both for row in (_run_row(run, purpose), *_step_rows(run))
    ]
    rows += [{"path": failure.path, "problem": failure.problem} for failure in evaluation.failures]
    rows += [{"path": copy.path, "problem": f"{copy.text}: counted once"} for copy in evaluation.copies]
    trace = {"settings_sha256": evaluation.settings_entry["sha256"], "version": evaluation.software.text}
    table = pd.DataFrame([row | trace for row in rows], columns=list(RUN_COLUMNS))
    numbers = [*QUANTITIES.names, *(f"U({name})" for name in QUANTITIES.names), *_EXTREME_COLUMNS]
    counts = ["part", "cycles", "cycles_used", "warnings", *_VERDICT_COLUMNS.values()]
    return table.astype(dict.fromkeys(numbers, "float64") | dict.fromkeys(counts, "Int64"))


_VERDICT_COLUMNS = {
    verdict: f"requirements_{verdict.replace('-', '_')}"
    for verdict in (
        "pass", "conditional-pass", "conditional-fail", "fail", "inconclusive", "not-tested", "invalid"
    )
}  # fmt: skip
_EXTREME_COLUMNS = tuple(
    column.format(f"extreme_{name}") for name in EXTREME_NAMES for column in ("{}", "U({})", "time_s({})")
)
RUN_COLUMNS = (
    *("run", "path", "kind", "specimen", "started", "status", "verdict", "purpose", "cycles", "cycles_used"),
    *QUANTITIES.names,
    *(f"U({name})" for name in QUANTITIES.names),
    "warnings",
    *_VERDICT_COLUMNS.values(),
    *("limit_set", "problem", "sha256", "settings_sha256", "version", "part"),
    *_EXTREME_COLUMNS,
)


def _identity(run: StoredRun) -> dict[str, Any]:
    facts = run.facts
    return {
        "run": facts["id"],
        "path": run.path,
        "kind": facts["kind"],
        "specimen": facts["specimen"].get("id"),
        "started": facts["started"],
        "status": facts["status"],
        "sha256": facts["sha256"],
    }


def _means(part: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "cycles_used": len(part["cycles_used"]),
        **{name: mean[0] for name, mean in part["means"].items()},
        **{f"U({name})": mean[1] for name, mean in part["means"].items()},
        **dict(zip(_EXTREME_COLUMNS, _extreme_numbers(part["extremes"]), strict=True)),
    }


def _step_rows(run: StoredRun) -> list[dict[str, Any]]:
    return [
        {**_identity(run), "part": step["index"], "cycles": len(step["cycles"]), **_means(step)}
        for step in run.facts["steps"]
    ]


def _run_row(run: StoredRun, purpose: Purpose) -> dict[str, Any]:
    facts = run.facts
    judged = facts["requirements"]
    return {
        **_identity(run),
        "verdict": facts["verdict"],
        "purpose": purpose.purpose,
        "cycles": facts["cycles"],
        **_means(facts),
        "warnings": facts["warnings"],
        **{column: judged.get(verdict, 0) for verdict, column in _VERDICT_COLUMNS.items()},
        "limit_set": None if facts["limit_set"] is None else facts["limit_set"]["id"],
    }


def _extreme_numbers(extremes: Mapping[str, Any]) -> Iterator[float | None]:
    for name in EXTREME_NAMES:
        yield from extremes.get(name, (None, None, None))[:3]


def write_tables(evaluation: ArchiveEvaluation, cycles: Path | None, runs: Path | None) -> None:
    """Write the table of cycles, of runs, or both; an Excel file for the cycles has both as sheets.

    Raises
    ------
    BadInput
        As :func:`bufferstand.evaluation.document.tables.write_table`.
    """
    for path in (cycles, runs):
        if path is not None:
            check_table_name(path)
    frame = None
    if runs is not None or (cycles is not None and cycles.suffix.lower() == ".xlsx"):
        frame = runs_frame(evaluation)
    if cycles is not None and cycles.suffix.lower() == ".csv":
        write_cycle_csv(_of_run(evaluation), (run.rows for run in evaluation.runs), cycles)
    elif cycles is not None:
        write_cycles(*_cycles(evaluation), cycles, None if frame is None else {"runs": frame})
    if frame is not None and runs is not None and runs != cycles:
        write_frames({"runs": frame}, runs)


def document(evaluation: ArchiveEvaluation) -> dict[str, Any]:
    """Return the evaluation document (docs/evaluation-document.md); all of it is in memory then."""
    entries = [json.loads(text) for text in _entry_texts(evaluation)]
    return {**evaluation.head(), "runs": entries, **evaluation.tail}


def _entry_texts(evaluation: ArchiveEvaluation) -> Iterator[str]:
    for run, purpose in zip(evaluation.runs, evaluation.decided.purposes, strict=True):
        yield run.entry_text(purpose)


def write_document(evaluation: ArchiveEvaluation, stream: TextIO) -> None:
    """Write the evaluation document as JSON, run by run; of many runs each on a line of its own."""
    if len(evaluation.runs) <= PRETTY_RUNS:
        stream.write(json.dumps(document(evaluation), indent=2, ensure_ascii=False, allow_nan=False) + "\n")
        return
    stream.writelines(_lines(evaluation))


def _lines(evaluation: ArchiveEvaluation) -> Iterator[str]:
    yield "{\n"
    for key, value in evaluation.head().items():
        yield f"{_pair(key, value)},\n"
    yield '"runs": [\n'
    yield from _separated(_entry_texts(evaluation))
    yield "]"
    for key, value in evaluation.tail.items():
        yield f",\n{_pair(key, value)}"
    yield "\n}\n"


def _separated(texts: Iterable[str]) -> Iterator[str]:
    for position, text in enumerate(texts):
        yield f",\n{text}" if position else text
    yield "\n"


def _pair(key: str, value: Mapping[str, Any] | Any) -> str:
    return f"{json.dumps(key)}: {json.dumps(value, ensure_ascii=False, allow_nan=False)}"
