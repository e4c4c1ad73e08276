"""The loops of force over stroke of cycles, cut exactly at the fitted turning points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.branches import DENSE_SAMPLES, END_SHARE, Branches, Stretches, closed
from evaluation.motion import Cycle, Loop
from evaluation.record import FloatArray, Record

__all__ = ["DENSE_SAMPLES", "END_SHARE", "LoopStack", "cut_loop", "cut_loops"]

_CHUNK_POINTS = 65_536
"""Points of a branch that are worked on together: what is made of them stays in the processor's cache."""
_CHUNK_LOOPS = 800
"""… and at most so many loops: short branches grow by interpolation."""


@dataclass(frozen=True, eq=False)
class LoopStack:
    """Loops of many cycles, a row each: both branches, and what lies between them where the stroke dwells.

    ``dwells``: time, stroke and force (3, M) of the samples strictly inside the dwell at the top, by row;
    only rows that dwell.
    """

    cycles: Sequence[Cycle]
    loading: Branches
    unloading: Branches
    dwells: dict[int, FloatArray]

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
        return self.loading.areas()

    def absorbed_energy_J(self) -> FloatArray:  # noqa: N802
        """Return the signed area of each loop [J] (W_a); one that does not close is closed by a chord."""
        whole = self.loading.areas() + self.unloading.areas()
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
    up, down = inner
    top_up, top_down = up.end_forces(record, last=True), down.end_forces(record, last=False)
    passes = up.end_s == down.start_s
    mean = 0.5 * (top_up + top_down)
    top_up, top_down = np.where(passes, mean, top_up), np.where(passes, mean, top_down)
    begin, end = up.end_forces(record, last=False), down.end_forces(record, last=True)
    dwells = {}
    if not passes.all():
        rest = Stretches.between(record.time_s, up.end_s, down.start_s)
        columns = (record.time_s, record.stroke_mm, record.force_kN)
        for row in np.flatnonzero(~passes).tolist():
            inside = slice(int(rest.first[row]), int(rest.last[row]))
            dwells[row] = np.stack([column[inside] for column in columns])
    return LoopStack(
        cycles,
        closed(record, up, (strokes[0], begin), (strokes[1], top_up)),
        closed(record, down, (strokes[2], top_down), (strokes[3], end)),
        dwells,
    )


def cut_loop(record: Record, cycle: Cycle) -> Loop:
    """Return the loop of one complete cycle (:func:`cut_loops`)."""
    (stack,) = cut_loops(record, [cycle])
    return stack.loop(0)
