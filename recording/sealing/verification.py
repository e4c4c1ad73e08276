"""Is a run file whole and unaltered, and what does it lack?"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.foundation import BadInput
from bufferstand.recording.content import MAIN_STREAM, Segment, gaps_of
from bufferstand.recording.runfile import (
    ENTRY,
    ContentFault,
    column_blocks,
    content_faults,
    content_faults_apart,
    file_is_as_sealed,
    open_tree,
    read_column,
    read_document,
)
from bufferstand.recording.sealing.journal_outline import outline

__all__ = ["ContentFault", "recording_notes", "verify", "verify_journal"]


def verify(path: Path) -> list[ContentFault]:
    """Check a run file completely; no findings means that it is whole, unaltered and without gaps.

    Raises
    ------
    BadInput
        If there is no such file, it is no run file at all, or one of a newer format.
    """
    whole = file_is_as_sealed(path)
    try:
        if not whole:
            altered = "its bytes are not those that were sealed: damaged, altered or repacked"
            return [*content_faults_apart(path), ContentFault("fault", "file", altered)]
        return content_faults(path) or recording_notes(path)
    except BadInput as error:
        if whole or "newer" in error.problem or "not a run file" in error.problem:
            raise
        return [ContentFault("fault", error.place or "file", error.problem)]


def verify_journal(journal: Path) -> list[ContentFault]:
    """Check the journal of a run that is not sealed: what of it can be recovered, and what cannot.

    Raises
    ------
    BadInput
        If it cannot be read, is of a newer format, or holds a segment of another run.
    """
    found = outline(journal)
    if found.header is None:
        return [ContentFault("fault", "header", f"nothing can be recovered: {found.why}")]
    findings = []
    if found.more_follows or found.missing:
        text = f"records are damaged: {found.why}; what lies before them can be recovered"
        findings.append(ContentFault("fault", "records", text))
    elif found.end is None:
        findings.append(ContentFault("note", "records", f"the recording broke off: {found.why}"))
    rows = found.streams[MAIN_STREAM].rows if MAIN_STREAM in found.streams else 0
    text = f"not sealed yet, holds {rows} sample(s) of the controller; “bufferstand resume” seals it"
    return [*findings, ContentFault("note", "journal", text)]


def recording_notes(path: Path) -> list[ContentFault]:
    """Return what the recording lacks: its status if not complete, gaps, time stamps that step back.

    Raises
    ------
    BadInput
        If it is no readable run file.
    """
    with open_tree(path) as tree:
        document = read_document(tree, path)
        run = document["run"]
        notes = []
        if run["status"] not in ("complete", "imported"):
            reason = f": {run['reason']}" if run.get("reason") else ""
            notes.append(ContentFault("note", "run", f"{run['status']}{reason}"))
        notes += [
            ContentFault("note", "original", str(finding))
            for finding in (document.get("original") or {}).get("findings", [])
        ]
        for name in document["streams"]:
            place = f"{ENTRY}/{name}/segments"
            if place not in document["datasets"]:
                notes.append(ContentFault("note", f"{ENTRY}/{name}", "not one sample was recorded"))
                continue
            rows = read_column(tree, path, place, document["datasets"][place])
            gaps = gaps_of([Segment(*(int(v) for v in row)) for row in rows])
            if gaps:
                lost = sum(count for _, count in gaps)
                text = f"{len(gaps)} gap(s), {lost} sample(s) lost; the first after row {gaps[0][0]}"
                notes.append(ContentFault("note", f"{ENTRY}/{name}", text))
            notes += _time_notes(tree, path, name, document["datasets"])
    return notes


def _time_notes(tree: Any, path: Path, name: str, datasets: Mapping[str, Any]) -> list[ContentFault]:
    place = f"{ENTRY}/{name}/time_us"
    if place not in datasets:
        return []  # of an imported record: among the findings of the import
    count, first, row, last = 0, 0, 0, None
    for block in column_blocks(tree, path, place, datasets[place]):
        stamps = block if last is None else np.concatenate([last, block])
        stuck = np.flatnonzero(np.diff(stamps) <= 0)
        if len(stuck) and not count:
            first = row + int(stuck[0]) - (last is not None)
        count += len(stuck)
        row, last = row + len(block), block[-1:]
    if not count:
        return []
    return [ContentFault("note", place, f"{count} time stamp(s) do not advance, the first after row {first}")]
