"""The greatest speeds of a run without a speed channel: slopes of the stroke, in cycles and outside of them.

Slope of a parabola over 5 % of a branch (at least 5 samples), as for the speeds of a cycle. In complete
cycles these are known; what lies outside of them (ramps, cycles cut short) is looked at with the window of
the run's usual branch. A rest between two neighbouring cycles holds no speed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bufferstand.evaluation.facts import Cycle, CycleResult
from bufferstand.evaluation.numerics import FloatArray, moving_slopes
from bufferstand.evaluation.quantities import SPEED_WINDOW
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty import NEAR_LARGEST
from bufferstand.foundation.numbers import median

_LEAST_WINDOW = 5
_LOOKED_AT = 100
"""Of more cycles than these, evenly picked ones say how long a branch usually takes."""
_STEPS_A_WINDOW = 4
_MOST_POINTS = 4
"""A stretch is brought to even moments; to no more than so many for each of its samples."""


@dataclass(frozen=True, eq=False)
class SpeedPeak:
    """A greatest speed.

    Attributes
    ----------
    speed_mm_per_s, time_s, stroke_mm : float
        The speed (not negative), when, and at which stroke.
    window : float
        Samples over which it is the slope.
    windows : float
        How many such windows lie in the branch or stretch in which it was found.
    step_s : float
        Distance of these samples.
    slopes : array, shape (K,)
        All slopes of the branch or stretch in which it was found, evenly spread.
    branches : int
        How many like it the run has.
    """

    speed_mm_per_s: float
    time_s: float
    stroke_mm: float
    window: float
    windows: float
    step_s: float
    slopes: FloatArray
    branches: int = 1

    def rivals(self, u_mm_per_s: float) -> float:
        """Return how many independent slopes are within three standard deviations of the greatest.

        Slopes a third of a window apart are as good as independent; a quarter is what was measured.
        """
        near = np.count_nonzero(self.slopes >= self.speed_mm_per_s - NEAR_LARGEST * u_mm_per_s)
        share = float(near) / max(1, self.slopes.size)
        return max(1.0, 4.0 * share * self.windows * self.branches)


Both = tuple[SpeedPeak | None, SpeedPeak | None]


def greatest_speeds(record: Record, results: Sequence[CycleResult]) -> Both:
    """Return the greatest speeds of loading and of unloading.

    Parameters
    ----------
    record : Record
        As its cycles were evaluated.
    results : sequence of CycleResult
        In order of time.

    Returns
    -------
    (SpeedPeak or None, SpeedPeak or None)
        None where nothing moved that way over five samples.
    """
    complete = [r for r in results if r.cycle.complete]
    found = _in_cycles(record, complete)
    window_s = SPEED_WINDOW * _usual_branch_s(record, [r.cycle for r in complete or results])
    for part in _outside(record, [r.cycle for r in complete], window_s):
        found = _larger(found, _in_stretch(record, part, window_s))
    return found


def _in_cycles(record: Record, results: Sequence[CycleResult]) -> Both:
    loading_speeds = [r.quantities.speed_loading_max_mm_per_s for r in results]
    unloading_speeds = [r.quantities.speed_unloading_max_mm_per_s for r in results]
    peaks: list[SpeedPeak | None] = []
    for loading, speeds in ((True, loading_speeds), (False, unloading_speeds)):
        known = [speed for speed in speeds if speed is not None]
        if not known:
            peaks.append(None)
            continue
        speed = max(known)
        cycle = results[speeds.index(speed)].cycle
        ends_s = (cycle.start_s, cycle.top.time_s) if loading else (cycle.top.leave_s, cycle.end_s)
        first, last = np.searchsorted(record.time_s, ends_s).tolist()
        there = _in_stretch(record, slice(first, last), SPEED_WINDOW * (ends_s[1] - ends_s[0]))
        here = there[0 if loading else 1]
        if here is None:
            middle_s = 0.5 * (ends_s[0] + ends_s[1])
            step_s = (ends_s[1] - ends_s[0]) / max(1, last - first)
            stroke_mm = 0.5 * (cycle.stroke_min_mm + cycle.stroke_max_mm)
            here = SpeedPeak(speed, middle_s, stroke_mm, _LEAST_WINDOW, 1.0, step_s, np.array([speed]))
        peaks.append(replace(here, speed_mm_per_s=speed, branches=len(known)))
    return peaks[0], peaks[1]


def _usual_branch_s(record: Record, cycles: Sequence[Cycle]) -> float:
    """Return how long a branch of the run usually takes; all of the record where it does not turn."""
    if not cycles:
        return float(record.time_s[-1] - record.time_s[0])
    some = cycles[:: -(-len(cycles) // _LOOKED_AT)]
    return median([s for c in some for s in (c.top.time_s - c.start_s, c.end_s - c.top.leave_s)])


def _outside(record: Record, complete: Sequence[Cycle], window_s: float) -> Iterator[slice]:
    """Yield the stretches of samples outside of complete cycles, none across a break or a long step."""
    number = np.array([cycle.index for cycle in complete], dtype=np.intp)
    apart = (np.flatnonzero(np.diff(number) > 1) + 1).tolist()
    ends_s = [(complete[at - 1].end_s, complete[at].start_s) for at in apart]
    if complete:
        ends_s = [(-np.inf, complete[0].start_s), *ends_s, (complete[-1].end_s, np.inf)]
    for first, last in np.searchsorted(record.time_s, ends_s or [(-np.inf, np.inf)]).tolist():
        yield from _unbroken(record, first, last, window_s)


def _unbroken(record: Record, first: int, last: int, window_s: float) -> Iterator[slice]:
    if last - first < _LEAST_WINDOW:
        return
    within = [at for at in record.breaks if first < at < last] if record.breaks else []
    long = (np.flatnonzero(np.diff(record.time_s[first:last]) > window_s) + first + 1).tolist()
    for one, other in pairwise(sorted({first, *within, *long, last})):
        if other - one >= _LEAST_WINDOW:
            yield slice(one, other)


def _in_stretch(record: Record, part: slice, window_s: float) -> Both:
    time_s, stroke_mm = record.time_s[part], record.stroke_mm[part]
    count = time_s.size
    if count < _LEAST_WINDOW:
        return None, None
    whole_s = float(time_s[-1] - time_s[0])
    step_s = min(median(np.diff(time_s)), window_s / _STEPS_A_WINDOW)
    points = int(np.clip(round(whole_s / step_s) + 1, count, _MOST_POINTS * count))
    step_s = whole_s / (points - 1)
    window = max(_LEAST_WINDOW, 2 * int(0.5 * window_s / step_s) + 1)
    window = min(window, points - 1 + points % 2)
    even: FloatArray = np.linspace(time_s[0], time_s[-1], points)
    slope = moving_slopes(np.interp(even, time_s, stroke_mm)[None, :], np.array([points]), window)[0]
    # Whole windows only: what an outermost parabola says of its end is mostly noise.
    whole = slope[window // 2 : points - window // 2] / step_s
    peaks: list[SpeedPeak | None] = []
    for sign in (1.0, -1.0):
        at = int(np.argmax(sign * whole))
        speed, moment_s = float(sign * whole[at]), float(even[at + window // 2])
        stroke = float(np.interp(moment_s, time_s, stroke_mm))
        samples = window * count / points
        windows = max(1.0, points / window)
        each_s = whole_s / (count - 1)
        peak = SpeedPeak(speed, moment_s, stroke, samples, windows, each_s, sign * whole)
        peaks.append(peak if speed > 0.0 else None)
    return peaks[0], peaks[1]


def _larger(one: Both, other: Both) -> Both:
    pairs = [
        max((p for p in pair if p is not None), key=lambda p: p.speed_mm_per_s, default=None)
        for pair in zip(one, other, strict=True)
    ]
    return pairs[0], pairs[1]
