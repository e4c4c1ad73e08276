"""The operator's notes of a campaign: ``notes.jsonl`` in its folder, one line a note, only ever added to."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import append_line, json_lines, typed

NOTES_NAME = "notes.jsonl"
LONGEST = 2000
"""Characters of a note."""


@dataclass(frozen=True)
class Note:
    """What the operator wrote, when, and during which step (0 and empty before and after the steps)."""

    utc: str
    text: str
    step: int = 0
    run: str = ""


def clean_note(text: str) -> str:
    """Return a note in one line.

    Raises
    ------
    BadInput
        If nothing is left of it, or it is longer than ``LONGEST``.
    """
    line = " ".join(text.split())
    if not line:
        raise BadInput("the note is empty", file="note", remedy="write what you saw, in quotes")
    if len(line) > LONGEST:
        raise BadInput(f"the note has {len(line)} characters", file="note", remedy=f"at most {LONGEST}")
    return line


def signed_note(text: str, by: str) -> str:
    """Return a note in one line, with who wrote it before it, if that is known.

    Raises
    ------
    BadInput
        If nothing is left of the note, or it is longer than ``LONGEST``.
    """
    line = clean_note(text)
    return f"{by}: {line}"[:LONGEST] if by else line


def add_note(folder: Path, text: str, *, step: int = 0, run: str = "") -> Note:
    """Add a note to a campaign's folder and bring it to the disk.

    Raises
    ------
    BadInput
        If it is no note (:func:`clean_note`).
    OSError
        If the disk does not take it.
    """
    note = Note(datetime.now(UTC).isoformat(timespec="seconds"), clean_note(text), step, run)
    append_line(folder / NOTES_NAME, json.dumps(asdict(note), ensure_ascii=False))
    return note


def read_notes(folder: Path) -> tuple[Note, ...]:
    """Return the notes of a campaign's folder in their order; a line that is cut off is left out.

    Raises
    ------
    BadInput
        If the file cannot be read, or a whole line is no note: with its line.
    """
    path = folder / NOTES_NAME
    return tuple(
        typed(Note, content, path, place=f"line {number}", remedy="mend the line, or take it out")
        for number, content in json_lines(path)
    )
