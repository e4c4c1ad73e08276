"""Finds files that hold the same recording, so that it counts once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from bufferstand.evaluation.facts import CopyEntry

SHOWN = 3
"""So many copies are named in the message; the document's ``copies`` names all."""


@dataclass(frozen=True)
class RecordingIdentity:
    """By what a recording is known again.

    Attributes
    ----------
    path, id : str
    sha256, samples_sha256 : str or None
        Hash of the whole content, and of its samples alone (None: it has none, or no file).
    campaign : str or None
    started : datetime or None
    """

    path: str
    id: str
    sha256: str | None = None
    samples_sha256: str | None = None
    campaign: str | None = None
    started: datetime | None = None


@dataclass(frozen=True)
class Copy:
    """A file that holds the recording of another one.

    Attributes
    ----------
    path : str
    of : str
        The file that is counted: the one that was named first.
    same : str
        ``content``: all of it; ``samples``: the samples, and other facts about them.
    """

    path: str
    of: str
    same: Literal["content", "samples"]

    @property
    def text(self) -> str:
        """What it is, in words."""
        if self.same == "content":
            return f"{self.path} is a copy of {self.of}"
        return f"{self.path} holds the samples of {self.of} and states other facts about them"

    def entry(self) -> CopyEntry:
        """Return its entry in the evaluation document."""
        return {"path": self.path, "of": self.of, "same": self.same}


@dataclass(frozen=True)
class Sorted:
    """Recordings told from their copies.

    Attributes
    ----------
    kept : tuple of int
        Places of the recordings that count, in their order.
    copies : tuple of Copy
    warnings : tuple of str
        What is to be said of it: one message about all copies, one for each pair that cannot both be right.
    """

    kept: tuple[int, ...]
    copies: tuple[Copy, ...] = ()
    warnings: tuple[str, ...] = ()

    def counted(self, names: Sequence[str]) -> tuple[str, ...]:
        """Return names of runs, for a copy that of the file which is counted."""
        original = {copy.path: copy.of for copy in self.copies}
        return tuple(original.get(name, name) for name in names)


def each_once(recordings: Sequence[RecordingIdentity]) -> Sorted:
    """Return which recordings count: of files that hold the same one, that which is named first.

    Parameters
    ----------
    recordings : sequence of Recording

    Returns
    -------
    Sorted
        Runs of two campaigns may share an id, so that alone makes no copy.
    """
    by_hash: dict[str, RecordingIdentity] = {}
    by_run: dict[tuple[str, str, datetime], RecordingIdentity] = {}
    kept, copies, differing = [], [], []
    for place, one in enumerate(recordings):
        hashes = [text for text in (one.sha256, one.samples_sha256) if text]
        before = next((by_hash[text] for text in hashes if text in by_hash), None)
        if before is not None:
            copies.append(
                Copy(one.path, before.path, "content" if one.sha256 == before.sha256 else "samples")
            )
            continue
        kept.append(place)
        by_hash |= dict.fromkeys(hashes, one)
        if one.sha256 and one.campaign and one.started is not None:
            first = by_run.setdefault((one.campaign, one.id, one.started), one)
            if first is not one:
                differing.append(_differ(first, one))
    return Sorted(tuple(kept), tuple(copies), (*_told(copies), *differing))


def _told(copies: Sequence[Copy]) -> list[str]:
    if not copies:
        return []
    shown = "; ".join(copy.text for copy in copies[:SHOWN])
    more = f"; and {len(copies) - SHOWN} more files (the JSON’s “copies” names them)"
    once = "it is counted once" if len(copies) == 1 else "each recording is counted once"
    advice = ""
    if any(copy.same == "samples" for copy in copies):
        advice = ", by the facts of the file that was named first; name only the one whose facts are right"
    return [f"{shown}{more if len(copies) > SHOWN else ''}: {once}{advice}"]


def _differ(first: RecordingIdentity, one: RecordingIdentity) -> str:
    return (
        f"{one.path} and {first.path} are both run “{one.id}” of campaign “{one.campaign}”, begun at "
        "the same instant, and their samples differ: one of them is not as it was recorded, yet both are "
        "counted; look at both with “bufferstand verify”, and name only the one that is whole"
    )
