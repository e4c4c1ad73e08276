"""Finding runs: the key facts of many run files, from their metadata alone."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bufferstand.foundation import BadInput
from bufferstand.recording.finding.files import RealPaths, files_below, is_there
from bufferstand.recording.journal import JOURNAL_SUFFIX
from bufferstand.recording.runfile import metadata_as_stated, simulated_of
from bufferstand.recording.sealing import DAMAGED_SUFFIX, RUN_SUFFIX


@dataclass(frozen=True)
class RunFileFacts:
    """Key facts of a run file; ``problem`` says why there are none, where the file cannot be read.

    ``simulated`` is None where nothing tells (:mod:`bufferstand.recording.runfile.simulated_origin`).
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
    campaign: str | None = None
    operator: str | None = None
    problem: str | None = None
    simulated: bool | None = None


def run_files(paths: Iterable[Path]) -> list[Path]:
    """Return the run files that paths stand for: the same for every command.

    Parameters
    ----------
    paths : iterable of Path
        Run files, and folders: all run files in them and in the folders below, sorted by path.

    Returns
    -------
    list of Path
        Each file once, in the order in which the paths name it first.

    Raises
    ------
    BadInput
        If a path does not exist, a folder holds no run file, or one below it must not be looked into.
    """
    found: dict[str, Path] = {}
    real = RealPaths()
    for path in paths:
        if not is_there(path):
            raise BadInput("no such file or folder", file=path, remedy="check the path")
        if path.is_dir():
            files = files_below(path, RUN_SUFFIX)
            if not files:
                raise BadInput(
                    f"no run files (*{RUN_SUFFIX}) in this folder or below it",
                    file=path,
                    remedy="name a run file, or a folder with runs; “bufferstand import” makes runs of "
                    "foreign records",
                )
        else:
            files = [path]
        for file in files:
            found.setdefault(real.of(file), file)
    return list(found.values())


def unsealed(paths: Iterable[Path]) -> list[Path]:
    """Return the first files of journals that paths stand for: of runs not sealed, and of damaged ones.

    Parameters
    ----------
    paths : iterable of Path
        Journals, and folders: all in them and in the folders below, sorted by path. Run files count for none.

    Raises
    ------
    BadInput
        If a folder must not be looked into.
    """
    found: list[Path] = []
    for path in paths:
        suffixes = (JOURNAL_SUFFIX, DAMAGED_SUFFIX)
        found += files_below(path, *suffixes) if path.is_dir() else [path] if path.suffix in suffixes else []
    return list(dict.fromkeys(found))


def list_runs(path: Path) -> list[RunFileFacts]:
    """Return the facts of a run file, or of all in a folder and the folders below it, sorted by path.

    A file that cannot be read is listed with its ``problem``: it must not hide the others. Data are not
    checked here; that is what :func:`bufferstand.recording.sealing.verification.verify` is for.

    Raises
    ------
    BadInput
        If the path does not exist or a folder holds no run file at all.
    """
    return [facts_of(file) for file in run_files([path])]


def facts_of(path: Path) -> RunFileFacts:
    """Return the facts of one file; never raises for what is in it."""
    try:
        document = metadata_as_stated(path)
    except (BadInput, OSError) as error:
        return RunFileFacts(path, problem=_why_unreadable(path, error))
    run = _table(document, "run")
    step = _table(document, "step")
    return RunFileFacts(
        path=path,
        id=str(run.get("id", "")),
        kind=str(run.get("kind", "")),
        status=str(run.get("status", "")),
        started_utc=_utc(run.get("started_utc")),
        specimen_id=_text(_table(document, "specimen").get("id")),
        step=str(step.get("name", "")),
        prestress_mm=_number(step.get("prestress_mm")),
        amplitude_mm=_number(step.get("amplitude_mm")),
        frequency_Hz=_number(step.get("frequency_Hz")),
        sha256=str(document["content_sha256"]),
        campaign=_text(run.get("campaign")),
        operator=_text(run.get("operator")),
        simulated=simulated_of(document),
    )


def _why_unreadable(path: Path, error: BadInput | OSError) -> str:
    """Return what is wrong with a file; HDF5 takes one that must not be read for none of its own."""
    if path.is_file() and not os.access(path, os.R_OK, effective_ids=True):
        return "cannot be read: permission denied"
    return error.problem if isinstance(error, BadInput) else f"cannot be read: {error.strerror or error}"


def _table(document: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = document.get(key)
    return value if isinstance(value, Mapping) else {}


def _utc(value: Any) -> str | None:
    """Return a date and time in UTC: imports of before 2026-11-22 may state another zone."""
    text = value if isinstance(value, str) and value else None
    try:
        moment = datetime.fromisoformat(text or "")
        return moment.astimezone(UTC).isoformat() if moment.utcoffset() else text
    except (ValueError, OverflowError):  # no date; one before the first or after the last year there is
        return text


def _text(value: Any) -> str | None:
    """Return what is stated as text; a foreign writer may have written a number for a name."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return str(value)
    return value if isinstance(value, str) and value else None


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
