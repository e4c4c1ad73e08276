"""What a check of a report finds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes
    ----------
    level : str
        ``holds``: it is as it says. ``note``: it could not be looked at, or is worth knowing. ``fault``: it
        is not as it says, and the report must not be relied upon.
    place : str
        What was looked at: the signature, a file inside, a run file.
    text : str
    """

    level: Literal["holds", "note", "fault"]
    place: str
    text: str


def holds(place: str, text: str) -> Finding:
    """Return that something is as it says."""
    return Finding("holds", place, text)


def note(place: str, text: str) -> Finding:
    """Return what is worth knowing, and no fault."""
    return Finding("note", place, text)


def fault(place: str, text: str) -> Finding:
    """Return what is not as it says."""
    return Finding("fault", place, text)
