"""Guards of time itself: the device's clock, this computer's civil time, and passes that come too late."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import (
    CameBack,
    ClocksRead,
    Happening,
    PassOver,
    Samples,
    Sight,
    Snapshot,
)
from bufferstand.daq.guards.site import CONTROLLER_STREAM, Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock

DEVICE_JUMP_S = 0.1
"""So much the time stamps may differ from what the count of samples says, from block to block [s]."""
CIVIL_JUMP_S = 2.0
"""So much the civil time may be set while a campaign runs before it is said [s]."""
PAUSE_S = 1.0
"""A pass that comes so much later than the one before is said [s of the wall]."""


@dataclass(frozen=True)
class DeviceClockMemory:
    """Sequence number and time stamp [µs] of the last sample."""

    sequence: int | None = None
    time_us: int = 0


@dataclass(frozen=True)
class DeviceClockGuard(Guard[DeviceClockMemory]):
    """The time stamps of a controller that stamps its samples itself must count with them."""

    kind: ClassVar = "device clock"
    title: ClassVar = "the controller's clock counts with its samples"
    settings: ClassVar = ()
    facts_as: ClassVar = "none"
    docs: ClassVar = ("`clock`",)
    looks_at: ClassVar = (Samples,)
    turn: ClassVar = 100
    remembers: ClassVar = DeviceClockMemory
    standing: ClassVar = True

    def look(
        self, memory: DeviceClockMemory, sight: Sight, beside: Beside
    ) -> tuple[DeviceClockMemory, Found]:
        """Judge a block of a controller that has a clock of its own."""
        controller = beside.guard(ControllerGuard)
        if not isinstance(sight, Samples) or sight.block.stream != CONTROLLER_STREAM:
            return memory, None
        if controller is None or not controller.own_clock or controller.rate_Hz <= 0.0:
            return memory, None  # a journal may state no rate: then nothing can be counted
        return evaluate_device_clock(memory, sight.block, controller.rate_Hz)

    def margin(self, memory: DeviceClockMemory, beside: Beside) -> Margin:
        """Return what it watches for: a jump has no way to it."""
        text = f"time stamps must count with the samples to {DEVICE_JUMP_S:g} s"
        return Margin("clock", "clock of the controller", text, None, Action.STOP)


def evaluate_device_clock(
    memory: DeviceClockMemory, block: ScaledBlock, rate_Hz: float
) -> tuple[DeviceClockMemory, Trip | None]:
    """Compare the time that passed since the block before with the samples that passed; a jump stops."""
    if not len(block):
        return memory, None
    last = block.first_sequence + len(block) - 1
    after = DeviceClockMemory(last, int(block.time_us[-1]))
    if memory.sequence is None:
        return after, None
    passed_s = (int(block.time_us[0]) - memory.time_us) / 1e6
    counted_s = (block.first_sequence - memory.sequence) / rate_Hz
    jump_s = passed_s - counted_s
    # A device that is polled is late by whole polls: only what no poll explains is a jump.
    if abs(jump_s) <= DEVICE_JUMP_S + 2.0 / rate_Hz and passed_s >= 0.0:
        return after, None
    return after, Trip(
        "clock",
        Action.STOP,
        f"the controller's clock jumped by {jump_s:+.3f} s before sample {block.first_sequence} "
        f"(at {int(block.time_us[0]) / 1e6:.3f} s of it): what was measured cannot be placed in time; "
        "look at the controller for a restart",
        block.received_s,
        value=jump_s,
        limit=DEVICE_JUMP_S,
        unit="s",
        stream=block.stream,
        sequence=block.first_sequence,
        time_us=int(block.time_us[0]),
        device_fault=True,
    )


@dataclass(frozen=True)
class HostMemory:
    """What the computer's clocks showed in the pass before [s]."""

    civil_s: float
    steady_s: float
    at_s: float
    """Stand time."""


@dataclass(frozen=True)
class ComputerClockGuard(Guard[HostMemory | None]):
    """This computer's civil time must not be set, and this program not stand still, without a word."""

    kind: ClassVar = "computer clock"
    title: ClassVar = "this computer's clock, and pauses of this program"
    settings: ClassVar = ()
    facts_as: ClassVar = "none"
    docs: ClassVar = ("`clock`, `pause`",)
    looks_at: ClassVar = (PassOver,)
    turn: ClassVar = 5
    in_journal: ClassVar = False
    standing: ClassVar = True

    def look(
        self, memory: HostMemory | None, sight: Sight, beside: Beside
    ) -> tuple[HostMemory | None, Found]:
        """Compare the clocks with the pass before."""
        if not isinstance(sight, PassOver) or sight.computer is None:
            return memory, None
        now = sight.computer
        if memory is None:
            return HostMemory(now.civil_s, now.steady_s, beside.at_s), None
        return evaluate_host(memory, now.civil_s, now.steady_s, beside.at_s, guarded=now.guarded)

    def after(self, memory: HostMemory | None, happening: Happening) -> HostMemory | None:
        """Return what the clocks are to count from."""
        if isinstance(happening, ClocksRead):
            return HostMemory(happening.civil_s, happening.steady_s, happening.at_s)
        return memory

    def margin(self, memory: HostMemory | None, beside: Beside) -> Margin:
        """Return what it watches for: neither has a way to it."""
        text = f"no pause of more than {PAUSE_S:g} s, civil time not set by more than {CIVIL_JUMP_S:g} s"
        return Margin("pause", "this computer", text, None, Action.NOTE)


def evaluate_host(
    memory: HostMemory, civil_s: float, steady_s: float, at_s: float, *, guarded: bool
) -> tuple[HostMemory, list[Trip]]:
    """Say when the civil time was set, or this program stood still; neither alters a recorded time.

    Parameters
    ----------
    memory : HostMemory
        Of the pass before.
    civil_s, steady_s : float
        Civil time, and a time of the wall that nobody sets [s].
    at_s : float
        Present stand time [s].
    guarded : bool
        Whether guards were to look since the pass before: where nothing could move a late pass means nothing.

    Notes
    -----
    A simulated stand that waits for its reader stands still while this program does. So a pause must be one
    of the stand's own time, too.
    """
    said: list[Trip] = []
    pause_s = steady_s - memory.steady_s
    jump_s = civil_s - memory.civil_s - pause_s
    note = Trip("", Action.NOTE, "", at_s, unit="s")
    if abs(jump_s) > CIVIL_JUMP_S:
        text = (
            f"this computer's civil time was set by {jump_s:+.1f} s: samples keep their own clock, "
            "only the times of day of this run jump"
        )
        said.append(replace(note, guard="clock", reason=text, value=jump_s, limit=CIVIL_JUMP_S))
    if guarded and min(pause_s, at_s - memory.at_s) > PAUSE_S:
        text = (
            f"this program stood still for {pause_s:.1f} s (stopped, or the computer is overloaded): "
            "meanwhile no guard looked"
        )
        said.append(replace(note, guard="pause", reason=text, value=pause_s, limit=PAUSE_S))
    return HostMemory(civil_s, steady_s, at_s), said


@dataclass(frozen=True)
class LagMemory:
    """When the newest sample was fresh last, and when it was last seen to be younger than before.

    Times of the wall and ages [s].
    """

    fresh_at_s: float
    noted: bool = False
    least_s: float = math.inf
    least_at_s: float = 0.0


@dataclass(frozen=True)
class LagGuard(Guard[LagMemory]):
    """The newest sample must not be old, else the guards see the stand late.

    Parameters
    ----------
    stop_s : float
        Behind for so long without a break [s of the wall] stops; a tenth of it is noted. Samples older than
        this tenth that do not become younger stop after another tenth.
    fresh_s : float
        A sample that is no older than this [s of the wall] is explained by block, round trip and commands.
    """

    kind: ClassVar = "lag"
    title: ClassVar = "the guards see the stand in time"
    settings: ClassVar = ("guards.lag_stop_s",)
    facts_as: ClassVar = "one"
    docs: ClassVar = ("`lag`",)
    looks_at: ClassVar = (Snapshot,)
    turn: ClassVar = 130
    in_journal: ClassVar = False

    stop_s: float
    fresh_s: float = 0.25

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return it for every controller."""
        yield cls(site.table.lag_stop_s)

    def begin(self, wall_s: float) -> LagMemory:
        """Return that the newest sample is fresh now."""
        return LagMemory(wall_s)

    def look(self, memory: LagMemory, sight: Sight, beside: Beside) -> tuple[LagMemory, Found]:
        """Judge how old the newest sample was at a look at the status."""
        if not isinstance(sight, Snapshot):
            return memory, None
        return evaluate_lag(
            self,
            memory,
            age_s=sight.age_s,
            up_to_date=sight.up_to_date,
            at_s=beside.at_s,
            wall_s=beside.wall_s,
        )

    def after(self, memory: LagMemory, happening: Happening) -> LagMemory | None:
        """Return its memory; from the end of an outage it counts anew."""
        return (
            LagMemory(happening.wall_s)
            if isinstance(happening, CameBack)
            else super().after(memory, happening)
        )

    def margin(self, memory: LagMemory, beside: Beside) -> Margin:
        """Return for how long the newest sample has not been fresh."""
        behind_s = beside.wall_s - memory.fresh_at_s
        text = f"{behind_s:.1f} s behind, trips after {self.stop_s:g} s"
        return Margin("lag", "reader behind the stand", text, behind_s / self.stop_s, Action.STOP)


def evaluate_lag(
    guard: LagGuard, memory: LagMemory, *, age_s: float | None, up_to_date: bool, at_s: float, wall_s: float
) -> tuple[LagMemory, Trip | None]:
    """Judge how old the newest sample is: a note when the reader falls behind, a stop when it stays behind.

    Parameters
    ----------
    guard, memory
        What must hold, what was seen.
    age_s : float or None
        Age of the newest sample by the device's own clock [s of the wall]; None where it shows none.
    up_to_date : bool
        Whether all that the device had sampled was read.
    at_s, wall_s : float
        Present stand time and time of the wall [s].
    """
    if up_to_date or (age_s is not None and age_s <= guard.fresh_s):
        return LagMemory(wall_s), None
    age_s = math.inf if age_s is None else age_s
    if age_s < memory.least_s:
        memory = replace(memory, least_s=age_s, least_at_s=wall_s)
    soon_s = 0.1 * guard.stop_s
    behind_s = wall_s - memory.fresh_at_s
    grows = soon_s < age_s < math.inf and wall_s - memory.least_at_s > soon_s
    stops = behind_s > guard.stop_s or grows
    if not stops and (memory.noted or behind_s <= soon_s):
        return memory, None
    old = (
        ""
        if age_s == math.inf
        else f"; the newest sample is {age_s:.2f} s old" + (" and not getting younger" if grows else "")
    )
    # One that falls back for good is not waited for: the time that is left would only make it later.
    limit_s = soon_s if grows and behind_s <= guard.stop_s else guard.stop_s
    until = f"stop at {limit_s:g} s" + (" where it does not catch up" if limit_s < guard.stop_s else "")
    return replace(memory, noted=True), Trip(
        "lag",
        Action.STOP if stops else Action.NOTE,
        f"the reader has been behind the stand for {behind_s:.1f} s ({until}){old}: the "
        "guards see samples late; relieve this computer or the network",
        at_s,
        value=behind_s,
        limit=limit_s,
        unit="s",
        device_fault=stops,
    )
