"""Numbers the strokes as they happened, and finds where the record does not show how many there were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.facts import Cycle
from bufferstand.evaluation.gaps.bridging import RecordGap
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Record, waits_show
from bufferstand.foundation.numbers import median

_FEW_SAMPLES = 64
"""Fewer samples than this in all may be too few to tell strokes from noise."""
_FELL = 0.05
"""A record in which the stroke first falls by this share of the first cycle's range begins within one."""
_SHORTER = 0.9
"""A stroke that is not on record may be this much of the shortest one that is: those to one force differ."""

_FOLLOWS = 0.1
"""A logger follows the motion whose steps in all strokes are shorter than this share of those at rest."""
_MIDDLE = 0.25
"""The middle half of a stroke, without this share at either end, says how fast it was."""


@dataclass(frozen=True)
class NumberingDoubt:
    """From cycle ``first`` on numbers are not certain: what was not on record before it may hide a stroke.

    It lasted from ``start_s`` to ``end_s``; ``unknown``: not even how long is known.
    """

    first: int
    why: str
    start_s: float
    end_s: float
    unknown: bool = False


@dataclass(frozen=True)
class Numbering:
    """What is not certain about the numbers of a run's strokes, in order; nothing in most runs.

    ``hidden``: strokes that what is not on record may hide. ``begun``: that the record begins within a
    stroke, so that others may have come before.
    """

    hidden: tuple[NumberingDoubt, ...] = ()
    begun: str = ""

    def uncertain(self, index: int) -> str:
        """Return why the number of a cycle is not certain, or nothing."""
        return self.begun or next((doubt.why for doubt in self.hidden if doubt.first <= index), "")

    def within(self, cycle: Cycle, until_s: float) -> str:
        """Return why a cycle may be several strokes, or none, up to a moment of it; or nothing.

        One with figures is one stroke.
        """
        for doubt in self.hidden:
            inside = doubt.start_s < until_s and doubt.end_s > cycle.start_s
            throughout = doubt.start_s <= cycle.start_s and cycle.end_s <= doubt.end_s
            if inside and (throughout or not cycle.complete):
                return doubt.why
        return ""

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


def numbering_of(record: Record, cycles: Sequence[Cycle], holes: Sequence[RecordGap]) -> Numbering:
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
    hidden = [*_unseen(record), *_hidden(record, cycles, known, holes)]
    ended = [d for d in record.defects if d.kind == "backward-time" and d.start_s == d.end_s]
    if ended:
        why = f"{ended[-1].text}: what they show is not known"
        end_s = float(record.time_s[-1])
        hidden.append(NumberingDoubt(cycles[-1].index + 1, why, ended[-1].start_s, end_s, unknown=True))
    return Numbering(tuple(hidden), _begun(record, cycles))


def _hidden(
    record: Record, cycles: Sequence[Cycle], known: Sequence[Cycle], holes: Sequence[RecordGap]
) -> list[NumberingDoubt]:
    """Return what may hide a stroke, in a record whose ``known`` cycles last for some time."""
    whole = [
        cycle for cycle in known if cycle.bounded and "cut" not in (cycle.start.method, cycle.end.method)
    ]
    wide = [hole for hole in holes if hole.wide]
    moving = [(_moving_s(record, cycle, wide), cycle.range_mm) for cycle in whole or known]
    shortest_s = min(own_s for own_s, _ in moving)
    fastest_mm_per_s = max(2.0 * range_mm / own_s for own_s, range_mm in moving)
    slow = _slow_steps(record, known, holes, _SHORTER * shortest_s)
    hidden = []
    for hole in (*holes, *slow):
        free_s = hole.length_s - hole.change_mm / fastest_mm_per_s
        if free_s < _SHORTER * shortest_s and not hole.unknown:
            continue
        behind = [cycle.index for cycle in cycles if cycle.start_s >= hole.start_s]
        what, after = "step" if hole in slow else "hole", f"after {hole.start_s:.6g} s may hide a stroke"
        fits = f"(the shortest on record takes {shortest_s:.3g} s)"
        why = f"the {what} of {hole.length_s:.4g} s {after} {fits}"
        if hole.unknown:
            why = f"the {what} of unknown length {after}"
        first = behind[0] if behind else cycles[-1].index + 1
        hidden.append(NumberingDoubt(first, why, hole.start_s, hole.end_s, hole.unknown))
    return sorted(hidden, key=lambda doubt: doubt.start_s)


def _moving_s(record: Record, cycle: Cycle, wide: Sequence[RecordGap]) -> float:
    """Return how long a cycle took to move [s]: all of it, or as its middle half says where it has a hole.

    A cycle that is not on record throughout lasts as long as the hole, whatever its motion took.
    """
    inside = [h for h in wide if h.end_s > cycle.start_s and h.start_s < cycle.end_s]
    if not inside:
        return cycle.duration_s
    own = slice(*np.searchsorted(record.time_s, (cycle.start_s, cycle.end_s), side="right").tolist())
    time_s, stroke_mm = record.time_s[own], record.stroke_mm[own]
    if time_s.size < 2:
        return cycle.duration_s
    lost_s = np.array([(h.start_s, h.end_s) for h in inside])
    step_s, step_mm = np.diff(time_s), np.abs(np.diff(stroke_mm))
    low_mm = float(np.min(stroke_mm)) + _MIDDLE * float(np.ptp(stroke_mm))
    high_mm = float(np.max(stroke_mm)) - _MIDDLE * float(np.ptp(stroke_mm))
    middle = (stroke_mm[:-1] > low_mm) & (stroke_mm[:-1] < high_mm)
    middle &= ~((time_s[:-1, None] < lost_s[:, 1]) & (time_s[1:, None] > lost_s[:, 0])).any(axis=1)
    if float(np.sum(step_mm[middle])) < _MIDDLE * float(np.ptp(stroke_mm)):
        return cycle.duration_s
    return min(
        cycle.duration_s, 2.0 * cycle.range_mm * float(np.sum(step_s[middle]) / np.sum(step_mm[middle]))
    )


def _slow_steps(
    record: Record, known: Sequence[Cycle], holes: Sequence[RecordGap], least_s: float
) -> list[RecordGap]:
    """Return the steps of a slow logger, none of them a hole, that are long enough to hide a stroke.

    None of one that writes by event, if it surely does, nor of one whose rate follows the motion: either
    would have written what happened.
    """
    time_s, stroke_mm = record.as_read(record.time_s), record.as_read(record.stroke_mm)
    long = np.flatnonzero(np.diff(time_s) >= least_s)
    if not long.size or (record.by_event and waits_show(time_s)):
        return []
    in_motion_s = max(_longest_step_s(time_s, cycle) for cycle in known)
    if in_motion_s < _FOLLOWS * float(np.min(np.diff(time_s)[long])):
        return []
    told = {hole.start_s for hole in holes}
    return [
        RecordGap(
            float(time_s[i]),
            float(time_s[i + 1]),
            "step",
            abs(float(stroke_mm[i + 1] - stroke_mm[i])),
        )
        for i in long.tolist()
        if float(time_s[i]) not in told
    ]


def _longest_step_s(time_s: FloatArray, cycle: Cycle) -> float:
    """Return the longest step of time within a cycle [s]; all of it where it has no two samples."""
    rows = slice(*np.searchsorted(time_s, (cycle.start_s, cycle.end_s)).tolist())
    return float(np.max(np.diff(time_s[rows]), initial=0.0)) or cycle.duration_s


def _unseen(record: Record) -> tuple[NumberingDoubt, ...]:
    """Return that strokes may be hidden between samples that are few and far apart, or be their noise."""
    if not 2 <= record.time_s.size < _FEW_SAMPLES:
        return ()
    step_s = median(np.diff(record.time_s))
    why = f"the record has {record.time_s.size} samples, {step_s:.3g} s apart: strokes between are not seen"
    return (NumberingDoubt(1, why, float(record.time_s[0]), float(record.time_s[-1])),)


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
