"""Finding runs: the key facts of many run files, from their metadata alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from foundation.errors import BadInput
from recording.runfile import read_metadata
from recording.seal import RUN_SUFFIX


@dataclass(frozen=True)
class RunFacts:
    """Key facts of a run file; ``problem`` says why there are none, where the file cannot be read.

    Prestress, amplitude (half the range) and frequency are those planned, None where the step has none.
    """

    path: Path
    id: str = ""
    kind: str = ""
    status: str = ""
    started_utc: str | None = None
    specimen_id: str | None = None
    step: str = ""
    prestress_mm: float | None = None
    amplitude_mm: float | None = None
    frequency_Hz: float | None = None
    sha256: str = ""
    problem: str | None = None


def list_runs(path: Path) -> list[RunFacts]:
    """Return the facts of a run file, or of all in a folder and the folders below it, sorted by path.

    A file that cannot be read is listed with its ``problem``: it must not hide the others. Data are not
    checked here; that is what :func:`recording.verify.verify` is for.

    Raises
    ------
    BadInput
        If the path does not exist or a folder holds no run file at all.
    """
    if path.is_file():
        return [facts_of(path)]
    if not path.is_dir():
        raise BadInput("no such file or folder", file=path, remedy="check the path")
    files = sorted(found for found in path.rglob(f"*{RUN_SUFFIX}") if found.is_file())
    if not files:
        raise BadInput(f"no run file (*{RUN_SUFFIX}) in this folder or below it", file=path)
    return [facts_of(file) for file in files]


def facts_of(path: Path) -> RunFacts:
    """Return the facts of one file; never raises for what is in it."""
    try:
        document = read_metadata(path)
    except BadInput as error:
        return RunFacts(path, problem=error.problem)
    run = _table(document, "run")
    step = _table(document, "step")
    return RunFacts(
        path=path,
        id=str(run.get("id", "")),
        kind=str(run.get("kind", "")),
        status=str(run.get("status", "")),
        started_utc=run.get("started_utc"),
        specimen_id=_table(document, "specimen").get("id"),
        step=str(step.get("name", "")),
        prestress_mm=_number(step.get("prestress_mm")),
        amplitude_mm=_number(step.get("amplitude_mm")),
        frequency_Hz=_number(step.get("frequency_Hz")),
        sha256=str(document["content_sha256"]),
    )


def _table(document: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = document.get(key)
    return value if isinstance(value, Mapping) else {}


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
