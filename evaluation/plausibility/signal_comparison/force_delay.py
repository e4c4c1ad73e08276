"""Finds a force that is later than the stroke.

The force of a specimen that absorbs energy falls as soon as the stroke turns. A force that goes on rising
after that is late: a filter, or a wrong ``delay_s``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.facts import Cycle, CycleResult, Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.as_finding import SETTING, doubt
from bufferstand.evaluation.plausibility.signal_comparison.signal_fit import fitted, lateness
from bufferstand.evaluation.plausibility.units_and_signs import force_falls
from bufferstand.evaluation.record import Record
from bufferstand.foundation.numbers import median

KINDS = ("static", "harmonic")
"""An impact has a mass behind it, whose force is not the specimen's alone."""
RISE = 0.02
"""After the turn the force rises by more than this share of the cycle's range …"""
MOST = 0.6
"""… in so many of the cycles."""
LEAST_LATE_S, LEAST_STEPS = 0.02, 2.0
"""A force that is late by less, or by fewer steps of the sampling, is not told."""
TOP_NOISES, TOP_SHARE = 4.0, 0.0005
"""The stroke is at its top within so many standard deviations of its noise, or this share of its range."""
DWELL_STEPS = 3.0
"""A dwell of fewer steps of the sampling is none."""
UPPER = 0.5
"""At the upper turn the force is in the upper part of its range."""
BETTER, PROPER = 0.4, 0.5
"""Shifted, the force follows the stroke so much better, where it follows it badly as it is."""
_FEWEST, _LOOKED_AT, _MOST_TURNS = 100, 8000, 400
_LOST = ("clipped", "frozen")


def late_force(look: RunView, known: Iterable[Finding] = ()) -> list[Finding]:
    """Return by how much the force is late, where the record shows it.

    Parameters
    ----------
    look : Look
        Of an impact, and of a record without cycles, nothing can be told.
    known : iterable of Finding
        What else was found. Cycles in which a channel is clipped or frozen may have lost their turn, or the
        force's peak.
    """
    if look.facts.kind not in KINDS or look.record.time_s.size < _FEWEST:
        return []
    known = list(known)
    least_s = max(LEAST_LATE_S, LEAST_STEPS * median(np.diff(look.record.time_s)))
    cut = {number for one in known if one.kind in _LOST for number in one.cycles}
    complete = [r for r in look.results if r.cycle.complete and r.cycle.index not in cut]
    size_s = _late_s(look, complete, least_s, shifts=not cut)
    if size_s is None or _is_sound_turned(look, known, complete, least_s):
        return []
    text = (
        f"the force comes about {size_s:.2g} s later than the stroke that makes it: it goes on rising when "
        f"the specimen is let go already; look at delay_s of the channel “force” in {SETTING} and at "
        "the filter of its amplifier"
    )
    if _gives_off_energy(complete):
        text += "; or its sign is turned, as the loops run the wrong way round (--invert force)"
    return [doubt(look, "delay", "force", size_s, "s", text)]


def _late_s(look: RunView, complete: Sequence[CycleResult], least_s: float, *, shifts: bool) -> float | None:
    """Return by how much the force of some cycles is late [s]; None: it is not, or by less."""
    every = max(1, -(-len(complete) // _MOST_TURNS))
    turns = _after_turns(look, complete[::every])
    late = [turn.late_s for turn in turns if turn.rise > RISE and turn.behind_s > least_s]
    if late and len(late) >= MOST * len(turns):
        return median(late)
    return _by_shift(look.record, least_s) if shifts else None


def _is_sound_turned(
    look: RunView, known: Iterable[Finding], complete: Sequence[CycleResult], least_s: float
) -> bool:
    """Say whether the force is that of a sound specimen with the other sign, and need not be late for it.

    A damper's, whose loops are as wide as they are high, then comes half a cycle late. A spring's with the
    other sign falls with loading: one whose loops run backwards for a delay is no such one.
    """
    if not any(one.kind == "sign" for one in known):
        return False
    turned = look.with_force_turned()
    return not force_falls(turned) and _late_s(turned, complete, least_s, shifts=True) is None


def _by_shift(record: Record, least_s: float) -> float | None:
    """Return by how much the force must be earlier to follow the stroke as it should [s]; None: it does."""
    every = -(-record.time_s.size // _LOOKED_AT)
    time_s, stroke, force = (column[::every] for column in (record.time_s, record.stroke_mm, record.force_kN))
    now = fitted(stroke, force)
    if now is None or now.left <= PROPER:
        return None
    late = lateness(time_s, stroke, force, least_s)
    if late is None or late[0] < least_s or late[1].factor <= 0.0 or late[1].left > BETTER * now.left:
        return None
    return late[0]


def _gives_off_energy(results: Sequence[CycleResult]) -> bool:
    """Say whether most loops run the wrong way round: a damper's do whose force has the other sign."""
    areas = [area for result in results if (area := result.quantities.absorbed_energy_J) is not None]
    return bool(areas) and median(areas) < 0.0


class _Turn(NamedTuple):
    """By how much of its range the force rises after an upper turn, how long [s], and how late it is [s].

    It rises beyond all that it was before the turn: one that only comes back swings, as a grip's mass does.
    """

    rise: float
    behind_s: float
    late_s: float


def _after_turns(look: RunView, results: Sequence[CycleResult]) -> list[_Turn]:
    """Return what the force does after upper turns; nothing of those that say nothing of its lateness."""
    record = look.record
    known = [
        (result.cycle, look.sign * own.force_min_kN, look.sign * own.force_max_kN)
        for result in results
        if (own := result.quantities).force_max_kN is not None and own.force_min_kN is not None
    ]
    figures = [
        (
            cycle.start.leave_s,
            cycle.top.leave_s,
            cycle.end.time_s,
            min(one_kN, other_kN),
            max(one_kN, other_kN),
        )
        for cycle, one_kN, other_kN in known
    ]
    start_s, leave_s, end_s, least_kN, most_kN = np.array(figures, dtype=np.float64).reshape(-1, 5).T
    range_kN = most_kN - least_kN
    begins, first = np.searchsorted(record.time_s, (start_s, leave_s))
    last = np.searchsorted(record.time_s, end_s, side="right")
    at_turn = np.interp(leave_s, record.time_s, record.force_kN)
    # Less at the turn: of the other sign, or by more than a quarter of the cycle.
    tells = (range_kN > 0.0) & (last - first >= 5) & (at_turn - least_kN >= UPPER * range_kN)
    turns = []
    for row in np.flatnonzero(tells).tolist():
        peak = int(first[row]) + int(record.force_kN[first[row] : last[row]].argmax())
        loading = record.force_kN[begins[row] : first[row]]
        before_kN = max(float(at_turn[row]), float(np.max(loading, initial=-np.inf)))
        rise = (float(record.force_kN[peak]) - before_kN) / float(range_kN[row])
        behind_s = float(record.time_s[peak] - leave_s[row])
        held_s = _held_later_s(record, known[row][0], look.stroke.sigma) if rise > RISE else 0.0
        turns.append(_Turn(rise, behind_s, held_s if held_s > 0.0 else behind_s))
    return turns


def _held_later_s(record: Record, cycle: Cycle, noise_mm: float) -> float:
    """Return by how much later than the stroke the force dwells at its top [s]; 0: the stroke does not.

    A force relaxes in its dwell, which is the stretch as long as the stroke's in which it is greatest on
    average.
    """
    rows = slice(*np.searchsorted(record.time_s, (cycle.start.leave_s, cycle.end.time_s)).tolist())
    time_s, force, stroke = (col[rows] for col in (record.time_s, record.force_kN, record.stroke_mm))
    begins_s, ends_s = cycle.top.time_s, cycle.top.leave_s
    if ends_s <= begins_s:
        begins_s, ends_s = _at_top_s(time_s, stroke, max(TOP_NOISES * noise_mm, TOP_SHARE * cycle.range_mm))
    begins = time_s[time_s + (ends_s - begins_s) <= time_s[-1]]
    if ends_s - begins_s < DWELL_STEPS * median(np.diff(time_s)) or not begins.size:
        return 0.0
    area = np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(time_s)))
    within = np.interp(begins + (ends_s - begins_s), time_s, area) - area[: begins.size]
    return float(begins[int(np.argmax(within))]) - begins_s


def _at_top_s(time_s: FloatArray, stroke: FloatArray, depth_mm: float) -> tuple[float, float]:
    """Return from when to when a stroke is at its top [s], without the flanks.

    Those are twice as long to twice the depth, which takes them off.
    """
    near, further = (np.flatnonzero(stroke >= np.max(stroke) - k * depth_mm)[[0, -1]] for k in (1, 2))
    begins_s, ends_s = (2.0 * time_s[near] - time_s[further]).tolist()
    return begins_s, ends_s
