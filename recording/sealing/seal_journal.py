"""Makes a run file from a journal. It may be interrupted at any instant and is then simply done again."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bufferstand.foundation import BadInput
from bufferstand.recording.journal import (
    JOURNAL_SUFFIX,
    STARTING_PATTERN,
    later_segments,
    lock_or_refuse,
    remove_journal,
    segment_path,
)
from bufferstand.recording.runfile import TEMPORARY_SUFFIX, fitting_heads, read_metadata, write_columns
from bufferstand.recording.sealing.journal_outline import Outline, outline, values_of
from bufferstand.recording.sealing.verification import verify

RUN_SUFFIX = ".h5"
DAMAGED_SUFFIX = ".journal-damaged"
_ADDED = ("recorder", "sealed_from", "datasets", "content_sha256")
_ENDING = ("status", "reason", "ended_utc")
"""What sealing adds to the document, and to its ``run``."""


def seal(journal: Path) -> Path:
    """Make the run file of a journal and drop the journal.

    Parameters
    ----------
    journal : Path
        ``<run_id>.journal``; the run file is ``<run_id>.h5`` beside it.

    Returns
    -------
    Path
        The run file. Its status is that of the journal's end record, ``recovered`` if there is none.

    Raises
    ------
    BadInput
        If the journal cannot be read, is in use, holds no header, or another run has its name.
    OSError
        If the run file cannot be written; the journal stays.
    """
    run_file = journal.with_suffix(RUN_SUFFIX)
    try:
        handle = os.open(journal, os.O_RDWR)
    except FileNotFoundError:
        if run_file.exists():
            return run_file
        raise BadInput("no such journal", file=journal, remedy="check the path") from None
    except OSError as error:
        raise BadInput(f"cannot be opened: {error.strerror}", file=journal) from None
    try:
        lock_or_refuse(handle, journal)
        if not journal.exists() and run_file.exists():
            return run_file  # another process sealed it between opening and locking
        return seal_held(journal)
    finally:
        os.close(handle)


def seal_held(journal: Path) -> Path:
    """Seal a journal whose lock the caller holds; otherwise as :func:`seal`.

    Raises
    ------
    BadInput, OSError
        As :func:`seal`.
    """
    content = outline(journal)
    if content.header is None:
        raise BadInput(
            f"the journal has no header ({content.why}): nothing can be recovered from it",
            file=journal,
            remedy="move it out of this folder, and look at the disk it came from",
        )
    if not isinstance(content.header["metadata"].get("run"), dict):
        raise BadInput(
            "the journal's header says nothing of its run",
            file=journal,
            place="metadata.run",
            remedy="move it out of this folder: no software of ours has written it so",
        )
    run_file = journal.with_suffix(RUN_SUFFIX)
    metadata = _document(content)
    sealed_from = _sealed_before(run_file, metadata)
    if sealed_from is None:
        held = {name: tuple(stream.dtypes) for name, stream in content.streams.items()}
        heads = fitting_heads(metadata, held, run_file)
        columns = content.columns(heads)
        write_columns(run_file, metadata, heads, columns, values_of(journal, content))
    whole = sealed_from is not None and sealed_from != metadata["sealed_from"]
    _put_away(journal, keep=content.more_follows and not whole)
    return run_file


def _put_away(journal: Path, *, keep: bool) -> None:
    """Drop a sealed journal, or keep it beside its run if it is damaged: the first segment first.

    Killed in between, what is left is known by its missing first segment (:func:`seal_orphans`).
    """
    damaged = journal.with_suffix(DAMAGED_SUFFIX)
    later = later_segments(journal)
    for number, path in enumerate([journal, *later]):
        if keep:
            path.replace(segment_path(damaged, number))
        else:
            remove_journal(path)


def seal_orphans(directory: Path) -> list[Path]:
    """Seal the journals that a crash left in a folder; those in use are left alone.

    Also removes what interrupted sealing and starting left behind: neither ever was a recording.

    Returns
    -------
    list of Path
        The run files made, in the order of their names.

    Raises
    ------
    BadInput, OSError
        As :func:`seal`, for the first journal that cannot be sealed, after all others were.
    """
    sealed: list[Path] = []
    first_error: BadInput | OSError | None = None
    for journal in sorted(directory.glob(f"*{JOURNAL_SUFFIX}")):
        if is_in_use(journal):
            continue
        try:
            sealed.append(seal(journal))
        except (BadInput, OSError) as error:
            first_error = first_error or error
    for left in [*directory.glob(f"*{TEMPORARY_SUFFIX}"), *directory.glob(STARTING_PATTERN)]:
        if not is_in_use(left) and not is_in_use(_journal_of(left)):
            left.unlink(missing_ok=True)
    for left in directory.glob(f"*{JOURNAL_SUFFIX}.*"):
        journal = _journal_of(left)
        if (
            not journal.exists()
            and journal.with_suffix(RUN_SUFFIX).exists()
            and left in later_segments(journal)
        ):
            left.unlink(missing_ok=True)
    if first_error is not None:
        raise first_error
    return sealed


def is_in_use(path: Path) -> bool:
    """Tell whether a living process records or seals a journal."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        lock_or_refuse(handle, path)
    except BadInput:
        return True
    finally:
        os.close(handle)
    return False


def _journal_of(left: Path) -> Path:
    """Return the first segment of the journal that a left-over file belongs to."""
    stem = left.name.removesuffix(TEMPORARY_SUFFIX)
    if JOURNAL_SUFFIX in stem:
        stem = stem[: stem.rindex(JOURNAL_SUFFIX)]
    return left.with_name(f"{stem}{JOURNAL_SUFFIX}")


def _sealed_before(run_file: Path, metadata: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return what the run file was sealed from, if an earlier attempt got so far; refuse another run.

    After a loss of power a journal may hold less than when it was sealed: what a disk refused to synchronise
    is gone from the file that was given up for the next, and so is what lay behind a cut.
    """
    if not run_file.exists():
        return None
    if any(finding.level == "fault" for finding in verify(run_file)):
        return None
    there = read_metadata(run_file)
    sealed_from = there.get("sealed_from")
    if not isinstance(sealed_from, dict) or not (
        sealed_from == metadata["sealed_from"]
        or (_recorded(there) == _recorded(metadata) and _frames(metadata) <= _frames(there))
    ):
        raise BadInput("another run has this name", file=run_file, remedy="move one of them away")
    return sealed_from


def _recorded(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return what stood in the metadata document before anything was recorded."""
    rest = {key: value for key, value in document.items() if key not in _ADDED}
    return rest | {"run": {key: value for key, value in document["run"].items() if key not in _ENDING}}


def _frames(document: Mapping[str, Any]) -> int:
    return int(document["sealed_from"]["frames"])


def _document(content: Outline) -> dict[str, Any]:
    """Return the metadata document with how the recording ended and what it was sealed from."""
    header = content.header or {}
    document: dict[str, Any] = dict(header["metadata"])
    end = content.end
    ending: dict[str, str | None]
    if end is not None and not content.missing:
        ending = {"status": end.status, "reason": end.reason, "ended_utc": end.ended_utc}
        document["recorder"] = dict(end.figures)
    else:
        reason = f"the recording broke off: {content.why} (no end record)"
        if content.more_follows:
            reason += f"; further records lie behind it, kept in the file *{DAMAGED_SUFFIX}"
        ending = {"status": "recovered", "reason": reason, "ended_utc": content.last_utc}
    document["run"] = {**document["run"], **ending}
    document["sealed_from"] = {
        "frames": content.frames,
        "bytes": content.valid_bytes,
        "crc": content.crc,
        "stop": content.stop.value,
    }
    return document
