"""The loops of force over stroke of cycles, cut exactly at the fitted turning points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from evaluation.branches import DENSE_SAMPLES, Branches, Stretches, closed
from evaluation.motion import Cycle, CycleColumns, EndReading, Loop, TurnColumns
from evaluation.record import FloatArray, Record
from evaluation.reversals import noise_sigma
from evaluation.turns import EndForces, Ends, continuous, end_forces

__all__ = ["DENSE_SAMPLES", "CutLoops", "LoopStack", "cut_loop", "cut_loops"]

_CHUNK_POINTS = 65_536
"""Points of a branch that are worked on together: what is made of them stays in the processor's cache."""
_CHUNK_LOOPS = 800
"""… and at most so many loops: short branches grow by interpolation."""
_LEAST_REST = 4
"""Samples of a rest from which its force is read."""


@dataclass(frozen=True, eq=False)
class LoopStack:
    """Loops of many cycles, a row each: both branches, and what lies between them where the stroke dwells.

    ``turns``: the turning points of the cycles. ``branches``: all loading branches, then all unloading ones.
    ``dwells``: time, stroke and force (3, M) of the samples strictly inside the dwell at the top, by row;
    only rows that dwell, or whose force jumps there (then none). ``ends``: the forces at the lower turning
    point of each cycle, at the end of its loading, and where it is back.
    """

    cycles: Sequence[Cycle]
    turns: CycleColumns
    branches: Branches
    dwells: dict[int, FloatArray]
    ends: tuple[EndForces, EndForces, EndForces]

    @cached_property
    def loading(self) -> Branches:
        """Their loading branches, a row each."""
        return self.branches.rows(slice(0, len(self.cycles)))

    @cached_property
    def unloading(self) -> Branches:
        """Their unloading branches, a row each."""
        return self.branches.rows(slice(len(self.cycles), None))

    @cached_property
    def _areas(self) -> tuple[FloatArray, FloatArray]:
        areas = self.branches.areas()
        return areas[: len(self.cycles)], areas[len(self.cycles) :]

    def loop(self, row: int) -> Loop:
        """Return one loop."""
        loading, unloading = self.loading.row(row), self.unloading.row(row)
        top, unload = loading.shape[1] - 1, loading.shape[1] - 1
        parts = [loading, unloading[:, 1:]]
        if row in self.dwells:
            parts = [loading, self.dwells[row], unloading]
            unload += self.dwells[row].shape[1] + 1
        whole = np.concatenate(parts, axis=1)
        start, end = (EndReading(float(e.gain[row]), float(e.slope_kN_per_mm[row])) for e in self.ends[:2])
        return Loop(whole[0], whole[1], whole[2], top, unload, self.loading.averaged, (start, end))

    def stored_energy_J(self) -> FloatArray:  # noqa: N802 - the unit keeps its capital
        """Return the area up to the largest stroke [J = kN·mm] (EN 15551: W_s), shape (R,).

        That is under the loading branch, and under a dwell during which the stroke creeps further.
        """
        lines = np.arange(len(self.cycles))
        arrives = self.loading.stroke_mm[lines, self.loading.count - 1]
        creeps = self.unloading.stroke_mm[:, 0] > arrives
        return np.asarray(self._areas[0] + np.where(creeps, self._dwelling_J, 0.0))

    def absorbed_energy_J(self) -> FloatArray:  # noqa: N802
        """Return the signed area of each loop [J] (W_a); one that does not close is closed by a chord."""
        whole = self._areas[0] + self._areas[1]
        ends = np.arange(whole.size), self.unloading.count - 1
        opened = self.loading.stroke_mm[:, 0] - self.unloading.stroke_mm[ends]
        whole += 0.5 * (self.unloading.force_kN[ends] + self.loading.force_kN[:, 0]) * opened
        return whole + self._dwelling_J

    @cached_property
    def _dwelling_J(self) -> FloatArray:  # noqa: N802
        """Area under each dwell at the top [J], shape (R,)."""
        area = np.zeros(len(self.cycles))
        for row in np.flatnonzero(self.turns.top.leave_s > self.turns.top.time_s).tolist():
            loop = self.loop(row)
            dwell = slice(loop.top, loop.unload + 1)
            area[row] = np.trapezoid(loop.force_kN[dwell], loop.stroke_mm[dwell])
        return area


def cut_loops(record: Record, cycles: Sequence[Cycle]) -> Iterator[LoopStack]:
    """Cut the loops of cycles with both lower turning points and the upper one as points of them.

    The force at a turning point is read from each branch by itself (:func:`evaluation.turns.end_forces`): the
    loading branch ends with its own. The unloading one begins with the same where the force is continuous,
    else with its own: a jump at one stroke encloses no area. The same holds where a loading branch leaves a
    rest.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Of :func:`evaluation.cycles.find_cycles`, complete.

    Yields
    ------
    LoopStack
        The loops of the next cycles, in order; so many that they are fast to work on.
    """
    if not cycles:
        return
    turns = CycleColumns.of(cycles)
    start, top, end = turns
    up = Stretches.between(record.time_s, start.leave_s, top.time_s)
    down = Stretches.between(record.time_s, top.leave_s, end.time_s)
    sigma_mm = noise_sigma(record.stroke_mm)
    samples = np.maximum(np.maximum(up.last - up.first, down.last - down.first), 1)
    first = 0
    while first < len(cycles):
        # Rows are as long as the longest of them: as many as fit, judged by the running maximum.
        longest = np.maximum.accumulate(samples[first : first + _CHUNK_POINTS])
        fits = np.count_nonzero(longest * np.arange(1, longest.size + 1) <= _CHUNK_POINTS)
        part = slice(first, first + min(max(1, int(fits)), _CHUNK_LOOPS))
        yield _cut(record, cycles[part], turns.rows(part), (up.rows(part), down.rows(part)), sigma_mm)
        first = part.stop


def _cut(
    record: Record,
    cycles: Sequence[Cycle],
    turns: CycleColumns,
    inner: tuple[Stretches, Stretches],
    sigma_mm: float,
) -> LoopStack:
    both, own = inner[0].joined(inner[1]).trimmed(record.time_s), len(cycles)
    start, top, end = turns
    first = np.concatenate((start.leave_mm, top.leave_mm))
    last = np.concatenate((top.stroke_mm, end.stroke_mm))
    smooth = [
        np.concatenate([one.method == "polynomial" for one in both_ends])
        for both_ends in ((start, top), (top, end))
    ]
    starts, ends = (
        end_forces(
            record,
            Ends(at_s, stroke, both.first, both.last, np.full(at_s.size, begins), is_smooth),
            sigma_mm,
        )
        for at_s, stroke, begins, is_smooth in (
            (both.start_s, first, True, smooth[0]),
            (both.end_s, last, False, smooth[1]),
        )
    )
    loading, unloading = slice(0, own), slice(own, None)
    before = _at_rests(record, start, starts.rows(loading), sigma_mm, leaving=True)
    behind = _at_rests(record, end, ends.rows(unloading), sigma_mm, leaving=False)
    begin_kN, end_kN = starts.force_kN.copy(), ends.force_kN.copy()
    passes = inner[0].end_s == inner[1].start_s
    one = passes & continuous(ends.rows(loading), starts.rows(unloading))
    begin_kN[loading] = np.where(continuous(before, starts.rows(loading)), before.force_kN, begin_kN[loading])
    end_kN[unloading] = np.where(continuous(behind, ends.rows(unloading)), behind.force_kN, end_kN[unloading])
    begin_kN[unloading] = np.where(one, ends.force_kN[loading], begin_kN[unloading])
    dwells = dict.fromkeys(np.flatnonzero(~one).tolist(), np.zeros((3, 0)))
    if not passes.all():
        rest = Stretches.between(record.time_s, inner[0].end_s, inner[1].start_s)
        columns = (record.time_s, record.stroke_mm, record.force_kN)
        for row in np.flatnonzero(~passes).tolist():
            inside = slice(int(rest.first[row]), int(rest.last[row]))
            dwells[row] = np.stack([column[inside] for column in columns])
    branches = closed(record, both, (first, begin_kN), (last, end_kN))
    return LoopStack(cycles, turns, branches, dwells, (before, ends.rows(loading), behind))


def _at_rests(
    record: Record, turns: TurnColumns, own: EndForces, sigma_mm: float, *, leaving: bool
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
        inside = Stretches.between(record.time_s, begin_s, end_s).trimmed(record.time_s)
        flat = np.ones(rests.size, dtype=bool)
        at_s, begins = (end_s, ~flat) if leaving else (begin_s, flat)
        there = end_forces(record, Ends(at_s, stroke, inside.first, inside.last, begins, flat), sigma_mm)
        known = inside.last - inside.first >= _LEAST_REST
        found = found.replaced(rests[known], there.force_kN[known], there.gain[known])
    at = 0 if leaving else record.time_s.size - 1
    near_s = 0.5 * abs(float(record.time_s[at] - record.time_s[1 if leaving else -2]))
    rows = np.flatnonzero((turns.method == "edge") & (np.abs(turns.time_s - record.time_s[at]) <= near_s))
    if rows.size:
        found = found.replaced(rows, np.full(rows.size, record.force_kN[at]), np.ones(rows.size))
    return found


def cut_loop(record: Record, cycle: Cycle) -> Loop:
    """Return the loop of one complete cycle (:func:`cut_loops`)."""
    (stack,) = cut_loops(record, [cycle])
    return stack.loop(0)


class CutLoops:
    """The loops of a record's complete cycles for all who need them; where they fit, they are cut once.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Complete.
    """

    def __init__(self, record: Record, cycles: Sequence[Cycle]) -> None:
        self._record = record
        self.cycles = cycles
        self._only: LoopStack | None = None

    def stacks(self) -> Iterator[LoopStack]:
        """Yield the loops of all cycles (:func:`cut_loops`)."""
        if self._only is not None:
            yield self._only
            return
        for stack in cut_loops(self._record, self.cycles):
            if len(stack.cycles) == len(self.cycles):
                self._only = stack
            yield stack

    def branches_of(self, chosen: Sequence[Cycle]) -> list[tuple[FloatArray, FloatArray]]:
        """Return time, stroke and force of both branches of some of the cycles, shape (3, M) each."""
        if self._only is not None:
            row_of = {cycle.index: row for row, cycle in enumerate(self.cycles)}
            own = [(self._only, row_of[cycle.index]) for cycle in chosen]
        else:
            stacks = cut_loops(self._record, chosen)
            own = [(stack, row) for stack in stacks for row in range(len(stack.cycles))]
        return [(stack.loading.row(row), stack.unloading.row(row)) for stack, row in own]
