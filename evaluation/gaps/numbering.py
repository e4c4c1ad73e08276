"""Strokes are numbered as they happened; here is where the record does not show how many did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.gaps.bridge import Hole
from evaluation.motion import Cycle
from evaluation.record import Record
from foundation.ranks import median

_FEW_SAMPLES = 64
"""Fewer samples than this in all may be too few to tell strokes from noise."""
_FELL = 0.05
"""A record in which the stroke first falls by this share of the first cycle's range begins within one."""
_SHORTER = 0.9
"""A stroke that is not on record may be this much of the shortest one that is: those to one force differ."""


@dataclass(frozen=True)
class Doubt:
    """From cycle ``first`` on numbers are not certain: what was not on record before it may hide a stroke.

    It began at ``start_s``; ``unknown``: not even how long it lasted is known.
    """

    first: int
    why: str
    start_s: float
    unknown: bool = False


@dataclass(frozen=True)
class Numbering:
    """What is not certain about the numbers of a run's strokes, in order; nothing in most runs.

    ``hidden``: strokes that what is not on record may hide. ``begun``: that the record begins within a
    stroke, so that others may have come before.
    """

    hidden: tuple[Doubt, ...] = ()
    begun: str = ""

    def uncertain(self, index: int) -> str:
        """Return why the number of a cycle is not certain, or nothing."""
        return self.begun or next((doubt.why for doubt in self.hidden if doubt.first <= index), "")

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be said of it."""
        found = [
            f"how many strokes happened is not known: {doubt.why}; cycles from {doubt.first} on may have "
            "higher numbers"
            for doubt in self.hidden
        ]
        if self.begun:
            found.append(f"which stroke cycle 1 was is not known: {self.begun}")
        return tuple(found)


def numbering_of(record: Record, cycles: Sequence[Cycle], holes: Sequence[Hole]) -> Numbering:
    """Return where the numbers of strokes are not certain.

    A hole hides a stroke if one fits into it that takes nine tenths of the shortest on record, after the time
    that the fastest one takes from the stroke before the hole to that behind it.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Found in it.
    holes : sequence of Hole
    """
    known = [cycle for cycle in cycles if cycle.duration_s > 0.0]
    if not known:
        return Numbering(_unseen(record))
    hidden = _hidden(cycles, known, holes) if holes else []
    ended = [d for d in record.defects if d.kind == "backward-time" and d.start_s == d.end_s]
    if ended:
        why = f"{ended[-1].text}: what they show is not known"
        hidden.append(Doubt(cycles[-1].index + 1, why, ended[-1].start_s, unknown=True))
    return Numbering(tuple(hidden), _begun(record, cycles))


def _hidden(cycles: Sequence[Cycle], known: Sequence[Cycle], holes: Sequence[Hole]) -> list[Doubt]:
    """Return the holes that may hide a stroke, of a record whose ``known`` cycles last for some time."""
    whole = [
        cycle for cycle in known if cycle.bounded and "cut" not in (cycle.start.method, cycle.end.method)
    ]
    shortest_s = min(cycle.duration_s for cycle in whole or known)
    fastest_mm_per_s = max(2.0 * cycle.range_mm / cycle.duration_s for cycle in whole or known)
    hidden = []
    for hole in holes:
        free_s = hole.length_s - hole.change_mm / fastest_mm_per_s
        if free_s < _SHORTER * shortest_s and not hole.unknown:
            continue
        behind = [cycle.index for cycle in cycles if cycle.start_s >= hole.start_s]
        length = "of unknown length" if hole.unknown else f"of {hole.length_s:.4g} s"
        fits = "" if hole.unknown else f" (the shortest on record takes {shortest_s:.3g} s)"
        why = f"the hole {length} after {hole.start_s:.6g} s may hide a stroke{fits}"
        first = behind[0] if behind else cycles[-1].index + 1
        hidden.append(Doubt(first, why, hole.start_s, hole.unknown))
    return hidden


def _unseen(record: Record) -> tuple[Doubt, ...]:
    """Return that strokes may be hidden where none is found: between samples that are few and far apart."""
    if not 2 <= record.time_s.size < _FEW_SAMPLES:
        return ()
    step_s = median(np.diff(record.time_s))
    why = f"the record has {record.time_s.size} samples, {step_s:.3g} s apart: strokes between are not seen"
    return (Doubt(1, why, float(record.time_s[0])),)


def _begun(record: Record, cycles: Sequence[Cycle]) -> str:
    """Return that the record begins within a stroke, if it does."""
    first = cycles[0]
    open_mm = first.start.leave_mm - first.end.stroke_mm
    if first.start.method == "cut" or (first.start.method == "edge" and open_mm > _FELL * first.range_mm):
        return "the record begins within it"
    before = record.stroke_mm[: int(np.searchsorted(record.time_s, first.start.time_s))]
    if (
        before.size
        and first.start.method != "edge"
        and float(np.max(before)) - first.start.stroke_mm > _FELL * first.range_mm
    ):
        return "the record begins while the stroke falls, as after another one"
    return ""
