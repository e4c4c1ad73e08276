"""A force that comes later than the stroke that makes it.

A specimen that takes up energy pushes back the less as soon as it is let go: its force never goes on rising
after the stroke has turned. What does is late: a filter, or a wrong ``delay_s``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evaluation.plausibility.finding import Finding
from evaluation.plausibility.look import Look
from evaluation.record import Record
from evaluation.results import CycleResult
from evaluation.wiring.fit import fitted, lateness
from evaluation.wiring.words import SETTING, doubt
from foundation.ranks import median

KINDS = ("static", "harmonic")
"""An impact has a mass behind it, whose force is not the specimen's alone."""
RISE = 0.02
"""After the turn the force rises by more than this share of the cycle's range …"""
MOST = 0.6
"""… in so many of the cycles."""
LEAST_LATE_S, LEAST_STEPS = 0.02, 2.0
"""A force that is late by less, or by fewer steps of the sampling, is not told."""
UPPER = 0.5
"""At the upper turn the force is in the upper part of its range."""
BETTER, PROPER = 0.4, 0.5
"""Shifted, the force follows the stroke so much better, where it follows it badly as it is."""
_FEWEST, _LOOKED_AT = 100, 8000


def late_force(look: Look) -> list[Finding]:
    """Return by how much the force is late, where the record shows it.

    Parameters
    ----------
    look : Look
        Of an impact, and of a record without cycles, nothing can be told.
    """
    record = look.record
    if look.facts.kind not in KINDS or record.time_s.size < _FEWEST:
        return []
    least_s = max(LEAST_LATE_S, LEAST_STEPS * median(np.diff(record.time_s)))
    complete = [result for result in look.results if result.cycle.complete]
    turns = _after_turns(record, complete)
    late = [turn.late_s for turn in turns if turn.rise > RISE and turn.late_s > least_s]
    size_s = median(late) if late and len(late) >= MOST * len(turns) else _by_shift(record, least_s)
    if size_s is None:
        return []
    text = (
        f"the force comes about {size_s:.2g} s later than the stroke that makes it: it goes on rising when "
        f"the specimen is let go already; look at delay_s of the channel “force” in {SETTING} and at "
        "the filter of its amplifier"
    )
    return [doubt(look, "delay", "force", size_s, "s", text)]


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


class _Turn(NamedTuple):
    """By how much of its range the force rises after an upper turn, and for how long [s]."""

    rise: float
    late_s: float


def _after_turns(record: Record, results: Sequence[CycleResult]) -> list[_Turn]:
    """Return what the force does after upper turns; nothing of those that say nothing of its lateness."""
    figures = [
        (result.cycle.top.leave_s, result.cycle.end.time_s, own.force_min_kN, own.force_max_kN)
        for result in results
        if (own := result.quantities).force_max_kN is not None and own.force_min_kN is not None
    ]
    leave_s, end_s, least_kN, most_kN = np.array(figures, dtype=np.float64).reshape(-1, 4).T
    range_kN = most_kN - least_kN
    first = np.searchsorted(record.time_s, leave_s)
    last = np.searchsorted(record.time_s, end_s, side="right")
    at_turn = np.interp(leave_s, record.time_s, record.force_kN)
    # Less at the turn: of the other sign, or by more than a quarter of the cycle.
    tells = (range_kN > 0.0) & (last - first >= 5) & (at_turn - least_kN >= UPPER * range_kN)
    peaks = [a + int(record.force_kN[a:b].argmax()) for a, b in zip(first[tells], last[tells], strict=True)]
    rise = (record.force_kN[peaks] - at_turn[tells]) / range_kN[tells]
    late_s = record.time_s[peaks] - leave_s[tells]
    return [_Turn(*turn) for turn in zip(rise.tolist(), late_s.tolist(), strict=True)]
