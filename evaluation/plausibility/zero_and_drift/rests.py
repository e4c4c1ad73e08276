"""Rests of a static run: what the force channel shows at its lower turns, where the specimen is released."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.plausibility.run_view import RunView, Samples
from bufferstand.foundation.numbers import median

_FEWEST = 5
"""A rest of fewer samples shows no level."""
ALIKE_MM = 0.3
"""Rests whose strokes agree within this are at one place."""

_HOLE = 1.0 / 3.0
"""A step between samples of this share of a rest and more parts it: what was before and after it stands for
itself, as a whole stroke may have been lost there."""
STILL, _NOISES = 0.003, 8.0
"""A stroke rests before the first and behind the last turn while it stays within this share of its range,
and so many standard deviations of its noise."""
_FROZEN = 0.3
"""Where noise exceeds the resolution twice, at most every seventh reading is the same as the one before: a
rest in which this share of them is holds the end of a frozen stretch."""


class UnloadedRest(NamedTuple):
    """A rest, its first third left out (a specimen relaxes in it), in two halves.

    ``times_s`` are their middles, ``levels_kN`` their medians, ``u_kN`` the standard deviation of a median.
    """

    stroke_mm: float
    times_s: tuple[float, float]
    levels_kN: tuple[float, float]
    u_kN: float


def rests_of(look: RunView, jumps: Sequence[Finding] = (), *, turned: bool = False) -> list[UnloadedRest]:
    """Return the rests at the lowest place at which the stroke rests, in order of time.

    Parameters
    ----------
    look : Look
    jumps : sequence of Finding
        Jumps of the stroke: a place behind one is taken for what it was before.
    turned : bool
        Whether the stroke has the wrong sign: its upper turns are the lower ones.
    """
    turns = {
        turn.time_s: turn
        for cycle in (result.cycle for result in look.results)
        for turn in ((cycle.top,) if turned else (cycle.start, cycle.end))
    }
    force, found = look.force, []
    spans_s = [(turn.time_s, turn.leave_s) for turn in sorted(turns.values(), key=lambda turn: turn.time_s)]
    for rows in _whole(force, _with_ends(look.stroke, spans_s)):
        count = rows.stop - rows.start
        if count < _FEWEST or _is_frozen(force, rows):
            continue
        third = max(1, count // 3)
        parts = slice(rows.start + third, rows.start + 2 * third), slice(rows.stop - third, rows.stop)
        times_s, levels_kN = (
            tuple(median(column[part]) for part in parts) for column in (force.time_s, force.value)
        )
        at_mm = median(look.stroke.at(force.time_s[rows]))
        at_mm -= sum((jump.size or 0.0) for jump in jumps if jump.start_s < times_s[0]) / len(look.strokes)
        at_mm = -at_mm if turned else at_mm
        u_kN = 1.25 * force.sampling.sigma / float(np.sqrt(third))
        found.append(UnloadedRest(at_mm, (times_s[0], times_s[1]), (levels_kN[0], levels_kN[1]), u_kN))
    lowest_mm = min((rest.stroke_mm for rest in found), default=0.0)
    return [rest for rest in found if rest.stroke_mm - lowest_mm <= ALIKE_MM]


def _whole(force: Samples, spans_s: Sequence[tuple[float, float]]) -> Iterator[slice]:
    """Return the rows of rests, those that a hole parts in two."""
    for start_s, end_s in spans_s:
        rows = force.rows(start_s, end_s)
        steps_s = np.diff(force.time_s[rows])
        if steps_s.size and float(np.max(steps_s)) > _HOLE * (end_s - start_s):
            cut = rows.start + int(np.argmax(steps_s)) + 1
            yield from (slice(rows.start, cut), slice(cut, rows.stop))
        else:
            yield rows


def _with_ends(stroke: Samples, spans_s: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return rests with those at both ends of a record that lie before the first and behind the last of them.

    Cycles of a stroke whose sign is wrong begin and end under load.
    """
    if not spans_s:
        return spans_s
    time_s, value = stroke.time_s, stroke.value
    before, after = int(np.searchsorted(time_s, spans_s[0][0])), int(np.searchsorted(time_s, spans_s[-1][1]))
    still = max(STILL * stroke.span, _NOISES * stroke.sigma)
    found = [*spans_s]
    if before > _FEWEST:
        left = np.flatnonzero(np.abs(value[:before] - median(value[:_FEWEST])) > still)
        if left.size and left[0] >= _FEWEST:
            found.insert(0, (float(time_s[0]), float(time_s[left[0] - 1])))
    if value.size - after > _FEWEST:
        left = after + np.flatnonzero(np.abs(value[after:] - median(value[-_FEWEST:])) > still)
        if left.size and value.size - left[-1] > _FEWEST:
            found.append((float(time_s[left[-1] + 1]), float(time_s[-1])))
    return found


def _is_frozen(force: Samples, rows: slice) -> bool:
    """Say whether a force that is noisy stands still to the last digit in a part of a rest.

    Where each reading is held over some rows, all but the first of them are the same as the one before.
    """
    changes = float(np.mean(np.diff(force.value[rows]) != 0.0)) * force.sampling.held
    return force.is_noisy and changes < 1.0 - _FROZEN
