"""The guard of a transducer that stands still while the piston moves: every sample looks true, none is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import Phase, Samples, Sight
from bufferstand.daq.guards.site import Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock

MEASURED = ("force", "stroke", "position")
"""Quantities of the controller's channels that must move when the command does."""


@dataclass(frozen=True)
class FrozenMemory:
    """The value, since when it stands [µs], and between which commands [mm]."""

    value: float | None = None
    since_us: int = 0
    low_mm: float = 0.0
    high_mm: float = 0.0


@dataclass(frozen=True)
class FrozenGuard(Guard[FrozenMemory]):
    """A channel that must change when the command does: noise alone alters the last digit.

    Parameters
    ----------
    signal : str
        Channel of the controller.
    travel_mm : float
        So far the command may move while the channel shows exactly one value.
    hold_s : float
        And for so long at least [s of device time]: a coarse converter may skip a few samples.
    action : Action
        What the trip leads to.
    """

    kind: ClassVar = "frozen"
    title: ClassVar = "channels that stand still while the command moves"
    settings: ClassVar = ("guards.action.frozen",)
    facts_as: ClassVar = "list"
    docs: ClassVar = ("`frozen …`",)
    looks_at: ClassVar = (Samples,)
    turn: ClassVar = 90
    remembers: ClassVar = FrozenMemory
    of_zero: ClassVar = True

    signal: str
    travel_mm: float = 3.0
    hold_s: float = 0.25
    action: Action = Action.STOP

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return one for each measured channel that the controller has."""
        channels = sorted(
            (one for one in site.stand.controller.facts.channels if one.quantity in MEASURED),
            key=lambda one: (MEASURED.index(one.quantity), one.name),
        )
        return (cls(one.name, action=site.does("frozen")) for one in channels)

    @property
    def key(self) -> str:
        """Return the channel."""
        return self.signal

    def look(self, memory: FrozenMemory, sight: Sight, beside: Beside) -> tuple[FrozenMemory, Found]:
        """Judge a block that has the channel."""
        return evaluate_frozen(self, memory, sight.block) if isinstance(sight, Samples) else (memory, None)

    def during(self, phase: Phase) -> Self | None:
        """Return nothing where the piston follows no command, or comes nearer to what it measures."""
        return None if phase in (Phase.VALVE_OFF, Phase.TOUCH) else self

    def margin(self, memory: FrozenMemory, beside: Beside) -> Margin:
        """Return how far the command has moved while the channel showed one value."""
        name, moved_mm = f"frozen {self.signal}", memory.high_mm - memory.low_mm
        text = f"stands while the command moved {moved_mm:.1f} of {self.travel_mm:g} mm"
        return Margin(name, name, text, moved_mm / self.travel_mm, self.action)


def evaluate_frozen(
    guard: FrozenGuard, memory: FrozenMemory, block: ScaledBlock
) -> tuple[FrozenMemory, Trip | None]:
    """Judge a block of any size by the value that it ends with."""
    value, command = block.values.get(guard.signal), block.values.get("command")
    if value is None or command is None or not len(value):
        return memory, None
    if len(value) > 1 and value[-1] != value[-2] and value[-1] == value[-1]:  # nearly always, with a true one
        return FrozenMemory(
            float(value[-1]), int(block.time_us[-1]), float(command[-1]), float(command[-1])
        ), None
    changed = np.flatnonzero(value != value[-1])
    first = int(changed[-1]) + 1 if len(changed) else 0
    if first == len(value):  # it ends with no number, which differs from itself: the channel's guard says it
        return FrozenMemory(), None
    low, high = float(command[first:].min()), float(command[first:].max())
    since_us = int(block.time_us[first])
    if first == 0 and memory.value == value[-1] and not block.lost:
        low, high, since_us = min(low, memory.low_mm), max(high, memory.high_mm), memory.since_us
    after = FrozenMemory(float(value[-1]), since_us, low, high)
    stood_s = (int(block.time_us[-1]) - since_us) / 1e6
    if high - low <= guard.travel_mm or stood_s < guard.hold_s:
        return after, None
    sequence = block.first_sequence + len(value) - 1
    return after, Trip(
        f"frozen {guard.signal}",
        guard.action,
        f"{guard.signal} has shown exactly {value[-1]:.4f} for {stood_s:.2f} s while the command moved by "
        f"{high - low:.1f} mm (until sample {sequence}): its transducer, converter or register stands still; "
        "look at its cable and supply",
        block.received_s,
        value=float(value[-1]),
        stream=block.stream,
        sequence=sequence,
        time_us=int(block.time_us[-1]),
        device_fault=True,
    )
