"""An index of run files: their key facts without opening them. It is a cache, never the truth.

A file's facts are taken from the index while its size, times and inode are those of when they were read.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bufferstand.foundation.files import readable
from bufferstand.recording.finding.cache_file import (
    STAMP_COLUMNS,
    CacheFile,
    Stamp,
    check_sum,
    default_folder,
    stamp_of,
)
from bufferstand.recording.finding.files import RealPaths
from bufferstand.recording.finding.query import QueryField
from bufferstand.recording.finding.run_facts import RunFileFacts, facts_of, run_files

FILE_NAME = "runs-3.sqlite"
YES_OR_NO = {True: "yes", False: "no"}
"""In which words it is asked whether a run was made on a simulated stand."""
PLANNED = ("prestress_mm", "amplitude_mm", "frequency_Hz")
RECORDED: Mapping[str, QueryField] = {
    "id": QueryField("id", "text"),
    "kind": QueryField("kind", "text"),
    "status": QueryField("status", "text"),
    "specimen": QueryField("specimen", "text"),
    "campaign": QueryField("campaign", "text"),
    "operator": QueryField("operator", "text"),
    "step": QueryField("step", "text"),
    "date": QueryField("started_utc", "date"),
    "started_utc": QueryField("started_utc", "date"),
    "simulated": QueryField("simulated", "text"),
    "path": QueryField("path", "text"),
    "sha256": QueryField("sha256", "text"),
    **{name: QueryField(name, "number") for name in PLANNED},
}
"""What can be asked of a run from its recording alone, by name."""
_SCHEMA = (
    f"CREATE TABLE IF NOT EXISTS runs (path TEXT PRIMARY KEY, {STAMP_COLUMNS}, check_sum INTEGER, facts TEXT)"
    " WITHOUT ROWID;"
)


def indexed_runs(path: Path, folder: Path | None = None) -> list[RunFileFacts]:
    """Return what :func:`bufferstand.recording.finding.run_facts.list_runs` returns, with the help of the
    index.

    Parameters
    ----------
    path : Path
        A run file, or a folder with runs in it and below.
    folder : Path, optional
        Where the index lies; the user's cache folder by default. One that cannot be used is done without.

    Raises
    ------
    BadInput
        As :func:`bufferstand.recording.finding.run_facts.list_runs`.
    """
    files = run_files([path])
    index = CacheFile(folder or default_folder(), FILE_NAME, _SCHEMA)
    try:
        known, real = _known(index), RealPaths()
        found: list[RunFileFacts] = []
        fresh: list[tuple[str, Stamp, RunFileFacts]] = []
        for file in files:
            name, stamp = readable(Path(real.of(file))), stamp_of(file)
            entry = known.get(name)
            facts = None if entry is None or entry[0] != stamp else _facts(file, *entry[1:])
            if facts is not None:
                found.append(facts)
                continue
            facts = facts_of(file)
            found.append(facts)
            if stamp is not None and stamp.settled and facts.problem is None:
                fresh.append((name, stamp, facts))
        _remember(index, fresh)
        return found
    finally:
        index.close()


def recorded_facts(run: RunFileFacts) -> dict[str, Any]:
    """Return what is known of a run from its recording, by the facts of :data:`RECORDED`."""
    return {
        "id": run.id,
        "kind": run.kind,
        "status": run.status,
        "specimen": run.specimen_id,
        "campaign": run.campaign,
        "operator": run.operator,
        "step": run.step or None,
        "simulated": None if run.simulated is None else YES_OR_NO[run.simulated],
        "started_utc": run.started_utc,
        "path": readable(run.path),
        "sha256": run.sha256,
        "prestress_mm": run.prestress_mm,
        "amplitude_mm": run.amplitude_mm,
        "frequency_Hz": run.frequency_Hz,
    }


def _known(index: CacheFile) -> dict[str, tuple[Stamp, int, str]]:
    with index.guarded() as connection:
        if connection is not None:
            rows = connection.execute(
                "SELECT path, size, mtime_ns, ctime_ns, inode, check_sum, facts FROM runs"
            )
            return {row[0]: (Stamp(*row[1:5]), *row[5:]) for row in rows}
    return {}


def _remember(index: CacheFile, fresh: Sequence[tuple[str, Stamp, RunFileFacts]]) -> None:
    texts = [_text(facts) for _, _, facts in fresh]
    rows = [
        (name, *stamp.row(), check_sum(text), text)
        for (name, stamp, _), text in zip(fresh, texts, strict=True)
    ]
    with index.guarded() as connection:
        if connection is not None and rows:
            connection.executemany("INSERT OR REPLACE INTO runs VALUES (?, ?, ?, ?, ?, ?, ?)", rows)


def _text(facts: RunFileFacts) -> str:
    return json.dumps({key: value for key, value in asdict(facts).items() if key != "path"})


def _facts(path: Path, stated: int, text: str) -> RunFileFacts | None:
    if stated != check_sum(text):
        return None
    try:
        return RunFileFacts(path=path, **json.loads(text))
    except (ValueError, TypeError):  # of another version
        return None
