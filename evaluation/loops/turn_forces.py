"""The forces at the turning points of cycles: from the branch that arrives, or from the rest there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bufferstand.evaluation.cycles import EASED_S, LONGEST_S
from bufferstand.evaluation.facts import CycleColumns, TurnColumns
from bufferstand.evaluation.loops.branch_ends import BranchEnds
from bufferstand.evaluation.loops.branches import Stretches
from bufferstand.evaluation.loops.forces_at_ends import MOST_ASKED, EndForces, continuous, end_forces
from bufferstand.evaluation.numerics import BoolArray, IndexArray
from bufferstand.evaluation.record import Record

BY_SPEED = 0.2
"""Where the largest force is so much of the loop's height above that at the upper turn, speed makes it."""
_LEAST_REST = 4
"""Samples of a rest from which its force is read."""
_LEAST_ARRIVING = 5
_ARRIVES = 0.4
"""The branch that arrives at a cycle's begin is as steady as the cycle itself for so much of its length."""
_CREEP = 0.3
"""Of what a stroke creeps in a rest: standard uncertainty of the place where arriving ends."""
_AN_EIGHTH = 0.125
"""The level of a rest is read this share of it, or less, behind its begin
(:mod:`bufferstand.evaluation.cycles.dwells`)."""
_EASED = 0.05
"""A stand eases out of a rest over so much of it, at most."""


def arrivals(record: Record, turns: CycleColumns, *, alone: bool = False) -> tuple[IndexArray, BranchEnds]:
    """Return the lower turning points at which a branch arrives that no cycle read (:func:`arriving`).

    Returns
    -------
    (array of int, Ends)
        Rows of the cycles that begin there, and the ends of these branches.
    """
    start, top, end = turns
    passes, follows = _passed(turns, alone=alone)
    rows = np.flatnonzero(passes & ~follows)
    at_s, stroke = start.time_s[rows], start.stroke_mm[rows]
    shorter_s = np.minimum(top.time_s - start.leave_s, end.time_s - top.leave_s)[rows]
    inside = Stretches.between(record.time_s, at_s - _ARRIVES * shorter_s, at_s).trimmed(record.time_s)
    smooth = start.method[rows] == "polynomial"
    return rows, BranchEnds(at_s, stroke, inside.first, inside.last, np.zeros(rows.size, dtype=bool), smooth)


def arriving(
    turns: CycleColumns,
    own: EndForces,
    ends: EndForces,
    first: tuple[IndexArray, BranchEnds, EndForces],
    *,
    alone: bool = False,
) -> EndForces:
    """Return the forces at lower turning points that are no rests, read from the branch that arrives there.

    Behind a turn the force of a specimen with friction rises several times as fast as before it: what it
    begins with shows better in the samples before, unless it jumps there.

    Parameters
    ----------
    turns : CycleColumns
    own, ends : EndForces
        As the loading branches read them, and as the unloading ones read where they end.
    first : (array of int, Ends, EndForces)
        :func:`arrivals`, and the forces there.
    alone : bool
        Each cycle by itself: none is read from the one before.
    """
    rows = np.flatnonzero(_passed(turns, alone=alone)[1])
    found = _continued(own, ends.rows(rows - 1), rows)
    rows, inside, there = first
    known = inside.last - inside.first >= _LEAST_ARRIVING
    return _continued(found, there.rows(known), rows[known]) if rows.size else found


def _passed(turns: CycleColumns, *, alone: bool) -> tuple[BoolArray, BoolArray]:
    """Say which cycles begin at a turn that is no rest, and which of these where the one before ends."""
    start, _, end = turns
    passes = start.leave_s == start.time_s
    return passes, np.append(False, start.time_s[1:] == end.time_s[:-1]) & passes & (not alone)


def _continued(own: EndForces, there: EndForces, rows: IndexArray) -> EndForces:
    """Return forces, some rows as they are read ``there``, where they are continuous with that."""
    good = continuous(there, own.rows(rows))
    return own.replaced(rows[good], there.rows(good))


def at_rests(
    record: Record,
    turns: TurnColumns,
    own: EndForces,
    noise: tuple[float, float],
    *,
    leaving: bool,
    most_asked: int = MOST_ASKED,
) -> EndForces:
    """Return the forces at turning points, at a rest that of the rest as the stroke leaves or arrives.

    Force is one before and behind that moment: a preload that it takes up within some hundredths of a
    millimetre belongs to the branch. A record that begins or ends with the motion has one sample of the rest.
    """
    rests = np.flatnonzero(turns.leave_s > turns.time_s)
    found = own
    if rests.size:
        begin_s, end_s = turns.time_s[rests], turns.leave_s[rests]
        stroke = (turns.leave_mm if leaving else turns.stroke_mm)[rests]
        eased_s = np.minimum(_EASED * (end_s - begin_s), LONGEST_S) if leaving else 0.0
        inside = Stretches.between(record.time_s, begin_s, end_s - eased_s).trimmed(record.time_s)
        begins = np.full(rests.size, not leaving)
        ends = BranchEnds(end_s if leaving else begin_s, stroke, inside.first, inside.last, begins, ~begins)
        (there,) = end_forces(record, [(ends, most_asked)], *noise, at_rest=True)
        known = inside.last - inside.first >= _LEAST_REST
        found = found.replaced(rests[known], there.rows(known))
    at = 0 if leaving else record.time_s.size - 1
    near_s = 0.5 * abs(float(record.time_s[at] - record.time_s[1 if leaving else -2]))
    rows = np.flatnonzero((turns.method == "edge") & (np.abs(turns.time_s - record.time_s[at]) <= near_s))
    if rows.size:
        found = found.replaced(rows, found.rows(rows).at_sample(float(record.force_kN[at])))
    return found


def creeping(record: Record, top: TurnColumns, own: EndForces, sigma_mm: float) -> EndForces:
    """Return the forces at upper turning points, with what creep leaves open: where arriving ends.

    A stroke that creeps while it rests goes on from its arrival without a corner that noise would leave. Its
    level is read behind the moment of arriving, lest a stand's easing count, and it has crept until there: as
    far as that the branch does not reach, and its force is none that the specimen ever had.
    """
    crept_mm = np.abs(top.leave_mm - top.stroke_mm)
    before_mm, u_mm = np.zeros((2, crept_mm.size))
    for row in np.flatnonzero(crept_mm > 0.0).tolist():
        at_s = top.time_s[row]
        eased_s = min(EASED_S, _AN_EIGHTH * (top.leave_s[row] - at_s))
        first, last = np.searchsorted(record.time_s, (at_s, at_s + eased_s)).tolist()
        if last - first >= _LEAST_ARRIVING:
            away_s = record.time_s[first:last] - at_s
            there_mm = float(np.polyfit(away_s, record.stroke_mm[first:last], 1)[1])
            before_mm[row] = np.clip(top.stroke_mm[row] - there_mm, 0.0, crept_mm[row])
            u_mm[row] = 2.0 * sigma_mm / np.sqrt(last - first)  # of a line at its end
    doubt = np.hypot(_CREEP * crept_mm, u_mm) * own.slope_kN_per_mm
    force_kN = own.force_kN - before_mm * own.slope_kN_per_mm
    return replace(own, force_kN=force_kN, doubt_kN=np.hypot(own.doubt_kN, doubt))


def by_speed(arrives: EndForces, leaves: EndForces, fast: BoolArray) -> EndForces:
    """Return forces at turns with half of what the branch that leaves reads otherwise as their doubt.

    Where the force hangs on the speed more than on the stroke it goes straight through the turn, and either
    branch knows it as well.
    """
    apart = np.where(fast, 0.5 * np.abs(arrives.force_kN - leaves.force_kN), 0.0)
    return replace(arrives, doubt_kN=np.hypot(arrives.doubt_kN, apart))
