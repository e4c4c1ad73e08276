"""The loops of force over stroke of cycles, cut exactly at the fitted turning points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bufferstand.evaluation.facts import Cycle, CycleColumns, EndReading, Loop
from bufferstand.evaluation.loops.branch_ends import BranchEnds
from bufferstand.evaluation.loops.branches import DENSE_SAMPLES, MOST_POINTS, Branches, Stretches, closed
from bufferstand.evaluation.loops.extreme_forces import ForceExtremes, Inside, force_extremes
from bufferstand.evaluation.loops.forces_at_ends import MOST_ASKED, EndForces, continuous, end_forces
from bufferstand.evaluation.loops.turn_forces import (
    BY_SPEED,
    arrivals,
    arriving,
    at_rests,
    by_speed,
    creeping,
)
from bufferstand.evaluation.numerics import FloatArray, noise_sigma, without_fast_hum
from bufferstand.evaluation.record import Record

__all__ = ["DENSE_SAMPLES", "CutLoops", "LoopStack", "cut_loop", "cut_loops"]

_CHUNK_POINTS = 65_536
"""Points of a branch that are worked on together: what is made of them stays in the processor's cache."""
_CHUNK_LOOPS = 800
"""… and at most so many loops: short branches grow by interpolation."""


@dataclass(frozen=True, eq=False)
class LoopStack:
    """Loops of many cycles, a row each: both branches, and what lies between them where the stroke dwells.

    ``turns``: the turning points of the cycles. ``branches``: all loading branches, then all unloading ones.
    ``dwells``: time, stroke and force (3, M) of the samples strictly inside the dwell at the top, by row;
    only rows that dwell, or whose force jumps there (then none). ``ends``: the forces at the lower turning
    point of each cycle, at the end of its loading, and where it is back. ``extremes``: least and largest
    force of each.
    """

    cycles: Sequence[Cycle]
    turns: CycleColumns
    branches: Branches
    dwells: dict[int, FloatArray]
    ends: tuple[EndForces, EndForces, EndForces]
    extremes: tuple[ForceExtremes, ForceExtremes]

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
        before, end, behind = (
            EndReading(float(e.gain[row]), float(e.slope_kN_per_mm[row]), float(e.doubt_kN[row]))
            for e in self.ends
        )
        least, most = (extreme.reading(row) for extreme in self.extremes)
        return Loop(
            whole[0],
            whole[1],
            whole[2],
            top,
            unload,
            self.loading.averaged,
            (before, end, behind),
            (least, most),
        )

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


def noise_of(record: Record) -> tuple[float, float]:
    """Return the noise of force [kN] and stroke [mm] by which loops are cut."""
    force_kN = record.as_read(record.force_kN)
    return without_fast_hum(force_kN, noise_sigma(force_kN)), record.stroke_noise_mm


def cut_loops(
    record: Record,
    cycles: Sequence[Cycle],
    noise: tuple[float, float] | None = None,
    *,
    alone: bool = False,
) -> Iterator[LoopStack]:
    """Cut the loops of cycles with both lower turning points and the upper one as points of them.

    The force at a turning point is read from each branch by itself
    (:func:`bufferstand.evaluation.loops.forces_at_ends`): the loading branch ends with its own. The unloading
    one begins with the same where the force is continuous, else with its own: a jump at one stroke encloses
    no area. The same holds where a loading branch leaves a rest.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Of :func:`bufferstand.evaluation.cycles.find.find_cycles`, complete.
    noise : tuple of float, optional
        :func:`noise_of` the record, if it is known already.
    alone : bool
        Each as if it was the only one: none takes window, terms or a force from another one.

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
    noise = noise or noise_of(record)
    samples = np.maximum(np.maximum(up.last - up.first, down.last - down.first), 1)
    first = 0
    while first < len(cycles):
        # Rows are as long as the longest of them: as many as fit, judged by the running maximum.
        longest = np.maximum.accumulate(samples[first : first + _CHUNK_POINTS])
        fits = np.count_nonzero(longest * np.arange(1, longest.size + 1) <= _CHUNK_POINTS)
        part = slice(first, first + min(max(1, int(fits)), _CHUNK_LOOPS))
        yield _cut(record, cycles[part], turns.rows(part), (up.rows(part), down.rows(part)), noise, alone)
        first = part.stop


def _cut(
    record: Record,
    cycles: Sequence[Cycle],
    turns: CycleColumns,
    inner: tuple[Stretches, Stretches],
    noise: tuple[float, float],
    alone: bool,
) -> LoopStack:
    most_asked = 2 * len(cycles) if alone else MOST_ASKED
    both, own = inner[0].joined(inner[1]).trimmed(record.time_s), len(cycles)
    start, top, end = turns
    first = np.concatenate((start.leave_mm, top.leave_mm))
    last = np.concatenate((top.stroke_mm, end.stroke_mm))
    smooth = [
        np.concatenate([one.method == "polynomial" for one in both_ends])
        for both_ends in ((start, top), (top, end))
    ]
    reach = both.first, both.last
    begins, arrives = np.ones(2 * own, dtype=bool), np.zeros(2 * own, dtype=bool)
    rows, before_first = arrivals(record, turns, alone=alone)
    starts, ends, arrived = end_forces(
        record,
        (
            (BranchEnds(both.start_s, first, *reach, begins, smooth[0]), most_asked),
            (BranchEnds(both.end_s, last, *reach, arrives, smooth[1]), most_asked),
            (before_first, rows.size if alone else MOST_ASKED),
        ),
        *noise,
    )
    loading, unloading = slice(0, own), slice(own, None)
    begun = rows, before_first, arrived
    before = arriving(turns, starts.rows(loading), ends.rows(unloading), begun, alone=alone)
    before = at_rests(record, start, before, noise, leaving=True, most_asked=most_asked)
    behind = at_rests(record, end, ends.rows(unloading), noise, leaving=False, most_asked=most_asked)
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
    read = before, creeping(record, top, ends.rows(loading), noise[1]), behind
    parts = _inside(record, both, branches, dwells)
    least, most = (
        force_extremes(record.time_s, read, parts, noise[0], sign, most_asked) for sign in (-1.0, 1.0)
    )
    low, high = starts.rows(loading), starts.rows(unloading)
    span_kN = most.force_kN - least.force_kN
    fast = most.force_kN - read[1].force_kN > BY_SPEED * span_kN
    read = by_speed(read[0], low, fast), by_speed(read[1], high, fast & passes), read[2]
    return LoopStack(cycles, turns, branches, dwells, read, (least, most))


def _inside(
    record: Record, both: Stretches, branches: Branches, dwells: dict[int, FloatArray]
) -> list[Inside]:
    """Return the forces between turning points: of branches, as recorded or averaged, and of dwells."""
    size = both.last - both.first
    group = np.maximum(1, -(-size // MOST_POINTS))
    cycle = np.arange(size.size) % (size.size // 2)
    # What is interpolated adds nothing: of these branches the samples themselves.
    sparse = branches.count != -(-size // group) + 2
    parts = []
    for rows in (np.flatnonzero(~sparse), np.flatnonzero(sparse)):
        if not rows.size:
            continue
        count = -(-size[rows] // group[rows])
        width = int(np.max(count))
        if sparse[rows[0]]:
            at = both.first[rows, None] + np.arange(width)
            force = record.force_kN[np.minimum(at, record.force_kN.size - 1)]
        else:
            force = branches.force_kN[rows if sparse.any() else slice(None), 1 : width + 1]
        parts.append(Inside(force, count, group[rows], both.first[rows], cycle[rows]))
    for row, dwell in dwells.items():
        if dwell.shape[1]:
            one = np.ones(1, dtype=np.intp)
            first = np.searchsorted(record.time_s, dwell[0, :1])
            parts.append(Inside(dwell[2:], one * dwell.shape[1], one, first, one * row))
    return parts


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
