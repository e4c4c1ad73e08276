"""The guard of cycles that the controller missed: each is a counted gap, many make its samples worthless."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.daq.guards import Action, Trip
from bufferstand.daq.scaling import ScaledBlock

WINDOW_S = 60.0
"""Missed cycles are counted over so long [s of the controller's clock]."""


@dataclass(frozen=True)
class MissedGuard:
    """The controller may miss so many cycles of its loop in a minute; none of them has a sample.

    Parameters
    ----------
    most_per_min : int
        More than this stops.
    """

    most_per_min: int


MissedMemory = tuple[tuple[int, int], ...]
"""Time stamp [µs] behind each gap of the last minute, and the cycles that were missed there."""


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
