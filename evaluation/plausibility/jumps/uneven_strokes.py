"""Loading branches of single strokes that differ from the one before by more than a spring can.

A stroke that is on record in part, lacks samples or has the jump in it has no loop that could be compared,
but its force on the way in can, where both strokes have been. A gain that changed changes it by one share
all the way; a spring softens, most from the first stroke to the second and then less and less, and hardens
only by what it recovers in a long pause, or in the cold.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bufferstand.evaluation.facts import Cycle, Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.jumps.spring_limits import (
    FIRST_SOFTER,
    HARDER,
    LONGER,
    PER_K,
    RECOVERS_S,
    RESTED,
    SOFTER_SINGLE,
    STEADY_K,
    TIRED,
    UNKNOWN_K,
)
from bufferstand.evaluation.plausibility.run_view import HalfCycle, Pass, RunView, pass_of, ways_of
from bufferstand.foundation.numbers import quantile

DIES_AWAY = 1.5
"""A later stroke shrinks by so many times what the one before shrank by: softening dies away."""
EVEN = 0.5
"""The share is the same along the stroke within this part: that of a shift of stroke or force is not."""
SPEEDS = 0.25
"""Strokes whose mean speeds differ by more are not alike."""
COMMON = 0.4
"""What both strokes passed through is at least this share of the stroke on record."""
_PART = (0.3, 0.97)
"""At first friction turns, and the tip is not common to both."""
_LOADED = 0.05
_POINTS, _FEWEST = 20, 10
_TENTH = 0.1


def uneven_stroke(look: RunView) -> Finding | None:
    """Return the first stroke of a static run whose way in is no spring's after the one before.

    Parameters
    ----------
    look : Look
    """
    cycles = [result.cycle for result in look.results]
    ways = [way for way in ways_of(cycles) if way.way > 0]
    passes = [pass_of(look, way) for way in ways]
    before: float | None = None
    for at, (one, two) in enumerate(pairwise(passes)):
        share = _growth(look, (ways[at], ways[at + 1]), one, two)
        if share is not None and abs(share) > _least(look, at, share, before):
            return _finding(look, cycles[at], cycles[at + 1], share)
        before = share
    return None


def _growth(look: RunView, ways: tuple[HalfCycle, HalfCycle], one: Pass, two: Pass) -> float | None:
    """Return by which share the force changes where two passes have been (logarithm); None: by no one."""
    if min(one.stroke_mm.size, two.stroke_mm.size) < _FEWEST:
        return None
    low_mm = max(float(one.stroke_mm[0]), float(two.stroke_mm[0]))
    high_mm = min(float(one.stroke_mm[-1]), float(two.stroke_mm[-1]))
    at_mm = low_mm + np.linspace(*_PART, _POINTS) * (high_mm - low_mm)
    if high_mm - low_mm < COMMON * look.stroke.span or not _as_fast(look, ways, at_mm[[0, -1]]):
        return None
    after = np.interp(at_mm, two.stroke_mm, two.force_kN)
    shares = [
        _share(look, np.interp(at_mm - by_mm, one.stroke_mm, one.force_kN), after)
        for by_mm in (0.0, _moved_mm(look, one, two))
    ]
    # A jump is one whether the stroke from the release or that on record is compared.
    told = [share for share in shares if share is not None]
    return min(told, key=abs) if len(told) == len(shares) else None


def _moved_mm(look: RunView, one: Pass, two: Pass) -> float:
    """Return by how much the stroke at release moved from one way in to the next [mm]; 0: none is on record.

    A draw wire that slips while the stroke is clipped leaves no leap, and a spring takes a set.
    """
    released = max(float(own.force_kN[0]) for own in (one, two)) < _LOADED * look.force.span
    return float(two.stroke_mm[0] - one.stroke_mm[0]) if released else 0.0


def _share(look: RunView, before: FloatArray, after: FloatArray) -> float | None:
    """Return the one share by which forces at the same places differ (logarithm); None: there is none."""
    loaded = np.minimum(before, after) > _LOADED * look.force.span
    if np.count_nonzero(loaded) < _FEWEST:
        return None
    shares: FloatArray = np.log(after[loaded] / before[loaded])
    low, middle, high = (quantile(shares, part) for part in (_TENTH, 0.5, 1.0 - _TENTH))
    return middle if high - low < max(EVEN * abs(middle), HARDER) else None


def _as_fast(look: RunView, ways: tuple[HalfCycle, HalfCycle], places_mm: FloatArray) -> bool:
    """Say whether two ways in take as long from one stroke to another."""
    lasts_s = []
    for way in ways:
        rows = look.stroke.rows(way.start_s, way.end_s)
        rising = np.maximum.accumulate(look.stroke.value[rows])
        first, last = np.searchsorted(rising, places_mm)
        times_s = look.stroke.time_s[rows]
        lasts_s.append(float(times_s[min(int(last), times_s.size - 1)] - times_s[int(first)]))
    return min(lasts_s) > 0.0 and max(lasts_s) < (1.0 + SPEEDS) * min(lasts_s)


def _least(look: RunView, at: int, share: float, before: float | None) -> float:
    """Return from which share on the way in behind number ``at`` is none of a spring."""
    one, two = look.results[at], look.results[at + 1]
    rest_s, earlier_s = (r.cycle.start.leave_s - r.cycle.start.time_s for r in (two, one))
    if share > 0.0:
        least = RESTED if rest_s > RECOVERS_S else HARDER
    elif at == 0 or before is None:
        least = FIRST_SOFTER
    else:
        least = max(TIRED if LONGER * rest_s < earlier_s else SOFTER_SINGLE, -DIES_AWAY * before)
    one_C, two_C = one.quantities.temperature_max_C, two.quantities.temperature_max_C
    if one_C is None or two_C is None:  # strokes warm a spring: none is harder by it
        return least + (PER_K * UNKNOWN_K if share < 0.0 else 0.0)
    softens_K = (one_C - two_C) * np.sign(share)
    return least + PER_K * softens_K if softens_K > STEADY_K else least


def _finding(look: RunView, one: Cycle, two: Cycle, share: float) -> Finding:
    from_s, to_s = one.top.time_s, two.top.time_s
    text = (
        f"force jumps between strokes {one.index} and {two.index}: on the way in it changes by "
        f"{np.expm1(share):+.1%} all along, which no spring does; gain of the amplifier changed, and which "
        "of both sides is right is not on record: repeat the test"
    )
    size = float(np.exp(share))
    return Finding("gain-jump", "force", from_s, to_s, look.all_cycles, size, "1", text, "spoils")
