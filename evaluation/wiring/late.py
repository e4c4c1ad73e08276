"""A force that comes later than the stroke that makes it.

A specimen that takes up energy pushes back the less as soon as it is let go: its force never goes on rising
after the stroke has turned. What does is late: a filter, or a wrong ``delay_s``.
"""

from __future__ import annotations

import numpy as np

from evaluation.plausibility.finding import Finding
from evaluation.plausibility.look import Look
from evaluation.record import Record
from evaluation.results import CycleResult
from evaluation.wiring.fit import fitted, lateness
from evaluation.wiring.words import SETTING, doubt

KINDS = ("static", "harmonic")
"""An impact has a mass behind it, whose force is not the specimen's alone."""
RISE = 0.03
"""After the turn the force rises by more than this share of the cycle's range …"""
MOST = 0.6
"""… in so many of the cycles."""
LEAST_LATE_S, LEAST_STEPS = 0.02, 2.0
"""A force that is late by less, or by fewer steps of the sampling, is not told."""
BETTER, PROPER = 0.4, 0.5
"""Shifted, the force follows the stroke so much better, and by this at least."""


def late_force(look: Look) -> list[Finding]:
    """Return by how much the force is late, where the record shows it.

    Parameters
    ----------
    look : Look
        Of an impact, and of a record without cycles, nothing can be told.
    """
    record = look.record
    if look.facts.kind not in KINDS or record.time_s.size < 100:
        return []
    complete = [result for result in look.results if result.cycle.complete]
    rises = [rise for result in complete if (rise := _rise(record, result)) is not None]
    by_turns = bool(rises) and float(np.mean([rise > RISE for rise in rises])) >= MOST
    now = fitted(record.stroke_mm, record.force_kN)
    if now is None or not (by_turns or now.left > PROPER):
        return []
    late = lateness(record.time_s, record.stroke_mm, record.force_kN)
    least_s = max(LEAST_LATE_S, LEAST_STEPS * float(np.median(np.diff(record.time_s))))
    if late is None or late[0] < least_s or late[1].factor <= 0.0:
        return []
    if not by_turns and late[1].left > BETTER * now.left:
        return []
    text = (
        f"the force comes about {late[0]:.2g} s later than the stroke that makes it: it goes on rising when the "
        f"specimen is let go already; look at delay_s of the channel “force” in {SETTING} and at the filter of its "
        "amplifier"
    )
    return [doubt(look, "delay", "force", late[0], "s", text)]


def _rise(record: Record, result: CycleResult) -> float | None:
    """Return by how much of its range in the cycle the force rises after the upper turn; None: not known."""
    cycle, own = result.cycle, result.quantities
    if own.force_max_kN is None or own.force_min_kN is None:
        return None
    leave_s, end_s = cycle.top.leave_s, cycle.end.time_s
    range_kN = own.force_max_kN - own.force_min_kN
    first = int(np.searchsorted(record.time_s, leave_s))
    last = int(np.searchsorted(record.time_s, end_s, side="right"))
    if range_kN <= 0.0 or last - first < 5:
        return None
    at_turn = float(np.interp(leave_s, record.time_s, record.force_kN))
    return (float(np.max(record.force_kN[first:last])) - at_turn) / range_kN
