"""The guard of cycles that the controller missed: each is a counted gap, many make its samples worthless."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Self

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import Samples, Sight
from bufferstand.daq.guards.site import Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock

WINDOW_S = 60.0
"""Missed cycles are counted over so long [s of the controller's clock]."""


MissedMemory = tuple[tuple[int, int], ...]
"""Time stamp [µs] behind each gap of the last minute, and the cycles that were missed there."""


@dataclass(frozen=True)
class MissedGuard(Guard[MissedMemory]):
    """The controller may miss so many cycles of its loop in a minute; none of them has a sample.

    Parameters
    ----------
    most_per_min : int
        More than this stops.
    """

    kind: ClassVar = "missed"
    title: ClassVar = "cycles that the controller misses"
    settings: ClassVar = ("guards.missed_cycles_max_per_min",)
    facts_as: ClassVar = "one"
    docs: ClassVar = ("`missed cycles`",)
    looks_at: ClassVar = (Samples,)
    turn: ClassVar = 60
    remembers: ClassVar = tuple

    most_per_min: int

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return it for every controller."""
        yield cls(site.table.missed_cycles_max_per_min)

    def look(self, memory: MissedMemory, sight: Sight, beside: Beside) -> tuple[MissedMemory, Found]:
        """Count the cycles that were missed before a block."""
        return evaluate_missed(self, memory, sight.block) if isinstance(sight, Samples) else (memory, None)

    def margin(self, memory: MissedMemory, beside: Beside) -> Margin:
        """Return the cycles of the minute that ended with the last gap."""
        cycles = sum(missed for _, missed in memory)
        text = f"{cycles} missed within {WINDOW_S:g} s, trips above {self.most_per_min}"
        return Margin("missed cycles", "missed cycles", text, cycles / (self.most_per_min + 1), Action.STOP)


def evaluate_missed(
    guard: MissedGuard, memory: MissedMemory, block: ScaledBlock
) -> tuple[MissedMemory, Trip | None]:
    """Count the cycles that were missed before a block, and those of the last minute.

    Returns
    -------
    tuple of MissedMemory and Trip or None
        A trip where there are too many; one that stays within the limit is noted by the guard of gaps.
    """
    if not block.missed or not len(block):
        return memory, None
    at_us = int(block.time_us[0])
    after = (*(gap for gap in memory if at_us - gap[0] < WINDOW_S * 1e6), (at_us, block.missed))
    cycles = sum(missed for _, missed in after)
    if cycles <= guard.most_per_min:
        return after, None
    return after, Trip(
        "missed cycles",
        Action.STOP,
        f"the controller missed {cycles} cycles of its loop within {WINDOW_S:g} s, more than "
        f"{guard.most_per_min} (the last before sample {block.first_sequence} at {at_us / 1e6:.3f} s of its "
        "clock): look at the load of its loop",
        block.received_s,
        value=float(cycles),
        limit=float(guard.most_per_min),
        unit="cycles",
        stream=block.stream,
        sequence=block.first_sequence,
        time_us=at_us,
        device_fault=True,
    )
