"""Passes of a run, each loading and unloading as force over stroke, and how one compares with the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.facts import Cycle
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view.view import RunView

_NEAR = 24
"""So many passes nearest in time are compared with."""
_MOST = 20_000
"""A pass of more samples is thinned."""
_FEWEST = 8
_ALIKE = 0.05
"""Passes that are compared reach equally far within this share of their range."""
_ZONE = 3.0
_FEWEST_ZONE = 3
_TURN = 0.15
"""Within this share of its range from the turn at which it begins, a pass depends on the way since then."""


class HalfCycle(NamedTuple):
    """One way of a cycle, ``way`` +1 loading or -1 unloading, from and to the middle of its dwells [s]."""

    cycle: int
    way: int
    start_s: float
    end_s: float


class Pass(NamedTuple):
    """One way of a cycle: ``stroke_mm`` never falls, ``force_kN`` is the force there; (M,) both."""

    way: int
    stroke_mm: FloatArray
    force_kN: FloatArray


def ways_of(cycles: Sequence[Cycle]) -> list[HalfCycle]:
    """Return every way of every cycle, in order of time; what rests between two ways is halved."""
    ways = []
    for cycle in cycles:
        start_s, top_s, end_s = (
            0.5 * (turn.time_s + turn.leave_s) for turn in (cycle.start, cycle.top, cycle.end)
        )
        ways += [HalfCycle(cycle.index, 1, start_s, top_s), HalfCycle(cycle.index, -1, top_s, end_s)]
    return ways


def pass_of(look: RunView, way: HalfCycle) -> Pass:
    """Return one way of a cycle as it was recorded."""
    rows = look.stroke.rows(way.start_s, way.end_s)
    every = max(1, (rows.stop - rows.start) // _MOST)
    time_s, stroke_mm = look.stroke.time_s[rows][::every], look.stroke.value[rows][::every]
    order = slice(None, None, way.way)
    return Pass(way.way, np.maximum.accumulate(stroke_mm[order]), look.force.at(time_s)[order])


def others_of(look: RunView, ways: Sequence[HalfCycle], way: HalfCycle, own: Pass) -> list[Pass]:
    """Return the passes in the same direction that reach as far as one does, the nearest in time first."""
    if own.stroke_mm.size < _FEWEST:
        return []
    same = [one for one in ways if one.way == way.way and one != way]
    near = sorted(same, key=lambda one: abs(one.start_s - way.start_s))[:_NEAR]
    near_mm = _ALIKE * float(own.stroke_mm[-1] - own.stroke_mm[0])
    return [
        other
        for other in (pass_of(look, one) for one in near)
        if other.stroke_mm.size >= _FEWEST
        and abs(other.stroke_mm[0] - own.stroke_mm[0]) < near_mm
        and abs(other.stroke_mm[-1] - own.stroke_mm[-1]) < near_mm
    ]


def beyond_others(
    own: Pass, others: Sequence[Pass], edges_mm: tuple[float, float], aside_mm: float
) -> FloatArray:
    """Return by how much the force changes across a stretch of stroke beyond what it does in each other pass.

    The force of the pass less that of another one is taken over a stretch on either side, and what it changes
    by from the lower to the upper one is returned [kN]. Where the force steps because the specimen is met or
    the motion turns, it does so in the others too, and nothing is left; softening leaves little.

    Parameters
    ----------
    own : Pass
    others : sequence of Pass
        Those that do not cover the stretch, or whose force stands still beside it to the last digit, do not
        count.
    edges_mm : (float, float)
        Stroke at the lower and the upper edge of what is crossed.
    aside_mm : float
        What is nearer to an edge does not count.
    """
    low_mm, high_mm = edges_mm[0] - aside_mm, edges_mm[1] + aside_mm
    width_mm = (_ZONE - 1.0) * aside_mm
    stroke = own.stroke_mm
    below, above = (int(row) for row in np.searchsorted(stroke, (low_mm, high_mm)))
    first, last = (int(row) for row in np.searchsorted(stroke, (low_mm - width_mm, high_mm + width_mm)))
    zones = (
        slice(max(0, min(first, below - _FEWEST_ZONE)), below),
        slice(above, max(last, above + _FEWEST_ZONE)),
    )
    if any(stroke[zone].size < _FEWEST_ZONE for zone in zones):
        return np.zeros(0)
    found = []
    for one in others:
        moved_mm = _aligned_mm(own, one, edges_mm)
        reach = one.stroke_mm[0] + moved_mm - aside_mm, one.stroke_mm[-1] + moved_mm + aside_mm
        if stroke[zones[0].start] < reach[0] or stroke[zones[1]][-1] > reach[1]:
            continue
        there = [np.interp(stroke[zone] - moved_mm, one.stroke_mm, one.force_kN) for zone in zones]
        if not all(np.ptp(force_kN) for force_kN in there):
            continue
        apart = [
            np.median(own.force_kN[zone] - force_kN) for zone, force_kN in zip(zones, there, strict=True)
        ]
        found.append(float(apart[1] - apart[0]))
    return np.array(found)


def _aligned_mm(own: Pass, other: Pass, edges_mm: tuple[float, float]) -> float:
    """Return by how much another pass is moved: near the turn where it begins, its turn onto this one's."""
    at = -1 if own.way < 0 else 0
    near_mm = _TURN * float(own.stroke_mm[-1] - own.stroke_mm[0])
    away_mm = min(abs(float(own.stroke_mm[at]) - edge) for edge in edges_mm)
    return float(own.stroke_mm[at] - other.stroke_mm[at]) if away_mm < near_mm else 0.0
