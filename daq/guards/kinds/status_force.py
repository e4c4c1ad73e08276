"""The guard of the controller's own reading of the force, in its status: what its own limits go by.

Figures come from samples. But the controller's force limit, its turns at a force, and the reset of a fault go
by this reading, and a safe stop without samples has nothing else.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import Sight, Snapshot
from bufferstand.daq.guards.trips import Action, Trip

APART_KN = 10.0
"""So much at least it may differ from the samples: it is read at another instant, by another calibration."""
APART_SHARE = 0.1
"""And by so much of the larger of both."""
LASTS_S = 1.0
"""So long it must be wrong [s of the wall]."""


@dataclass(frozen=True)
class StatusForceMemory:
    """Since when it is wrong [s of the wall], and whether that was said."""

    since_s: float | None = None
    said: bool = False


@dataclass(frozen=True)
class StatusForceGuard(Guard[StatusForceMemory]):
    """The controller's own reading of the force must be that of its samples."""

    kind: ClassVar = "status force"
    title: ClassVar = "the controller's own reading of the force"
    settings: ClassVar = ()
    facts_as: ClassVar = "none"
    docs: ClassVar = ("`status force`",)
    looks_at: ClassVar = (Snapshot,)
    turn: ClassVar = 120
    remembers: ClassVar = StatusForceMemory
    in_journal: ClassVar = False
    lasting: ClassVar = True
    standing: ClassVar = True

    def look(
        self, memory: StatusForceMemory, sight: Sight, beside: Beside
    ) -> tuple[StatusForceMemory, Found]:
        """Hold a snapshot against the samples."""
        if not isinstance(sight, Snapshot):
            return memory, None
        shown_kN, sampled_kN = sight.status.force_kN, sight.sampled_kN
        return evaluate_status_force(memory, shown_kN, sampled_kN, at_s=beside.at_s, wall_s=beside.wall_s)

    def margin(self, memory: StatusForceMemory, beside: Beside) -> Margin:
        """Return for how long it has been wrong."""
        wrong_s = 0.0 if memory.since_s is None else beside.wall_s - memory.since_s
        text = f"wrong for {wrong_s:.1f} s" if wrong_s else f"within {APART_KN:g} kN of the samples"
        return Margin("status force", "controller's own force", text, wrong_s / LASTS_S, Action.NOTE)


def evaluate_status_force(
    memory: StatusForceMemory,
    shown_kN: float,
    sampled_kN: float | None,
    *,
    at_s: float,
    wall_s: float,
) -> tuple[StatusForceMemory, Trip | None]:
    """Hold the controller's own reading against its samples; a note once it has been wrong for a second.

    A look near zero force at which both fit ends no doubt: there a dead or mis-scaled reading is right, too.

    Parameters
    ----------
    memory : StatusForceMemory
        Of the look before.
    shown_kN : float
        Register ``force`` of the status.
    sampled_kN : float or None
        Newest sample of the force, no zero taken off; None before the first.
    at_s, wall_s : float
        Present stand time and time of the wall [s].
    """
    wrong = not math.isfinite(shown_kN)
    if not wrong and sampled_kN is not None:
        size_kN = max(abs(shown_kN), abs(sampled_kN))
        wrong = not abs(shown_kN - sampled_kN) <= max(APART_KN, APART_SHARE * size_kN)
        if not wrong and size_kN <= 2.0 * APART_KN:
            return memory, None
    if not wrong:
        return StatusForceMemory(), None
    memory = memory if memory.since_s is not None else replace(memory, since_s=wall_s)
    lasted_s = 0.0 if memory.since_s is None else wall_s - memory.since_s
    if memory.said or lasted_s < LASTS_S:
        return memory, None
    text = (
        f"the controller's own reading of the force is {shown_kN:.1f} kN"
        if math.isfinite(shown_kN)
        else "the controller's own reading of the force is no number"
    )
    beside = "" if sampled_kN is None else f", its samples show {sampled_kN:.1f} kN (no zero taken off)"
    return replace(memory, said=True), Trip(
        "status force",
        Action.NOTE,
        f"{text} for {lasted_s:.1f} s{beside}: its own force limit goes by that reading; look at its "
        "transducer and scaling",
        at_s,
        value=shown_kN if math.isfinite(shown_kN) else None,
        limit=sampled_kN if sampled_kN is not None and math.isfinite(sampled_kN) else None,
        unit="kN",
    )
