"""Jumps of both channels and the zero of the force: what a measuring chain does, at once or by and by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from bufferstand.evaluation.cycles import SLIPPED
from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.plausibility.jumps.jumps_of_force import force_jumps
from bufferstand.evaluation.plausibility.jumps.level_changes import level_jumps
from bufferstand.evaluation.plausibility.jumps.moved_contact import contact_moved
from bufferstand.evaluation.plausibility.jumps.sample_steps import (
    SampleJump,
    goes_on,
    largest_leaps,
    may_leap,
)
from bufferstand.evaluation.plausibility.run_view import RunView, Samples
from bufferstand.evaluation.plausibility.zero_and_drift import (
    drift_of_loops,
    zero_beside_turned_stroke,
    zero_in_wrong_unit,
    zero_of_force,
)
from bufferstand.foundation.numbers import quantile

SHARE = 0.01
"""A jump of the stroke is at least this share of its range …"""
NOISES, STEPS = 8.0, 2.0
"""… so many standard deviations of its noise, so many steps of its converter …"""
ALONE = 3.0
"""… and so many times the next largest leap, but for two that may be jumps themselves."""
OF_NOISE, ALONE_OF_NOISE = 12.0, 2.0
"""… but twice that one, where noise makes it: of ten thousand samples its fourth largest leap is up to 12
standard deviations, and the largest hardly more."""
COARSE = 0.06
"""Where the record's own speed makes more than this share of the range from sample to sample (fewer than 50
samples a cycle), nothing is looked for."""
ALONG, ALONG_SHARE = 2.0, 0.5
"""A force that leaps with the stroke was moved: by so many times what it moves before and after, and by this
share of what the stroke's leap is of its range. A wire that slips moves no specimen."""
_BESIDE_JUMPS = ("zero", "drift")
_MOST = 3
_LOOKED_AT = _MOST + 3
_STEPS_LOOKED_AT = 20_000


def jumps(look: RunView) -> list[Finding]:
    """Return jumps of the stroke and of the force, and a force whose zero is off or moves.

    One fault shows in several ways, of which the most direct is told: the instant of a jump, else the force
    at rests (beside a jump, a zero that is off or drifts), else what changes from cycle to cycle. The force
    is compared with the stroke, and that of other cycles, which a stroke that jumped is not fit for.

    Parameters
    ----------
    look : Look

    Returns
    -------
    list of Finding
        ``size`` is in mm or kN, of a gain that changed between cycles its ratio.
    """
    return _jumps(look, zero_of_force)


def jumps_in_newtons(look: RunView) -> list[Finding]:
    """Return those that a wrong unit of the force leaves: limits stated in kN say nothing then.

    What of loops that move is within the stated zero is not known.
    """
    return _jumps(look, zero_in_wrong_unit, loops=False)


def jumps_of_turned_stroke(look: RunView) -> list[Finding]:
    """Return those that a wrong sign of the stroke leaves: its highest place is the release then."""
    return _jumps(look, zero_beside_turned_stroke)


def jumps_in_metres(look: RunView) -> list[Finding]:
    """Return those that a wrong unit of the stroke or sign of the force leaves: of rests, drifts alone."""
    return _jumps(look, _drift_in_metres)


def _drift_in_metres(look: RunView, found: Sequence[Finding]) -> list[Finding]:
    return [one for one in zero_in_wrong_unit(look, found) if one.kind == "drift"]


def _jumps(
    look: RunView, at_rests: Callable[[RunView, Sequence[Finding]], list[Finding]], *, loops: bool = True
) -> list[Finding]:
    """Return jumps, what rests tell of the zero, and of a harmonic run what ``loops`` tell of it."""
    found = stroke_jumps(look)
    if not found and (moved := contact_moved(look)) is not None:
        found = [moved]
    zero = at_rests(look, found)
    if found:
        return [*found, *(one for one in zero if one.kind in _BESIDE_JUMPS)]
    found = force_jumps(look)
    if found:  # a force that drifts meets a preload at another force every time: one may come of the other
        return [*found, *(one for one in zero if one.kind == "drift")]
    if any(one.kind == "offset-jump" for one in zero):
        return zero
    return _with_gains(look, zero) or (drift_of_loops(look) if loops else [])


def _with_gains(look: RunView, zero: list[Finding]) -> list[Finding]:
    """Return what is wrong with the force's zero, and what changes from cycle to cycle besides.

    A zero that is off or wanders moves both ends of a loop, but not its range.
    """
    return [*zero, *(one for one in level_jumps(look) if not zero or one.kind == "gain-jump")]


def stroke_jumps(look: RunView) -> list[Finding]:
    """Return the jumps of the stroke, of each draw wire by itself."""
    return [
        _of_stroke(look, channel, leap) for channel in look.strokes for leap in _stroke_leaps(look, channel)
    ]


def slips_s(look: RunView) -> tuple[float, ...]:
    """Return when the stroke jumps [s], where a jump makes strokes that are none.

    It does where it goes against the motion: then two turning points lie next to each other.

    Parameters
    ----------
    look : Look
        With its cycles as they were found before.
    """
    cut_short = (
        after.index - before.index <= SLIPPED
        for cycle in (result.cycle for result in look.results if not result.cycle.complete)
        for before, after in pairwise((cycle.start, cycle.top, cycle.end))
    )
    if not any(cut_short):
        return ()
    return tuple(finding.start_s for finding in stroke_jumps(look))


def _stroke_leaps(look: RunView, channel: Samples) -> list[SampleJump]:
    """Return the leaps that no motion of the record comes near to, in order of time."""
    if not may_leap(channel, SHARE * channel.span):
        return []
    sampling = channel.sampling
    least = max(SHARE * channel.span, NOISES * sampling.sigma, STEPS * sampling.step)
    if not may_leap(channel, least):
        return []
    leaps = largest_leaps(channel, look.breaks_s, _LOOKED_AT)
    if len(leaps) > _MOST:
        usual = abs(leaps[_MOST].size)
        least = max(least, (ALONE_OF_NOISE if usual < OF_NOISE * sampling.sigma else ALONE) * usual)
    fast = _fast(channel)
    found = []
    for leap in leaps[:_MOST]:
        moves = fast * float(channel.time_s[leap.last] - channel.time_s[leap.first])
        leaps_alone = abs(leap.size) > max(least, moves) and moves < COARSE * channel.span
        if leaps_alone and goes_on(channel, leap) and not _moves_force(look, channel, leap):
            found.append(leap)
    return sorted(found)


def _moves_force(look: RunView, channel: Samples, leap: SampleJump) -> bool:
    """Say whether the force leaps with a stroke: a machine goes from step to step as fast as it can."""
    width = leap.last - leap.first
    rows = np.array([leap.first - 2 * width, leap.first - width, leap.last + width, leap.last + 2 * width])
    if rows[0] < 0 or rows[-1] >= channel.value.size:
        return False
    before_kN, own_kN, after_kN = np.abs(np.diff(look.force.at(channel.time_s[rows]))).tolist()
    usual_kN = 3.0 * max(before_kN, after_kN)  # in three times as long
    share_kN = abs(leap.size) / channel.span * look.force.span
    least_kN = max(ALONG * usual_kN, ALONG_SHARE * share_kN, NOISES * look.force.sigma)
    return bool(own_kN > least_kN)


def _fast(channel: Samples) -> float:
    """Return the speed that only one step in twenty exceeds [mm/s]."""
    every = -(-channel.value.size // _STEPS_LOOKED_AT)
    moved = np.abs(channel.value[1::every] - channel.value[:-1:every])
    lasts_s = channel.time_s[1::every] - channel.time_s[:-1:every]
    return quantile(moved[lasts_s > 0.0] / lasts_s[lasts_s > 0.0], 0.95)


def _of_stroke(look: RunView, channel: Samples, leap: SampleJump) -> Finding:
    at_s, end_s = float(channel.time_s[leap.first]), float(channel.time_s[-1])
    text = (
        f"{channel.name} jumps by {leap.size:+.3g} mm at {at_s:.6g} s, within {leap.last - leap.first} "
        "samples, and stays there: no motion of the record is as fast; a draw wire slipped or a plug was "
        "loose: the zero is lost from there on, repeat the test"
    )
    touched = look.touched(at_s, end_s)
    return Finding("stroke-jump", channel.name, at_s, end_s, touched, leap.size, "mm", text, "spoils")
