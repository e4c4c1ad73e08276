"""Is a run file whole and unaltered, and what does it lack?"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bufferstand.foundation import BadInput
from bufferstand.recording.content import main_stream
from bufferstand.recording.runfile import (
    ENTRY,
    ContentFault,
    StreamData,
    content_faults,
    file_is_as_sealed,
    is_record_only,
    open_run,
)
from bufferstand.recording.sealing.journal_outline import outline

__all__ = ["ContentFault", "recording_notes", "verify", "verify_journal"]

_ROWS_AT_ONCE = 1_000_000


def verify(path: Path) -> list[ContentFault]:
    """Check a run file completely; no findings means that it is whole, unaltered and without gaps.

    What is evaluated passed the same checks of its content (:func:`bufferstand.recording.runfile.open_run`).

    Raises
    ------
    BadInput
        If there is no such file, it is no run file at all, or one of a newer format.
    """
    whole = file_is_as_sealed(path)
    try:
        if whole:
            return content_faults(path) or recording_notes(path)
        altered = "its bytes are not those that were sealed: damaged, altered or repacked"
        return [*content_faults(path), ContentFault("fault", "file", altered)]
    except BadInput as error:
        if "newer" in error.problem or "not a run file" in error.problem:
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
    stream = main_stream(found.streams)
    rows = found.streams[stream].rows if stream in found.streams else 0
    seals = "bufferstand record --seal" if is_record_only(found.header["metadata"]) else "bufferstand resume"
    text = f"not sealed yet, holds {rows} sample(s) of the {stream}; “{seals}” seals it"
    return [*findings, ContentFault("note", "journal", text)]


def recording_notes(path: Path) -> list[ContentFault]:
    """Return what the recording lacks: its status if not complete, gaps, time stamps that step back.

    Raises
    ------
    BadInput
        If it is no readable run file.
    """
    run = open_run(path)
    notes = []
    if run.status not in ("complete", "imported"):
        reason = f": {run.reason}" if run.reason else ""
        notes.append(ContentFault("note", "run", f"{run.status}{reason}"))
    notes += [
        ContentFault("note", "original", str(finding))
        for finding in (run.metadata.get("original") or {}).get("findings", [])
    ]
    for name in run.metadata["streams"]:
        if name not in run.streams:
            notes.append(ContentFault("note", f"{ENTRY}/{name}", "not one sample was recorded"))
            continue
        if gaps := run.gaps(name):
            lost = sum(count for _, count in gaps)
            text = f"{len(gaps)} gap(s), {lost} sample(s) lost; the first after row {gaps[0][0]}"
            notes.append(ContentFault("note", f"{ENTRY}/{name}", text))
        notes += _time_notes(run.streams[name])
    return notes


def _time_notes(stream: StreamData) -> list[ContentFault]:
    if stream.time_name != "time_us":
        return []  # of an imported record: among the findings of the import
    count, first, last = 0, 0, None
    for row in range(0, stream.rows, _ROWS_AT_ONCE):
        block = stream.stamps(slice(row, row + _ROWS_AT_ONCE))
        stamps = block if last is None else np.concatenate([last, block])
        stuck = np.flatnonzero(np.diff(stamps) <= 0)
        if len(stuck) and not count:
            first = row + int(stuck[0]) - (last is not None)
        count += len(stuck)
        last = block[-1:]
    if not count:
        return []
    place = f"{ENTRY}/{stream.name}/{stream.time_name}"
    return [ContentFault("note", place, f"{count} time stamp(s) do not advance, the first after row {first}")]
