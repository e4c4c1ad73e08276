"""A stroke zero that is lost unseen: a stroke that is met earlier than any stroke before it.

A draw wire that slips while its stroke is not on record, or as fast as the motion itself, leaves no leap. But
from then on the specimen is met at a smaller stroke, and all of its loading branch has moved with it. No
specimen does that: it takes a set and is met later, it recovers from one at most, and is never longer than it
was before the first stroke on record.
"""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.facts import Cycle, Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.jumps.spring_limits import RECOVERS_S
from bufferstand.evaluation.plausibility.run_view import HalfCycle, Pass, RunView, pass_of, ways_of
from bufferstand.foundation.numbers import median, quantile

SHARE, RECOVERED = 0.02, 0.04
"""The branch moves by this share of the range of the stroke, or by this one after a pause in which rubber
recovers …"""
EVEN = 0.25
"""… alike all along within this part of it: a force that is greater by a share moves its upper end most."""
SPEEDS, _PART = 0.25, (0.2, 0.9)
"""Strokes whose mean speeds differ by more are not alike: a damper is stiffer when it is moved faster."""
_RELEASED = 0.05
"""Before the stroke the force is below this share of its range: else it is not met there."""
_SAME_REST = 0.2
"""Rest forces that differ by this part of what the branch moves by are of a force whose zero moved."""
_MET, _MET_EVEN = 0.03, 0.5
"""At this share of the greatest force the specimen has just been met: that place has moved, too, within this
part. A gain that grew moves a branch that bends upwards almost alike, but not where it begins."""
_FORCES = np.linspace(0.1, 0.9, 17)
_FEWEST = 12
_TENTH = 0.1


def contact_moved(look: RunView) -> Finding | None:
    """Return the first stroke of a static run that is met earlier than all strokes before it.

    Parameters
    ----------
    look : RunView

    Returns
    -------
    Finding or None
        ``size`` is by how much the stroke reads too little from there on [mm], negative.
    """
    if look.facts.kind != "static":
        return None
    cycles = [result.cycle for result in look.results]
    ways = [way for way in ways_of(cycles) if way.way > 0]
    passes = [pass_of(look, way) for way in ways]
    places: dict[int, float] = {}
    for at, own in enumerate(passes):
        if not _is_met(look, own):
            continue
        # The zero may be lost on a way in, which then is like none: the one behind it is held against others.
        for before in sorted(places, reverse=True):
            moved_mm = _moved_mm(look, (ways[before], passes[before]), (ways[at], own))
            if moved_mm is None:
                continue
            rest_s = ways[at].start_s - cycles[before].end.time_s
            share = RECOVERED if rest_s > RECOVERS_S else SHARE
            if places[before] + moved_mm < min(places.values()) - share * look.stroke.span:
                return _finding(look, cycles[before], cycles[at], moved_mm)
            places[at] = places[before] + moved_mm
            break
        if not places:
            places[at] = 0.0
    return None


def _is_met(look: RunView, own: Pass) -> bool:
    """Say whether a way in begins before the specimen is met, and is long enough to be compared."""
    if own.stroke_mm.size < _FEWEST or float(np.ptp(own.stroke_mm)) < 0.5 * look.stroke.span:
        return False
    return abs(float(own.force_kN[0])) < _RELEASED * look.force.span


def _moved_mm(look: RunView, before: tuple[HalfCycle, Pass], after: tuple[HalfCycle, Pass]) -> float | None:
    """Return by how much the branch moved along the stroke, alike at all its forces; None: it did not."""
    highest_kN = min(float(np.max(own.force_kN)) for _, own in (before, after))
    forces_kN = np.append(_FORCES, _MET) * highest_kN
    one_mm, two_mm = (_places_mm(own, forces_kN) for _, own in (before, after))
    *moved_mm, met_mm = two_mm - one_mm
    low, middle, high = (quantile(np.array(moved_mm), part) for part in (_TENTH, 0.5, 1.0 - _TENTH))
    uneven = high - low > EVEN * abs(middle) or abs(met_mm - middle) > _MET_EVEN * abs(middle)
    if float(np.max(np.abs(moved_mm))) < SHARE * look.stroke.span:
        return middle  # nothing that counts, even or not: softening, a set
    slope = median(np.diff(forces_kN[:-1]) / np.maximum(np.diff(one_mm[:-1]), 1e-9))
    rest_kN = float(after[1].force_kN[0] - before[1].force_kN[0])
    shifted = abs(rest_kN) > _SAME_REST * slope * abs(middle)
    speeds = [_mean_mm_per_s(look, way, own) for way, own in (before, after)]
    if uneven or shifted or max(speeds) > (1.0 + SPEEDS) * min(speeds):
        return None
    return middle


def _mean_mm_per_s(look: RunView, way: HalfCycle, own: Pass) -> float:
    """Return how fast a way in passes through most of its range [mm/s], without what rests at its ends."""
    rows = look.stroke.rows(way.start_s, way.end_s)
    rising = np.maximum.accumulate(look.stroke.value[rows])
    span_mm = float(np.ptp(own.stroke_mm))
    first, last = np.searchsorted(rising, own.stroke_mm[0] + np.array(_PART) * span_mm).tolist()
    times_s = look.stroke.time_s[rows]
    lasts_s = float(times_s[min(last, times_s.size - 1)] - times_s[first])
    return (_PART[1] - _PART[0]) * span_mm / max(lasts_s, 1e-9)


def _places_mm(own: Pass, forces_kN: FloatArray) -> FloatArray:
    """Return at which stroke a way in first reaches each force."""
    rising = np.maximum.accumulate(own.force_kN)
    return np.asarray(np.interp(forces_kN, rising, own.stroke_mm))


def _finding(look: RunView, before: Cycle, after: Cycle, moved_mm: float) -> Finding:
    from_s, to_s = before.top.time_s, float(look.stroke.time_s[-1])
    name = look.strokes[0].name if len(look.strokes) == 1 else look.stroke.name
    text = (
        f"{name} jumps between strokes {before.index} and {after.index}: the specimen is met "
        f"{abs(moved_mm):.3g} mm earlier, and all of the way in has moved by as much, which no specimen "
        "does; a draw wire slipped or a plug was loose where it is not seen: the zero is lost from there on, "
        "repeat the test"
    )
    return Finding(
        "stroke-jump", name, from_s, to_s, look.touched(from_s, to_s), moved_mm, "mm", text, "spoils"
    )
