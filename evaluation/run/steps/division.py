"""Which cycles of a run belong together: steps of amplitude, mean stroke, frequency; gradual changes.

Two cycles that follow each other are of one step when their ends and their frequency agree within the
tolerances below. A change that is smaller, but stands out from how the cycles before and after it wander,
ends a step, too. A drift or a softening wanders, and is not cut.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import CycleResult, TurningPoint
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.foundation import Kind
from bufferstand.foundation.numbers import median

ENDS = 0.05
"""Ends of neighbouring cycles of a harmonic step agree within this share of their range …"""
RATE = 0.05
"""… and their frequencies within this share."""
SINGLE_ENDS = 0.10
"""Single strokes (static, impact, proof) are of one step when their ends agree within this share …"""
SPEED = 0.25
"""… and, of a static run, their largest speeds of loading within this one."""
SMALLEST = 0.01
"""A change of an end (share of the range) or of the frequency from here on may be a step …"""
STANDS_OUT = 3.0
"""… if it is so many times the range of what the cycles before it, and after it, wander by."""
_NEAR = 4
"""Cycles beside the next ones that are looked at to each side of a change that may be a step."""
SWEPT_RATE = 0.10
"""Cycles whose frequency changes by more than this within a step, little by little, are a sweep; …"""
SWEPT_RANGE = 0.25
"""… so are those whose range does by more than this share of the largest …"""
SWEPT_MEAN = 0.50
"""… or whose mean stroke does by more than this share of the range."""
SEATING = 0.10
"""A single stroke that is shorter than this share of the longest one is no step."""
_TURN = attrgetter("leave_mm", "time_s", "leave_s")
_SINGLE: tuple[Kind, ...] = ("static", "impact", "proof")


@dataclass(frozen=True)
class Part:
    """A step: numbers of the cycles that belong to it, and of those that its summary is the mean of."""

    cycles: tuple[int, ...]
    used: tuple[int, ...]


@dataclass(frozen=True)
class Division:
    """The steps of a run, in order of time.

    ``why`` says, of cycles that are complete and steady and yet stand for nothing, why; ``loose`` are these.
    """

    parts: tuple[Part, ...] = ()
    loose: tuple[int, ...] = ()
    why: tuple[str, ...] = ()

    @property
    def several(self) -> bool:
        """Whether the run has more than one step."""
        return len(self.parts) > 1

    @property
    def used(self) -> tuple[int, ...]:
        """Numbers of the cycles of all summaries."""
        return tuple(number for part in self.parts for number in part.used)


@dataclass
class _Loose:
    """Cycles that go into no summary, and why."""

    numbered: Callable[[Sequence[int]], str]
    cycles: list[int] = field(default_factory=list)
    why: list[str] = field(default_factory=list)

    def add(self, numbers: NDArray[np.intp], why: str) -> None:
        own = numbers.tolist()
        self.cycles += own
        self.why.append(f"{self.numbered(own)}: {why}")


def divide(
    kind: Kind,
    results: Sequence[CycleResult],
    numbered: Callable[[Sequence[int]], str],
    spoiled: Collection[int] = (),
) -> Division:
    """Return the steps of a run.

    Parameters
    ----------
    kind : Kind
        A harmonic step is made of steady cycles, at least two where there are several steps. In a static
        run, an impact or a proof load a single complete stroke may be one.
    results : sequence of CycleResult
        All cycles of the run, in order of time.
    numbered : callable
        Puts numbers of cycles in words.
    spoiled : collection of int
        Numbers of cycles that must not stand for anything.

    Returns
    -------
    Division
        One step where all cycles belong together; none where no cycle can stand for the run.
    """
    single = kind in _SINGLE
    out = set(spoiled)
    chosen = [
        result
        for result in results
        if (c := result.cycle).complete and (single or c.steady) and c.index not in out
    ]
    if not chosen:
        return Division()
    numbers = np.array([result.cycle.index for result in chosen])
    steady = np.array([result.cycle.steady for result in chosen]) | (kind in ("impact", "proof"))
    shape = _shapes(chosen)
    groups = np.split(np.arange(numbers.size), _cuts(shape, kind))
    loose = _Loose(numbered)
    parts = []
    for rows in groups:
        if text := _swept(shape[rows], single=single):
            loose.add(numbers[rows], f"no summary: {text}")
            continue
        settled = rows[steady[rows]]
        used = settled if settled.size or len(groups) == 1 else rows
        if single and shape[rows, 1].max() < SEATING * shape[:, 1].max():
            loose.add(numbers[rows], "of no step: a tenth of the longest stroke, or less")
        elif not single and len(groups) > 1 and rows.size < 2:
            loose.add(numbers[rows], "of no step: like no cycle beside it")
        else:
            parts.append(Part(tuple(numbers[rows].tolist()), tuple(numbers[used].tolist())))
    return Division(tuple(p for p in parts if p.used), tuple(loose.cycles), tuple(loose.why))


def _shapes(results: Sequence[CycleResult]) -> FloatArray:
    """Return what cycles are like, shape (C, 5).

    Lower end [mm], range [mm], frequency without and with rests [Hz], largest speed of loading [mm/s] or NaN.
    """
    low, from_s, begin_s = _of_turns([result.cycle.start for result in results])
    high, _, _ = _of_turns([result.cycle.top for result in results])
    _, end_s, until_s = _of_turns([result.cycle.end for result in results])
    speeds = [result.quantities.speed_loading_max_mm_per_s for result in results]
    least_s = np.finfo(np.float64).tiny
    lasts_s = np.maximum(end_s - begin_s, least_s)
    with_rests_s = np.maximum(0.5 * (end_s + until_s - from_s - begin_s), least_s)
    speed = np.array(speeds, dtype=np.float64)
    return np.stack((low, high - low, 1.0 / lasts_s, 1.0 / with_rests_s, speed), axis=1)


def _of_turns(turns: Sequence[TurningPoint]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stroke at leaving [mm], and moments of arriving and leaving [s]."""
    columns = zip(*map(_TURN, turns), strict=True)
    stroke, arrive_s, leave_s = (np.array(column, dtype=np.float64) for column in columns)
    return stroke, arrive_s, leave_s


def _cuts(shape: FloatArray, kind: Kind) -> NDArray[np.intp]:
    """Return the rows at which another step begins."""
    if len(shape) < 2:
        return np.zeros(0, dtype=np.intp)
    low, span = shape[:, 0], shape[:, 1]
    larger = np.maximum(span[1:], span[:-1])
    ends = np.stack((np.diff(low), np.diff(low + span))) / larger
    logs = np.log(shape[:, 2:]).T
    rest, with_rest, speed = np.abs(np.diff(logs))
    cut = np.any(np.abs(ends) > (SINGLE_ENDS if kind in _SINGLE else ENDS), axis=0)
    if kind == "static":
        cut |= speed > np.log1p(SPEED)
    if kind not in _SINGLE:
        cut |= np.minimum(rest, with_rest) > np.log1p(RATE)
        widest = median(span)
        for level in (low / widest, (low + span) / widest, logs[0]):
            cut |= _levels_change(level)
    return np.flatnonzero(cut) + 1


def _levels_change(level: FloatArray) -> NDArray[np.bool_]:
    """Say between which cycles a level changes to another one that is kept, shape (C - 1,).

    The cycle to either side of a change may still be on its way, and does not count where others do.
    """
    change = np.abs(np.diff(level))
    found = np.zeros(change.size, dtype=bool)
    for row in np.flatnonzero(change >= 0.5 * SMALLEST).tolist():
        before = level[max(0, row - _NEAR) : row + 1]
        after = level[row + 1 : row + 2 + _NEAR]
        if before.size < 2 or after.size < 2:
            continue
        before, after = before[: max(2, before.size - 1)], after[min(1, after.size - 2) :]
        apart = abs(median(after) - median(before))
        wander = max(float(np.ptp(before)), float(np.ptp(after)))
        near = slice(max(0, row - 1), row + 2)
        found[row] = apart >= max(SMALLEST, STANDS_OUT * wander) and change[row] >= np.max(change[near])
    return found


def _swept(shape: FloatArray, *, single: bool) -> str:
    """Return in what cycles that follow each other closely change too much for a mean, or nothing.

    How long single strokes take is no matter of their step.
    """
    span, middle = shape[:, 1], shape[:, 0] + 0.5 * shape[:, 1]
    widest = float(np.max(span))
    rates = [(float(np.min(f)), float(np.max(f))) for f in shape[:, 2:4].T]
    slow, fast = min(rates, key=lambda ends: ends[1] / ends[0])
    if not single and fast > (1.0 + SWEPT_RATE) * slow:
        return f"the frequency changes little by little, {slow:.3g} to {fast:.3g} Hz: a sweep has no mean"
    if np.min(span) < (1.0 - SWEPT_RANGE) * widest:
        ends = f"{0.5 * float(np.min(span)):.3g} to {0.5 * widest:.3g} mm"
        return f"the amplitude changes little by little, {ends}: a sweep has no mean"
    if np.ptp(middle) > SWEPT_MEAN * widest:
        ends = f"{float(np.min(middle)):.3g} to {float(np.max(middle)):.3g} mm"
        return f"the mean stroke changes little by little, {ends}: a sweep has no mean"
    return ""
