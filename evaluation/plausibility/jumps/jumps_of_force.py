"""Jumps of the force at one instant, compared with the force at that stroke in the other strokes.

A specimen makes fast changes of force, too: a preload that is met, friction that turns, a stick that slips.
The first two happen at the same stroke in every pass, so that nothing is left when another pass is taken off;
the last one leaves many leaps alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.evaluation.facts import Finding, FindingKind
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.jumps.sample_steps import (
    BESIDE,
    SampleJump,
    goes_on,
    largest_leaps,
    may_leap,
    rings,
)
from bufferstand.evaluation.plausibility.run_view import (
    HalfCycle,
    Pass,
    RunView,
    Samples,
    beyond_others,
    others_of,
    pass_of,
    ways_of,
)
from bufferstand.evaluation.plausibility.units_and_signs import STIFFEST
from bufferstand.foundation.numbers import median, quantile

SHARE = 0.006
"""A jump is at least this share of the range of the force …"""
NOISES, STEPS = 8.0, 2.0
"""… so many standard deviations of its noise, so many steps of its converter …"""
ALONE = 1.6
"""… and so many times the twentieth largest leap: of hundreds of normal deviates the largest is 1.5 times, of
thousands 1.3. What is beyond that is compared with the other passes."""
AGREE = 0.5
"""Beyond most of the other passes it is at least this share of the leap …"""
OF_STEP = 0.25
"""… and this one of the whole step: how exactly passes can be compared where the force changes fast."""
MOST_PASSES = 0.7
PULLED = 2.0
"""A force goes below zero by so many times as far as above it: what is released shows its greatest one."""
UNLOADED = 0.02
"""A leap with the motion from or to the force at the low end of its pass, within this share of the range and
its own size, is a contact: what is met or let go. Against the motion it is none."""
ALONE_SHARE = 0.05
"""Of a pass that no other is like (a ramp), a leap counts from this share of the range on, or from
:data:`OF_FORCE` of the force there …"""
ALONE_IN_PASS = 4.0
"""… if it is so many times the next largest one of the pass."""
TURN = 0.1
"""… and is so far from the ends of the pass, as a share of its stroke: friction turns there."""
SLOWED = 0.1
"""Near a turn where no pass can be compared, a leap counts that friction and speed do not make. Friction that
turns takes from the force where the stroke is greatest and gives to it where it is least: no leap goes the
other way. Nor does it turn within less way than its size over the stiffness of the stiffest specimen
(:data:`bufferstand.evaluation.plausibility.units_and_signs.units.STIFFEST`), nor is a share of the force that
comes of speed let go while the speed changes by less than this part of the fastest on record."""
OF_FORCE, SMALL_SHARE = 0.03, 0.0015
"""A smaller leap counts from this share of the force there on, as a gain that changes at a small force makes
it, if it is this share of the range, and other passes are without it …"""
AT_ONCE = 0.8
"""… and one step from sample to sample makes so much of it: an amplifier is switched at once, what slips
takes its time."""
LONE, LONE_SHARE, LONE_ABOVE = 8.0, 0.012, 0.02
"""In a harmonic run of more than three cycles, a leap of this share of the range (twice the least) counts
wherever it is, if it is so many times the fourth largest, and not within this share of the least force."""
EVEN = 0.5
"""… and the speed of the stroke changes there by less than this share of itself."""
LOADED_SHARE = 0.03
"""At a rest under load, in which friction may let go, and near a turn a leap counts from this share on."""
STIFFER = 2.0
"""Where the stroke leaps, too, the force may change by so many times what the stiffness beside makes."""
AT_TURN = 3
"""So many samples beside a turn are left out where it is asked whether a force rings."""
_MET = 8
_MOST = 3
_LOOKED_AT = 40
_ASIDES = (0.012, 0.004)
"""Shares of the stroke's range beside a leap that are left out of the comparison; the smaller near a turn."""
_STILL_SAMPLES = 40
_STOPPING = 10
_STILL = 5e-5
_STEADY = 0.4


def force_jumps(look: RunView) -> list[Finding]:
    """Return the instants at which the force jumps while neither stroke nor other strokes explain it.

    Parameters
    ----------
    look : Look
    """
    force = look.force
    floor = max(NOISES * force.sampling.sigma, STEPS * force.sampling.step)
    least, small = max(SHARE * force.span, floor), max(SMALL_SHARE * force.span, floor)
    if not may_leap(force, small):
        return []
    leaps = [leap for leap in largest_leaps(force, look.breaks_s, _LOOKED_AT) if not _is_spike(force, leap)]
    if len(leaps) > _LOOKED_AT // 2:
        twentieth = abs(leaps[_LOOKED_AT // 2].size)
        least, small = max(least, ALONE * twentieth), max(small, ALONE * twentieth)
    told = [
        leap
        for leap in leaps
        if abs(leap.size) > max(min(least, max(small, _of_force(force, leap))), _rounded(force, leap))
        and goes_on(force, leap)
        and not _made_by_stroke(look, leap)
        and not any(begun_s <= force.time_s[leap.last] <= end_s for begun_s, end_s in look.frozen_s)
    ]
    if not told:
        return []
    ways = ways_of([result.cycle for result in look.results])
    lone = _lone_size(look, leaps)
    jumps = [
        leap
        for leap in told
        if (_is_lone(look, leap, lone) or _is_jump(look, leap, leaps, ways))
        and (abs(leap.size) > least or _is_beyond(look, leap, ways))
        and not _rings(force, leap, ways)
    ]
    # What jumps again and again is not the measuring chain.
    return [_finding(look, leap) for leap in sorted(jumps)] if len(jumps) <= _MOST else []


def _rings(force: Samples, leap: SampleJump, ways: Sequence[HalfCycle]) -> bool:
    """Say whether the force rings about a leap, away from the turns of its pass."""
    way = _way_of(force, leap, ways)
    if way is None:
        return False
    rows = force.rows(way.start_s, way.end_s)
    return rings(force, leap, slice(rows.start + AT_TURN, rows.stop - AT_TURN))


def _of_force(force: Samples, leap: SampleJump) -> float:
    """Return the share of the force at a leap from which on a small one counts [kN]; infinite: none does."""
    made_at_once = float(np.max(np.abs(np.diff(force.value[leap.first : leap.last + 1]))))
    if made_at_once < AT_ONCE * abs(leap.size):
        return float("inf")
    return OF_FORCE * float(np.max(np.abs(force.value[[leap.first, leap.last]])))


def _is_spike(force: Samples, leap: SampleJump) -> bool:
    """Say whether a leap is into or out of a sample that its neighbours deny."""
    at = int(np.searchsorted(force.lone, leap.first))
    return at < force.lone.size and int(force.lone[at]) <= leap.last


def _rounded(force: Samples, leap: SampleJump) -> float:
    """Return what a converter leaves of a motion [kN]: speeds beside a leap are whole steps of it, too."""
    return (STEPS + leap.last - leap.first) * force.sampling.step


def _made_by_stroke(look: RunView, leap: SampleJump) -> bool:
    """Say whether the stroke leaps there, too, by what makes such a change of force at the stiffness beside.

    A few samples a stroke, a sample that was taken late or again, show the motion as it is nowhere else.
    """
    force, stroke = look.force, look.stroke
    beside = [
        np.arange(max(0, leap.first - BESIDE), leap.first + 1),
        np.arange(leap.last, min(force.time_s.size, leap.last + BESIDE + 1)),
    ]
    across_s = float(force.time_s[leap.last] - force.time_s[leap.first])
    stiffness, made_mm = [], []
    for rows in beside:
        time_s = force.time_s[rows]
        moved_mm, moved_kN = np.diff(stroke.at(time_s)), np.diff(force.value[rows])
        way_mm = float(np.sum(np.abs(moved_mm)))
        stiffness.append(float(np.sum(np.abs(moved_kN))) / way_mm if way_mm > 0.0 else 0.0)
        made_mm.append(across_s * float(np.median(moved_mm / np.diff(time_s))))
    ends_mm = stroke.at(force.time_s[[leap.first, leap.last]])
    step_mm = float(ends_mm[1] - ends_mm[0])
    leapt_mm = abs(step_mm - float(np.clip(step_mm, min(made_mm), max(made_mm))))
    if leapt_mm < NOISES * stroke.sigma:
        return False
    return abs(leap.size) < STIFFER * max(stiffness) * leapt_mm


def _lone_size(look: RunView, leaps: Sequence[SampleJump]) -> float:
    """Return from which size on a leap of a harmonic run is one that neither its turns nor its noise make.

    What turns make they make in every cycle, so that only the first few leaps can be others.
    """
    complete = sum(result.cycle.complete for result in look.results)
    if look.facts.kind != "harmonic" or complete <= _MOST or len(leaps) <= _MOST:
        return float("inf")
    return max(LONE_SHARE * look.force.span, LONE * abs(leaps[_MOST].size))


def _is_lone(look: RunView, leap: SampleJump, least: float) -> bool:
    """Say whether a leap is large beyond all others, in even motion, and not at the least force on record.

    A damper's force leaps where its motion begins and ends.
    """
    force, stroke = look.force, look.stroke
    # Where a specimen is met the force rises over a few samples.
    beside = slice(max(0, leap.first - _MET), leap.last + _MET + 1)
    if _is_pulled(force):
        above_kN = force.ends[1] - float(np.max(force.value[beside]))
    else:
        above_kN = float(np.min(force.value[beside])) - force.ends[0]
    if abs(leap.size) <= least or above_kN <= LONE_ABOVE * force.span:
        return False
    before, after = (
        np.arange(max(0, leap.first - _STILL_SAMPLES // 4), leap.first + 1),
        np.arange(leap.last, min(force.time_s.size, leap.last + _STILL_SAMPLES // 4 + 1)),
    )
    speeds = [
        float(np.polyfit(force.time_s[rows] - force.time_s[leap.first], stroke.at(force.time_s[rows]), 1)[0])
        for rows in (before, after)
        if rows.size > _STILL_SAMPLES // 4
    ]
    fastest = 2.0 * max(abs(speed) for speed in speeds) if speeds else 0.0
    return len(speeds) == 2 and 2.0 * abs(speeds[1] - speeds[0]) < EVEN * fastest


def _is_jump(look: RunView, leap: SampleJump, leaps: Sequence[SampleJump], ways: Sequence[HalfCycle]) -> bool:
    force = look.force
    if _at_rest(look, leap):
        low = float(np.min(np.abs(force.value[[leap.first, leap.last]])))
        loaded = low > UNLOADED * force.span
        return not loaded or abs(leap.size) > LOADED_SHARE * force.span
    way = _way_of(force, leap, ways)
    if way is None:
        return False
    own = pass_of(look, way)
    if not own.force_kN.size or _is_contact(force, leap, way, own) or _stops(look, leap, own):
        return False
    others = others_of(look, ways, way, own)
    if others and (beyond := _beyond(look, leap, own, others)) is not None:
        return beyond
    if _against_friction(look, leap, own) or _has_no_way(look, leap):
        next_kN = _next_largest(look, leap, leaps, ways)
        return abs(leap.size) > max(LOADED_SHARE * force.span, ALONE_IN_PASS * next_kN)
    return not others and _alone_in_pass(look, leap, leaps, way)


def _is_beyond(look: RunView, leap: SampleJump, ways: Sequence[HalfCycle]) -> bool:
    """Say whether other passes, with which it can be compared, are without a leap."""
    way = _way_of(look.force, leap, ways)
    if way is None:
        return False
    own = pass_of(look, way)
    return bool(_beyond(look, leap, own, others_of(look, ways, way, own)))


def _way_of(force: Samples, leap: SampleJump, ways: Sequence[HalfCycle]) -> HalfCycle | None:
    from_s, to_s = float(force.time_s[leap.first]), float(force.time_s[leap.last])
    return next((one for one in ways if one.start_s <= from_s and to_s <= one.end_s), None)


def _against_friction(look: RunView, leap: SampleJump, own: Pass) -> bool:
    """Say whether a leap is near a turn and goes the other way than friction does that turns there."""
    areas_J = look.figures[:, 5]
    at_mm = float(look.stroke.at(look.force.time_s[[leap.first]])[0])
    low_mm, high_mm = float(own.stroke_mm[0]), float(own.stroke_mm[-1])
    near_mm = TURN * (high_mm - low_mm)
    if not areas_J.size:
        return False
    taken = leap.size * float(np.sign(median(areas_J)))
    return (taken > 0.0 and high_mm - at_mm < near_mm) or (taken < 0.0 and at_mm - low_mm < near_mm)


def _has_no_way(look: RunView, leap: SampleJump) -> bool:
    """Say whether neither the way nor the change of speed at a leap could make it, however stiff it be."""
    force, stroke = look.force, look.stroke
    sides = (
        np.arange(max(0, leap.first - _MET), leap.first + 1),
        np.arange(leap.last, min(force.time_s.size, leap.last + _MET + 1)),
    )
    if min(side.size for side in sides) <= _MET:
        return False
    times_s = [force.time_s[side] for side in sides]
    before_mm, after_mm = (stroke.at(one) for one in times_s)
    way_mm = float(abs(np.mean(after_mm[: _MET // 2]) - np.mean(before_mm[-_MET // 2 :])))
    if abs(leap.size) < STIFFEST * (way_mm + stroke.sigma):
        return False
    moved_mm, lasts_s = np.abs(np.diff(stroke.value)), np.diff(stroke.time_s)
    fastest = quantile(moved_mm[lasts_s > 0.0] / lasts_s[lasts_s > 0.0], 0.95)
    slopes = [
        float(np.polyfit(one - one[0], values, 1)[0])
        for one, values in zip(times_s, (before_mm, after_mm), strict=True)
    ]
    return abs(slopes[1] - slopes[0]) < SLOWED * fastest


def _next_largest(
    look: RunView, leap: SampleJump, leaps: Sequence[SampleJump], ways: Sequence[HalfCycle]
) -> float:
    """Return the size of the largest other leap that is no contact [kN]."""
    for other in leaps:  # the largest first
        way = _way_of(look.force, other, ways)
        if other != leap and not (way and _is_contact(look.force, other, way, pass_of(look, way))):
            return abs(other.size)
    return 0.0


def _is_pulled(force: Samples) -> bool:
    """Say whether a force is that of a specimen that is pulled, or of a stroke with the other sign."""
    return -force.ends[0] > PULLED * force.ends[1] and force.ends[0] < 0.0


def _is_contact(force: Samples, leap: SampleJump, way: HalfCycle, own: Pass) -> bool:
    """Say whether a leap is with the motion, and from or to the force at the released end of its pass.

    That is the low one; of a specimen that is pulled, or of a stroke with the other sign, the high one. A
    filter or a force between two rows spreads a contact over more samples than a leap has, and of a stroke
    that is held one sample may be all that its pass has of the release.
    """
    if leap.size * way.way <= 0.0 or not own.force_kN.size:
        return False
    pulled = _is_pulled(force)
    before = (way.way > 0) != pulled
    beside = (
        slice(max(0, leap.first - BESIDE), leap.first + 1)
        if before
        else slice(leap.last, leap.last + BESIDE + 1)
    )
    released_kN = float(np.max(force.value[beside]) if pulled else np.min(force.value[beside]))
    ends_kN = own.force_kN[-3:] if pulled else own.force_kN[:3]
    near_kN = max(abs(leap.size), NOISES * force.sampling.sigma)
    return float(np.min(np.abs(ends_kN - released_kN))) < min(UNLOADED * force.span, near_kN)


def _beyond(look: RunView, leap: SampleJump, own: Pass, others: Sequence[Pass]) -> bool | None:
    """Say whether the force leaves, with a leap, what it is at that stroke in most other passes.

    None: with no pass it can be compared there.
    """
    force, stroke = look.force, look.stroke
    low_mm, high_mm = sorted(stroke.at(force.time_s[[leap.first, leap.last]]).tolist())
    step = float(force.value[leap.last] - force.value[leap.first])
    least = max(AGREE * abs(leap.size), OF_STEP * abs(step))
    for share in _ASIDES:
        sizes = own.way * beyond_others(own, others, (low_mm, high_mm), share * stroke.span)
        if sizes.size:
            return float(np.mean(sizes * np.sign(leap.size) > least)) > MOST_PASSES
    return None


def _stops(look: RunView, leap: SampleJump, own: Pass) -> bool:
    """Say whether the motion stops or starts at a leap, within its pass, and speed may have made it so.

    What of the force comes of the speed is let go against the way, and comes with it, which other passes that
    go on there do not show. It stops, too, where it goes on by less than a tenth (:data:`SLOWED`) of what it
    did: stands creep, and a draw wire's error changes with them.
    """
    force, stroke = look.force, look.stroke
    at_mm = float(stroke.at(force.time_s[[leap.first]])[0])
    near_mm = TURN * float(own.stroke_mm[-1] - own.stroke_mm[0])
    if min(at_mm - float(own.stroke_mm[0]), float(own.stroke_mm[-1]) - at_mm) < near_mm:
        return False
    before_mm, after_mm = (
        _goes_on_by(own.way * stroke.at(force.time_s[side]))
        for side in (
            slice(max(0, leap.first - _STILL_SAMPLES), max(0, leap.first - _STOPPING)),
            slice(leap.last + _STOPPING, leap.last + _STILL_SAMPLES),
        )
    )
    noise_mm = max(stroke.sampling.sigma, 0.25 * stroke.sampling.step, _STILL * stroke.span)
    before = before_mm <= max(noise_mm, SLOWED * after_mm)
    after = after_mm <= max(noise_mm, SLOWED * before_mm)
    return before != after and (leap.size * own.way > 0.0) == before


def _goes_on_by(values_mm: FloatArray) -> float:
    """Return by how much a stretch of the stroke, positive along its pass, goes on; too short: NaN."""
    third = values_mm.size // 3
    return median(values_mm[-third:]) - median(values_mm[:third]) if third else float("nan")


def _alone_in_pass(look: RunView, leap: SampleJump, leaps: Sequence[SampleJump], way: HalfCycle) -> bool:
    """Say whether a leap of a pass that no other is like, away from its turns, stands out from all others."""
    force = look.force
    from_s, to_s = float(force.time_s[leap.first]), float(force.time_s[leap.last])
    ends_mm = look.stroke.at(np.array([way.start_s, from_s, to_s, way.end_s]))
    near_mm = TURN * abs(float(ends_mm[3] - ends_mm[0]))
    if np.min(np.abs(ends_mm[1:3, None] - ends_mm[None, [0, 3]])) < near_mm:
        return False
    noise_kN = NOISES * force.sampling.sigma
    within = [
        abs(other.size)
        for other in leaps
        if other != leap
        and abs(other.size) > noise_kN
        and way.start_s <= force.time_s[other.first] <= way.end_s
        and _is_loaded(look, other, way)
    ]
    least = min(ALONE_SHARE * force.span, _of_force(force, leap))
    return abs(leap.size) > max(least, ALONE_IN_PASS * max(within, default=0.0))


def _is_loaded(look: RunView, leap: SampleJump, way: HalfCycle) -> bool:
    """Say whether a leap is away from the low end of its pass, at which a specimen is met or left."""
    near_mm = TURN * abs(float(np.ptp(look.stroke.at(np.array([way.start_s, way.end_s])))))
    low_s = way.start_s if way.way > 0 else way.end_s
    at_s = look.force.time_s[[leap.first, leap.last]]
    low_mm = float(look.stroke.at(np.array([low_s]))[0])
    return bool(np.min(np.abs(look.stroke.at(at_s) - low_mm)) > near_mm)


def _at_rest(look: RunView, leap: SampleJump) -> bool:
    """Say whether stroke and force stand still on both sides of a leap."""
    force, stroke = look.force, look.stroke
    sides = (
        slice(max(0, leap.first - _STILL_SAMPLES), leap.first + 1),
        slice(leap.last, leap.last + _STILL_SAMPLES + 1),
    )
    before_mm, after_mm = (stroke.at(force.time_s[side]) for side in sides)
    if min(before_mm.size, after_mm.size) <= _STILL_SAMPLES:
        return False
    noise_mm = max(stroke.sampling.sigma, 0.25 * stroke.sampling.step, _STILL * stroke.span)
    third = _STILL_SAMPLES // 3
    moved_mm = abs(median(after_mm[-third:]) - median(before_mm[:third]))
    if moved_mm > noise_mm or max(float(np.ptp(before_mm)), float(np.ptp(after_mm))) > 8.0 * noise_mm:
        return False
    return max(float(np.ptp(force.value[side])) for side in sides) < _STEADY * abs(leap.size)


def _finding(look: RunView, leap: SampleJump) -> Finding:
    force = look.force
    at_s, end_s = float(force.time_s[leap.first]), float(force.time_s[-1])
    size = look.sign * leap.size
    text = (
        f"force jumps by {size:+.3g} kN at {at_s:.6g} s, within {leap.last - leap.first} samples, "
        "which neither the stroke nor the other strokes explain: gain or offset of the amplifier changed, or "
        "the specimen did (a crack), and which of both sides is right is not on record: repeat the test"
    )
    kind: FindingKind = "offset-jump" if _at_rest(look, leap) else "gain-jump"
    return Finding(kind, "force", at_s, end_s, look.all_cycles, size, "kN", text, "spoils")
