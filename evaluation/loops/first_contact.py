"""The stroke of first contact, found in the first loading branch and the approach before it.

Before contact the force stands at a rest level (the offset of the cell, the friction of the guides). At
contact it leaves that level for good: with a preload it jumps, along the compliance of the frame; without
one it rises with the slope of the spring. The last sample at the rest level and the first one above it bound
the place. Where the branch, extrapolated back, meets the rest level before the force is seen to rise, the
place is anywhere between the two.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Cycle, FirstContact
from bufferstand.evaluation.numerics import FloatArray, IndexArray
from bufferstand.evaluation.record import Record

_FEWEST = 20
"""Samples up to the first upper turning point, below which nothing is looked for."""
_REST_SAMPLES = 200
"""The rest level is the median of so many samples before the force rises, or of what there is …"""
_ONE_PLACE = 1e-6
_FEWEST_REST = 5
"""… but not of fewer than this."""
_SURE = 6.0
"""A force is above the rest level by so many standard deviations of its noise."""
_FIRST_SHARE = 0.005
"""Share of the largest force that the first look takes for noise and friction of the stand."""
_OFFSET_SHARE = 0.01
"""A rest level beyond this share of the largest force is no offset of a cell: the record begins loaded."""
_UNLOADED_SHARE = 0.005
_LEAST_UNLOADED_KN = 2.0
"""Nor is one above the lowest force of the record by more than this share, and by what guides rub."""
_LEAST_SLOPE = 0.5
"""A spring is stiffer than this [kN/mm]; it bounds how much of the approach may lie behind the contact."""
_FARTHEST_MM = 4.0
"""So much of the approach is left out at most, as it may lie behind the contact."""
_MOVED_MM = 0.1
"""The approach moves where it is so far from where it stood."""
_SHORT_MM = 0.05
"""A short approach, of a record that begins just before contact, moves where it is so far from there …"""
_FEWEST_MOVING = 2
"""… in so many samples."""
_CURVED = 0.15
"""A branch that is extrapolated may bend by this share of the way."""
_PUSHES = 4.0
"""Behind the contact the force rises so many times as far as it may before it: two branches in contact that
follow each other are not so different."""
_FLAT = 0.02
"""Before it the force changes by less than this share of that, but for what noise makes of its slope."""
_FROZEN = 1e-5
"""A force that has less noise than this share of that is frozen: it shows nothing of a contact."""
_LEAPS = 3.0
"""A force that leaves the band by so many times what its branch makes of one step jumps: no spring without
preload does, whose branch leaves it before."""
_BRANCH_MM = 2.0
"""The branch that is extrapolated back: so far from where the force rises, without its first third."""
_STROKES = 3
"""A first contact that the first stroke does not show is looked for in so many."""


def first_shown(
    record: Record,
    cycles: Sequence[Cycle],
    stated_zero_mm: float = 0.0,
    jumped_s: float = np.inf,
    *,
    moves: bool = False,
) -> FirstContact:
    """Return the first contact as the first stroke shows it, or a later one; at least one cycle is needed.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
    stated_zero_mm, moves
        As in :func:`find_first_contact`.
    jumped_s : float
        When the stroke jumps [s]: behind that nothing is looked for.
    """
    first = find_first_contact(record, cycles[0].top.time_s, stated_zero_mm, moves=moves)
    if first.stroke_mm is not None or record.between is not None:  # a force that is read rarely blurs it
        return first
    for cycle in cycles[1:_STROKES]:
        if cycle.top.time_s >= jumped_s:
            break
        again = find_first_contact(record, cycle.top.time_s, stated_zero_mm, cycle.start.time_s, moves=moves)
        if again.stroke_mm is not None:
            return again
    return first


def find_first_contact(
    record: Record,
    top_s: float,
    stated_zero_mm: float = 0.0,
    later_s: float | None = None,
    *,
    moves: bool = False,
) -> FirstContact:
    """Return the first contact of a static run.

    Parameters
    ----------
    record : Record
    top_s : float
        Moment of the first upper turning point [s].
    stated_zero_mm : float
        Limit of the error of the stroke's zero, as the channels state it.
    later_s : float, optional
        When the rest before a later stroke begins [s], to find it in that one: it is, if a preload is still
        met there, which holds the specimen at its stop, where it was at first contact.
    moves : bool
        Whether the force's zero moves: then what it shows at rest later on tells nothing of how it begins.
    """
    first = 0 if later_s is None else int(np.searchsorted(record.time_s, later_s))
    last = int(np.searchsorted(record.time_s, top_s)) + 1
    if last - first < _FEWEST:
        return _not_shown(
            "the record has too few samples before its first upper turning point", stated_zero_mm
        )
    found = _found(record, slice(first, last), stated_zero_mm, moves=moves, later=later_s is not None)
    if found.stroke_mm is not None or later_s is not None:
        return found
    # A rest of few samples is told from a branch by the jump behind it.
    brief = _found(record, slice(first, last), stated_zero_mm, _FEWEST_REST, moves=moves)
    return brief if brief.how == "jump" else found


def _found(
    record: Record,
    rows: slice,
    stated_zero_mm: float,
    begins: int = _FEWEST,
    *,
    moves: bool,
    later: bool = False,
) -> FirstContact:
    """Return the contact as samples up to a top show it, of which so many begin at rest."""
    first, stroke, force = rows.start, record.stroke_mm[rows], record.force_kN[rows]
    largest = float(np.max(force))
    # Only a preload counts in a later stroke, and guides rub by less than most preloads.
    rubs = largest if not later else min(largest, _LEAST_UNLOADED_KN / _FIRST_SHARE)
    level, band, at = _rest(stroke, force, rubs, begins)
    if at is None:
        why = "the record begins loaded: it has no samples at a rest level before the force rises"
        return _not_shown(why, stated_zero_mm)
    low = record.force_kN.size // 50
    lowest = level if moves else float(np.partition(record.force_kN, low)[low])
    above = max(_LEAST_UNLOADED_KN, _UNLOADED_SHARE * largest)
    loaded = abs(level) > _OFFSET_SHARE * largest or level - lowest > above
    if loaded and not _approaches(stroke, force, at, level):
        return _not_shown(f"the record begins loaded, with {level:.1f} kN", stated_zero_mm)
    if at + 1 >= stroke.size or record.has_break(first + max(0, at - 1), first + at + 1):
        return _not_shown("the record has a hole where the force begins to rise", stated_zero_mm)
    low_mm, high_mm, how = _stretch(stroke, force, at, level, band)
    if how == "rise":
        lowest_mm = _met_above(stroke, force, at, level, band, _FIRST_SHARE * rubs)
        low_mm, how = (low_mm, how) if lowest_mm is None else (lowest_mm, "jump")
    if record.between is not None:  # between its readings the force is drawn smooth: it leaps in any of them
        time, step_s = record.time_s[rows], record.between.step_s
        low_mm = min(low_mm, float(np.interp(time[at] - step_s, time, stroke)))
        high_mm = max(high_mm, float(np.interp(time[at + 1] + step_s, time, stroke)))
    if later and how != "jump":
        return _not_shown("no preload shows that it is where it was", stated_zero_mm)
    place = 0.5 * (low_mm + high_mm)
    how = "jump" if how == "step" else how
    expanded = 0.5 * (high_mm - low_mm) + 2.0 * _noise_mm(stroke, at)
    beyond = abs(place) > expanded + stated_zero_mm
    digits = contact_decimals(expanded)
    why = f"first contact at {place:.{digits}f} ± {expanded:.{digits}f} mm of the recorded stroke"
    return FirstContact(place, expanded, -place, level, stated_zero_mm, beyond, how, why)


def _approaches(stroke_mm: FloatArray, force_kN: FloatArray, at: int, level_kN: float) -> bool:
    """Say whether the stroke moves on freely up to sample ``at``, whatever the cell shows of nothing.

    A specimen that is in contact pushes as soon as it is moved. One that does not on a way, and pushes by
    many times what noise hides on as long a way behind it, was not in contact: the force's zero is off.
    """
    moved = max(_SHORT_MM, _SURE * _scatter(stroke_mm[:_REST_SAMPLES]))
    stood = float(np.median(stroke_mm[:_FEWEST_REST]))
    way = float(stroke_mm[at]) - stood
    moving = np.flatnonzero(stroke_mm[: at + 1] > stood + moved)
    # A stroke whose samples are held may show one place of the whole way, a force one reading.
    if moving.size < _FEWEST_MOVING or np.ptp(stroke_mm[moving]) <= _ONE_PLACE * way:
        return False
    far = int(np.argmax(stroke_mm[at:] > stroke_mm[at] + way)) + at
    rise = float(force_kN[far]) - level_kN
    change, noise = _on_the_way(stroke_mm, force_kN, moving, way)
    if noise <= _FROZEN * abs(rise) or np.ptp(force_kN[moving]) == 0.0:
        return False
    hidden = 0.5 * _SURE * noise * float(np.sqrt(12.0 / moving.size))
    return rise > _PUSHES * _SURE * noise and change < _FLAT * rise + hidden


def _on_the_way(
    stroke_mm: FloatArray, force_kN: FloatArray, moving: IndexArray, way_mm: float
) -> tuple[float, float]:
    """Return by how much the force changes over a way (absolute), and the deviation of its noise [kN].

    By its slope, which leaves out by how much guides rub as they start; few samples on the way have none, and
    are compared with those in which the stroke stood: a force that rises evenly is half its rise above them.
    """
    force = force_kN[moving]
    if moving.size < _FEWEST_REST:
        stood = force_kN[: int(moving[0])][-_REST_SAMPLES:]
        if stood.size < _FEWEST_REST:
            return float("inf"), 0.0
        return 2.0 * abs(float(np.mean(force) - np.median(stood))), _noise_kN(stood)
    slope, offset = np.polyfit(stroke_mm[moving], force, 1)
    return abs(float(slope)) * way_mm, _noise_kN(force - slope * stroke_mm[moving] - offset)


def _not_shown(why: str, stated_zero_mm: float) -> FirstContact:
    return FirstContact(None, None, None, None, stated_zero_mm, False, "not on record", why)


_HELD_SHARE = 1e-3


def _rest(
    stroke_mm: FloatArray, force_kN: FloatArray, largest_kN: float, begins: int
) -> tuple[float, float, int | None]:
    """Return rest level, the band about it that noise makes, and the last sample in it; None without one.

    The first look takes little forces for friction. The level is then that of the approach while it moves,
    where it is long enough, and not of the actuator standing still before it; samples that may lie behind a
    contact without preload are left out.
    """
    first = float(np.median(force_kN[:begins]))
    band = _FIRST_SHARE * largest_kN + _SURE * _rest_noise(stroke_mm, force_kN)
    below = np.flatnonzero(force_kN <= first + band)
    if below.size < _FEWEST_REST:
        return first, band, None
    at = int(below[-1])
    behind = (stroke_mm > stroke_mm[at]) & (stroke_mm <= stroke_mm[at] + _BRANCH_MM)
    behind[: at + 1] = False
    slope = _LEAST_SLOPE
    # Values that are held leave one stroke, and no slope.
    if np.count_nonzero(behind) >= _FEWEST_REST and np.ptp(stroke_mm[behind]) > _HELD_SHARE * _BRANCH_MM:
        slope = max(slope, float(np.polyfit(stroke_mm[behind], force_kN[behind], 1)[0]))
    before = below[stroke_mm[below] < stroke_mm[at] - min(band / slope, _FARTHEST_MM)]
    stood = float(np.median(stroke_mm[:_FEWEST_REST]))
    moved = max(_MOVED_MM, _SURE * _scatter(stroke_mm[:_REST_SAMPLES]))
    moving = before[stroke_mm[before] > stood + moved]
    if moving.size >= 2 * _FEWEST_REST:
        rest = force_kN[moving[-_REST_SAMPLES:]]
        band = _SURE * _noise_kN(rest)
    elif (short := _short_approach(stroke_mm, force_kN, stood)) is not None:
        rest, band = short
    elif before.size < _FEWEST_REST:
        return first, band, at
    else:
        rest = force_kN[before[-_REST_SAMPLES:]]
    level = float(np.median(rest))
    band = max(band, 1e-4 * largest_kN)
    below = np.flatnonzero(force_kN <= level + band)
    return level, band, int(below[-1]) if below.size >= _FEWEST_REST else None


def _short_approach(
    stroke_mm: FloatArray, force_kN: FloatArray, stood_mm: float
) -> tuple[FloatArray, float] | None:
    """Return the force on an approach of few samples, and the band that noise makes; None: it shows no rest.

    Its samples lie within the noise of those at which the stroke stood before it: guides rub by no more. On
    as long a way behind it the force rises by many times that, which in contact it would on both.
    """
    moved = max(_SHORT_MM, _SURE * _scatter(stroke_mm[:_REST_SAMPLES]))
    begins = int(np.argmax(stroke_mm > stood_mm + moved))
    standing = force_kN[:begins][-_REST_SAMPLES:]
    if standing.size < _FEWEST:
        return None
    band, level = _SURE * _noise_kN(standing), float(np.median(standing))
    at = int(np.flatnonzero(force_kN <= level + band)[-1])
    if at + 1 - begins < _FEWEST_MOVING:
        return None
    far = at + int(np.argmax(stroke_mm[at:] > 2.0 * stroke_mm[at] - stood_mm))
    return (force_kN[begins : at + 1], band) if float(force_kN[far]) - level > _PUSHES * band else None


def _rest_noise(stroke_mm: FloatArray, force_kN: FloatArray) -> float:
    """Return the standard deviation of the force's noise before it moves, or on the whole where it does not.

    Steps of a branch that is sampled coarsely differ by more than noise.
    """
    whole = _scatter(force_kN[:_REST_SAMPLES])
    moved = np.abs(stroke_mm - np.median(stroke_mm[:_FEWEST_REST])) > _MOVED_MM + _SURE * _scatter(stroke_mm)
    stands = int(np.argmax(moved))
    return whole if stands < _FEWEST else min(whole, _scatter(force_kN[:stands][-_REST_SAMPLES:]))


def _scatter(values: FloatArray) -> float:
    """Return the standard deviation of noise from the differences of neighbours, whatever the trend."""
    steps = np.diff(values)
    return 1.4826 * float(np.median(np.abs(steps - np.median(steps)))) / float(np.sqrt(2.0))


def _noise_kN(force_kN: FloatArray) -> float:  # noqa: N802 - the unit's own letters
    """Return the standard deviation of a stretch at rest, from the median of its deviations."""
    return 1.4826 * float(np.median(np.abs(force_kN - np.median(force_kN))))


def _stretch(
    stroke_mm: FloatArray, force_kN: FloatArray, at: int, level_kN: float, band_kN: float
) -> tuple[float, float, str]:
    """Return between which strokes the contact lies, and whether the force jumps or rises there.

    A ``step`` is a jump of which too few samples show how it goes on.
    """
    before, after = sorted((float(stroke_mm[at]), float(stroke_mm[at + 1])))
    beyond, pushed = stroke_mm[at + 1 :] - after, force_kN[at + 1 :]
    far, near = _near(beyond)
    # A stroke whose samples are held stays at one value, through which there is no line.
    if np.count_nonzero(near) < _FEWEST_REST or np.ptp(beyond[near]) <= _ONE_PLACE * far:
        return before, after, "step"
    slope, offset = np.polyfit(beyond[near], pushed[near], 1)
    left = pushed[near] - slope * beyond[near] - offset
    u_offset = float(np.std(left)) * 2.0 / float(np.sqrt(left.size - 2))
    jump = float(offset - slope * (after - before)) - level_kN
    if slope <= 0.0:
        return before, after, "step"
    noise = float(np.std(left)) + u_offset + _noise_mm(stroke_mm, at) * float(slope)
    leaps = jump - band_kN > _LEAPS * float(slope) * (after - before) + _SURE * noise
    if jump <= 2.0 * band_kN + 3.0 * u_offset and not leaps:
        # A spring without preload is seen to rise when it has left the band, which noise may delay.
        reach = (1.0 + _CURVED) * (float(offset) - level_kN) + 3.0 * u_offset
        crossing = after - reach / max(float(slope), _LEAST_SLOPE)
        return min(crossing, before), after, "rise"
    # Up the ramp of the frame: what of it is hidden by noise lies before the last sample at rest.
    half = int(np.argmax(pushed >= level_kN + 0.5 * jump))
    ramp = max(float(stroke_mm[at + 1 + half]) - before, 0.0) / (0.5 * jump)
    return before - ramp * band_kN, after, "jump"


def _near(beyond_mm: FloatArray) -> tuple[float, NDArray[np.bool_]]:
    """Return how far the branch that is extrapolated goes [mm], and which samples behind contact it has."""
    least = min(_FEWEST, beyond_mm.size - 1)
    far = max(_BRANCH_MM, float(np.partition(beyond_mm, least)[least]))
    return far, (beyond_mm > far / 3.0) & (beyond_mm <= far)


def _met_above(
    stroke_mm: FloatArray, force_kN: FloatArray, at: int, level_kN: float, band_kN: float, rubs_kN: float
) -> float | None:
    """Return the lowest place of contact [mm] of a preload that many samples show, or None.

    The branch extrapolated to where the force was still at rest lies above it by the preload, or by less
    where the contact lies behind; without one by what guides rub as they start, and what the branch bends.
    Where the stroke stands until the force rises, place and force of the rest are known from many samples;
    where it moves, from the last ones.
    """
    for rests in (_FEWEST_REST, _REST_SAMPLES):
        stood, force = stroke_mm[: at + 1][-rests:], force_kN[: at + 1][-rests:]
        place = float(np.mean(stood))
        beyond, pushed = stroke_mm[at + 1 :] - place, force_kN[at + 1 :]
        far, near = _near(beyond)
        way = beyond[near]
        if way.size < _FEWEST_REST or np.ptp(way) <= _ONE_PLACE * far:
            return None
        (slope, jump), cov = np.polyfit(way, pushed[near] - float(np.mean(force)), 1, cov=True)
        u_jump = float(np.hypot(np.sqrt(cov[1, 1]), np.std(force) / np.sqrt(force.size)))
        if jump - rubs_kN > _SURE * u_jump + _CURVED * float(slope) * float(np.mean(way)):
            half = int(np.argmax(pushed >= level_kN + 0.5 * jump))
            ramp = max(float(beyond[half]), 0.0) / (0.5 * float(jump))
            return place - ramp * band_kN
    return None


def _noise_mm(stroke_mm: FloatArray, at: int) -> float:
    """Return the standard deviation of the stroke's noise about a sample."""
    return noise_of_bends(stroke_mm[max(0, at - 100) : at + 100])


def noise_of_bends(values: FloatArray) -> float:
    """Return the standard deviation of noise from second differences, whatever the trend; 0 of too few."""
    if values.size < _FEWEST_REST:
        return 0.0
    return 1.4826 * float(np.median(np.abs(np.diff(values, n=2)))) / float(np.sqrt(6.0))


def contact_decimals(expanded_mm: float) -> int:
    """Return the decimals of a place of contact [mm]: two, more in a stroke that is written in metres."""
    return 2 if expanded_mm >= 0.005 or expanded_mm <= 0.0 else 1 - int(np.floor(np.log10(expanded_mm)))
