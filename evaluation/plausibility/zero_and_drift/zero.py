"""The force's zero: off where nothing is loaded, or moving between rests at one stroke."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Finding, FindingKind
from bufferstand.evaluation.loops import first_shown
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import RunView, pass_of, ways_of
from bufferstand.evaluation.plausibility.zero_and_drift.rests import ALIKE_MM, UnloadedRest, rests_of
from bufferstand.foundation.numbers import median

LEAST = 0.003
"""A zero that is off by less than this share of the range of the force is none, whatever is stated: a cell
returns to its zero no better after a load."""
UNSTATED = 0.005
"""Share of the range by which it is off where the channel states no zero: beyond what machines of class 2
are allowed (ISO 7500-1: 0.2 %), and as much again and more for guides that rub …"""
UNSTATED_DRIFT = 0.01
"""… and by which it moves."""
IN_CONTACT = 0.02
"""Share of the range by which it moves where the specimen is in contact, from its first unloading on."""
FREE_MM = 0.15
"""So far before first contact nothing is loaded."""
SURE = 6.0
SINGLE = ("impact", "proof")
"""Kinds of runs of one event: their rests are one before and one after it."""
DRIFTS = 0.4
"""A drift moves the level within the rests, too: by this share of what their time would have it."""
FASTER = 2.0
"""A drift that is so many times as fast between two rests as in any of them, beyond its pace, is a jump."""

WAY_IN = 0.1
"""Two ways in are compared over this share of their stroke, where a specimen softens by little …"""
CAME_DOWN = 0.5
"""… and the first is above by a jump if it is so by this share of it."""


def zero_of_force(look: RunView, jumps: Sequence[Finding] = ()) -> list[Finding]:
    """Return whether the force of a static run is off where nothing is loaded, or moves between its rests.

    Of an impact or a proof load only what it does from the rest before to the one after it is told.

    Parameters
    ----------
    look : Look
    jumps : sequence of Finding
        Jumps of its stroke.

    Returns
    -------
    list of Finding
        ``zero``, ``drift`` (the level moves in the rests, too) or ``offset-jump`` (it does not).
    """
    if look.facts.kind not in ("static", *SINGLE):
        return []
    rests = rests_of(look, jumps)
    if not rests:
        return []
    over = _over_first_stroke(look, rests)
    if look.facts.kind in SINGLE:
        if over is not None:
            return [over]
        begins = look.results[0].cycle.start.leave_s
        rested = any(rest.times_s[1] <= begins for rest in rests)
        return [] if rested or _is_pulled(look) else _off(look, rests, lambda: False)
    moving = _moving_in(look, rests, look.results[0].cycle.top.time_s)
    if not moving and over is not None:
        moving = [over]
    return moving or _off(look, rests, lambda: _free(look, rests) or _before_contact(look, rests, jumps))


def zero_beside_turned_stroke(look: RunView, jumps: Sequence[Finding] = ()) -> list[Finding]:
    """Return the same of a static run where its stroke, whose sign is wrong, is least."""
    rests = rests_of(look, jumps, turned=True) if look.facts.kind == "static" else []
    if not rests:
        return []
    moving = _moving_in(look, rests, look.results[0].cycle.start.time_s, sign=look.sign)
    return moving or _off(look, rests, lambda: _free(look, rests))


def _moving_in(
    look: RunView, rests: list[UnloadedRest], loaded_s: float, *, sign: float = 1.0
) -> list[Finding]:
    """Return how the zero moves between rests, and within them; first loaded is the specimen at ``loaded_s``.

    In contact, a specimen that was never loaded pushes otherwise than one that was unloaded. But none pulls:
    ``sign`` makes of a level a force that pushes.
    """
    pulls = min(sign * level for rest in rests for level in rest.levels_kN) < -_limit(look, UNSTATED)
    if pulls or _free(look, rests):
        return _moving(look, rests)
    unloaded = [rest for rest in rests if rest.times_s[0] > loaded_s]
    return _moving(look, unloaded) if len(unloaded) > 1 else []


def _off(look: RunView, rests: list[UnloadedRest], is_free: Callable[[], bool]) -> list[Finding]:
    """Return a zero that is off by the level of rests; whether nothing is loaded in them is asked last."""
    level = look.sign * median([level for rest in rests for level in rest.levels_kN])
    sure = SURE * max(rest.u_kN for rest in rests)
    # At first contact a preload may rest on the cell; a specimen never pulls at it.
    if abs(level) <= _limit(look, UNSTATED) + sure or not (level < 0.0 or is_free()):
        return []
    text = (
        f"force zero off: the force is {level:+.3g} kN at rest without contact ({_stated(look)}); all "
        "forces and energies have it in them: set the zero with the specimen released and repeat the test"
    )
    return [_finding(look, "zero", level, text)]


def zero_in_wrong_unit(look: RunView, jumps: Sequence[Finding] = ()) -> list[Finding]:
    """Return the same of a run whose unit is wrong: what its channel states is no measure of it then."""
    return zero_of_force(replace(look, facts=replace(look.facts, force_uncertainty=None)), jumps)


def _finding(look: RunView, kind: FindingKind, size: float, text: str) -> Finding:
    start_s, end_s = float(look.force.time_s[0]), float(look.force.time_s[-1])
    return Finding(
        kind, "force", start_s, end_s, look.all_cycles, size, "kN", text, "spoils", whole_record=True
    )


def _free(look: RunView, rests: list[UnloadedRest]) -> bool:
    """Say whether nothing is loaded at rests, wherever within its stated limit the stroke's zero is."""
    zero_mm = max((wire.zero or 0.0 for wire in look.facts.stroke_uncertainty), default=0.0)
    return all(rest.stroke_mm < -FREE_MM - zero_mm for rest in rests)


def _before_contact(look: RunView, rests: list[UnloadedRest], jumps: Sequence[Finding]) -> bool:
    """Say whether the specimen is met behind the rests, wherever the zero of the stroke is."""
    jumped_s = min((one.start_s for one in jumps), default=np.inf)
    met = first_shown(look.record, [result.cycle for result in look.results], jumped_s=jumped_s)
    if met.stroke_mm is None or met.expanded_uncertainty is None:
        return False
    nearest_mm = met.stroke_mm - met.expanded_uncertainty
    return all(rest.stroke_mm < nearest_mm for rest in rests)


def _limit(look: RunView, unstated: float, *, free: bool = True) -> float:
    """Return by how much the zero may be off [kN]."""
    stated = look.facts.force_uncertainty
    if not free:
        return IN_CONTACT * look.force.span
    if stated is None or stated.zero is None:
        return unstated * look.force.span
    return max(stated.zero, LEAST * look.force.span)


def _stated(look: RunView) -> str:
    stated = look.facts.force_uncertainty
    if stated is None or stated.zero is None:
        return "the channel states no zero"
    return f"the channel states ±{stated.zero:.3g} kN"


def _moving(look: RunView, rests: list[UnloadedRest]) -> list[Finding]:
    """Return a zero that moves at rest: all the time, at once, or both."""
    times = np.array([rest.times_s for rest in rests]).ravel()
    levels = np.array([rest.levels_kN for rest in rests]).ravel()
    sure = 2.0 * SURE * max(rest.u_kN for rest in rests)
    least = _limit(look, UNSTATED_DRIFT, free=_free(look, rests)) + sure
    if float(np.ptp(levels)) <= least:
        return []
    change, lasts = np.diff(levels), np.diff(times)
    at = int(np.argmax(np.abs(change)))
    others = np.arange(change.size) != at
    all_along = _drifts(change, lasts, np.ones(change.size, dtype=bool), least)
    besides = _drifts(change, lasts, others, least)
    if all_along and not (besides and _leaps(change, lasts, at, least)):
        return [_drift(look, levels[0], levels[-1])]
    size = float(levels[-1] - levels[0])
    found = [_jump(look, times[at : at + 2].tolist(), levels[at : at + 2].tolist(), size)]
    if besides:
        found.append(_drift(look, levels[0], float(levels[0] + np.sum(change[others])), besides=True))
    return found


def _leaps(change: FloatArray, lasts: FloatArray, at: int, least: float) -> bool:
    """Say whether a change is more than a zero makes at its pace in the rests, or twice the fastest one."""
    paces = change[::2] / np.maximum(lasts[::2], 1e-9)
    beyond = change[at] - float(np.sum(change[::2]) / np.sum(lasts[::2])) * lasts[at]
    return bool(at % 2 and abs(beyond) > max(least, FASTER * float(np.max(np.abs(paces))) * lasts[at]))


def _drifts(change: FloatArray, lasts: FloatArray, counted: NDArray[np.bool_], least: float) -> bool:
    """Say whether the changes that count are those of a drift: more than the least, and in the rests, too.

    Changes and what they last are those in a rest and from it to the next one by turns.
    """
    moved = float(np.ptp(np.append(0.0, np.cumsum(change[counted]))))
    resting = counted & (np.arange(change.size) % 2 == 0)
    within = float(np.sum(np.abs(change[resting])))
    expected = moved * float(np.sum(lasts[resting])) / max(float(np.sum(lasts[counted])), 1e-9)
    return moved > least and within > DRIFTS * expected


def _drift(look: RunView, first_kN: float, last_kN: float, *, besides: bool = False) -> Finding:
    first_kN, last_kN = look.sign * first_kN, look.sign * last_kN
    text = (
        f"force drifts: at rest at one stroke it is {first_kN:+.3g} kN first and {last_kN:+.3g} kN "
        f"at last{', without its jump' if besides else ''} ({_stated(look)}): let cell and amplifier settle, "
        "and repeat the test"
    )
    return _finding(look, "drift", float(last_kN - first_kN), text)


def _jump(look: RunView, times_s: Sequence[float], levels_kN: Sequence[float], size: float) -> Finding:
    from_s, to_s = times_s
    before_kN, after_kN = (look.sign * level for level in levels_kN)
    text = (
        f"force offset jumps between {from_s:.6g} and {to_s:.6g} s: unloaded at one stroke it is "
        f"{before_kN:+.3g} kN before and {after_kN:+.3g} kN after ({_stated(look)}): look for a loose "
        "plug or an amplifier that was set, and repeat the test"
    )
    cycles = look.all_cycles
    return Finding("offset-jump", "force", from_s, to_s, cycles, look.sign * size, "kN", text, "spoils")


def _over_first_stroke(look: RunView, rests: Sequence[UnloadedRest]) -> Finding | None:
    """Return a jump over the first stroke that no specimen makes of the force at rest at one stroke.

    It may push less than before, as it recovers. But it does not pull where it did not at rest before; nor
    does it push more than it did on its first way in, up to a little further than where it rests now. What
    the zero was before the motion, where the record begins with that, is told by the next way in: a zero
    that was off all along is so in both.
    """
    first = look.results[0].cycle
    before = [rest for rest in rests if rest.times_s[1] <= first.start.leave_s]
    after = [rest for rest in rests if rest.times_s[0] >= first.end.time_s]
    if not after or _is_pulled(look):
        return None
    two, met_kN = after[0], _met(look, after[0].stroke_mm + ALIKE_MM)
    rested = bool(before)
    if not rested:  # the record begins with the motion, or within it
        begun_s = first.start.time_s
        before = [UnloadedRest(two.stroke_mm, (begun_s, begun_s), (met_kN, met_kN), two.u_kN)]
    one = before[-1]
    was, is_now = one.levels_kN[1], two.levels_kN[0]
    limit = _limit(look, UNSTATED, free=_free(look, [one, two])) + SURE * (one.u_kN + two.u_kN)
    pulls = is_now < -limit and was - is_now > limit and (rested or _came_down(look, is_now))
    if not np.isfinite(was) or (not pulls and is_now - max(was, met_kN) <= limit):
        return None
    return _jump(look, (one.times_s[1], two.times_s[0]), (was, is_now), is_now - was)


def _came_down(look: RunView, is_now_kN: float) -> bool:
    """Say whether the first way in, where it begins, was above the next one by most of what pulls now."""
    loadings = [way for way in ways_of([result.cycle for result in look.results]) if way.way > 0][:2]
    passes = [one for one in (pass_of(look, way) for way in loadings) if one.stroke_mm.size]
    if len(passes) < 2:
        return False
    low_mm = max(float(one.stroke_mm[0]) for one in passes)
    high_mm = min(float(one.stroke_mm[-1]) for one in passes)
    at_mm = low_mm + WAY_IN * (high_mm - low_mm) * np.linspace(0.2, 1.0, 20)
    first, later = (np.interp(at_mm, one.stroke_mm, one.force_kN) for one in passes)
    return bool(np.median(first - later) > CAME_DOWN * -is_now_kN)


def _is_pulled(look: RunView) -> bool:
    """Say whether the force is that of a specimen that is pulled."""
    low_kN, high_kN = look.force.ends
    return -low_kN > high_kN


def _met(look: RunView, up_to_mm: float) -> float:
    """Return the greatest force on the way into the first stroke, up to a stroke [kN]."""
    first = look.results[0].cycle
    rows = look.stroke.rows(first.start.leave_s, first.top.time_s)
    moments_s = look.stroke.time_s[rows][look.stroke.value[rows] <= up_to_mm]
    return float(np.max(look.force.at(moments_s), initial=-np.inf))
