"""The loops of force over stroke of cycles, cut exactly at the fitted turning points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from evaluation.branches import DENSE_SAMPLES, END_SHARE, Branches, Stretches, closed
from evaluation.motion import Cycle, Loop
from evaluation.record import FloatArray, Record

__all__ = ["DENSE_SAMPLES", "END_SHARE", "CutLoops", "LoopStack", "cut_loop", "cut_loops"]

_CHUNK_POINTS = 65_536
"""Points of a branch that are worked on together: what is made of them stays in the processor's cache."""
_CHUNK_LOOPS = 800
"""… and at most so many loops: short branches grow by interpolation."""


@dataclass(frozen=True, eq=False)
class LoopStack:
    """Loops of many cycles, a row each: both branches, and what lies between them where the stroke dwells.

    ``branches``: all loading branches, then all unloading ones. ``dwells``: time, stroke and force (3, M) of
    the samples strictly inside the dwell at the top, by row; only rows that dwell.
    """

    cycles: Sequence[Cycle]
    branches: Branches
    dwells: dict[int, FloatArray]

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
        top, averaged = loading.shape[1] - 1, self.loading.averaged
        if row in self.dwells:
            dwell = self.dwells[row]
            whole = np.concatenate((loading, dwell, unloading), axis=1)
            return Loop(whole[0], whole[1], whole[2], top, top + dwell.shape[1] + 1, averaged)
        whole = np.concatenate((loading, unloading[:, 1:]), axis=1)
        return Loop(whole[0], whole[1], whole[2], top, top, averaged)

    def stored_energy_J(self) -> FloatArray:  # noqa: N802 - the unit keeps its capital
        """Return the area under each loading branch [J = kN·mm] (EN 15551: W_s), shape (R,)."""
        return self._areas[0]

    def absorbed_energy_J(self) -> FloatArray:  # noqa: N802
        """Return the signed area of each loop [J] (W_a); one that does not close is closed by a chord."""
        whole = self._areas[0] + self._areas[1]
        ends = np.arange(whole.size), self.unloading.count - 1
        opened = self.loading.stroke_mm[:, 0] - self.unloading.stroke_mm[ends]
        whole += 0.5 * (self.unloading.force_kN[ends] + self.loading.force_kN[:, 0]) * opened
        for row in self.dwells:
            loop = self.loop(row)
            dwell = slice(loop.top, loop.unload + 1)
            whole[row] += np.trapezoid(loop.force_kN[dwell], loop.stroke_mm[dwell])
        return whole


def cut_loops(record: Record, cycles: Sequence[Cycle]) -> Iterator[LoopStack]:
    """Cut the loops of cycles with both lower turning points and the upper one as points of them.

    The force at a turning point is extrapolated from both branches over their last 2 % (at least four
    samples) and, where stroke passes through without dwell, is the mean of the two.

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
    moments = np.array([(c.start_s, c.top.time_s, c.top.leave_s, c.end_s) for c in cycles]).T
    strokes = np.array(
        [(c.stroke_min_mm, c.stroke_max_mm, c.top.leave_mm, c.stroke_end_mm) for c in cycles]
    ).T
    up = Stretches.between(record.time_s, moments[0], moments[1])
    down = Stretches.between(record.time_s, moments[2], moments[3])
    samples = np.maximum(np.maximum(up.last - up.first, down.last - down.first), 1)
    first = 0
    while first < len(cycles):
        # Rows are as long as the longest of them: as many as fit, judged by the running maximum.
        longest = np.maximum.accumulate(samples[first : first + _CHUNK_POINTS])
        fits = np.count_nonzero(longest * np.arange(1, longest.size + 1) <= _CHUNK_POINTS)
        part = slice(first, first + min(max(1, int(fits)), _CHUNK_LOOPS))
        yield _cut(record, cycles[part], (up.rows(part), down.rows(part)), strokes[:, part])
        first = part.stop


def _cut(
    record: Record, cycles: Sequence[Cycle], inner: tuple[Stretches, Stretches], strokes: FloatArray
) -> LoopStack:
    both, own = inner[0].joined(inner[1]), len(cycles)
    starts, ends = both.end_forces(record)
    passes = inner[0].end_s == inner[1].start_s
    mean = 0.5 * (ends[:own] + starts[own:])
    ends[:own], starts[own:] = np.where(passes, mean, ends[:own]), np.where(passes, mean, starts[own:])
    dwells = {}
    if not passes.all():
        rest = Stretches.between(record.time_s, inner[0].end_s, inner[1].start_s)
        columns = (record.time_s, record.stroke_mm, record.force_kN)
        for row in np.flatnonzero(~passes).tolist():
            inside = slice(int(rest.first[row]), int(rest.last[row]))
            dwells[row] = np.stack([column[inside] for column in columns])
    first, last = np.concatenate(strokes[::2]), np.concatenate(strokes[1::2])
    return LoopStack(cycles, closed(record, both, (first, starts), (last, ends)), dwells)


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
