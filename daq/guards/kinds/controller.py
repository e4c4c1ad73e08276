"""The guard of the controller itself: it must deliver, live, lose little, and not act by itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import (
    BegunAnew,
    Happening,
    PassOver,
    Samples,
    Sight,
    Snapshot,
    SwitchedOn,
    ValveExpected,
)
from bufferstand.daq.guards.site import CONTROLLER_STREAM, Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.guards.wiring import Limited
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers import ControllerStatus, EndReason, MotionState
from bufferstand.drivers.controllers import RESET_FORCE_MAX_KN, SWITCHED_ON

FAULT_CODES = {1: "watchdog", 2: "force limit of the device", 3: "stroke limit of the device", 4: "actuator"}
"""What the controller's ``fault_code`` means (register profile)."""
WATCHDOG_FAULT = 1
FORCE_LIMIT_FAULT, STROKE_LIMIT_FAULT = 2, 3
DEVICE_LIMIT_FAULTS = (FORCE_LIMIT_FAULT, STROKE_LIMIT_FAULT)
"""Faults that say no more than that a limit which was set in the device was reached."""
LIMITED: Mapping[int, Limited] = {FORCE_LIMIT_FAULT: "force", STROKE_LIMIT_FAULT: "stroke"}
"""… and what of: it believes its signals as a guard does."""
FAULT_IS_OVER = (MotionState.FAULT, MotionState.OFF, MotionState.READY)
"""States of a controller that shows a fault and has taken the force away: its valve is off."""


def fault_text(code: int) -> str:
    """Return a fault as messages name it: its number and what it means."""
    return f"fault {code} ({FAULT_CODES.get(code, 'unknown cause')})"


@dataclass(frozen=True)
class ControllerMemory:
    """What was last seen of the controller; times of the wall [s]."""

    sample_s: float
    heartbeat_s: float
    heartbeat: int | None = None
    watchdog_trips: int | None = None
    done_sequence: int | None = None
    forgiven: int | None = None
    """The fault that it showed when we came, and that switching on resets."""
    foreign: int | None = None
    """Number of another program's command that it was seen to have taken."""
    valve_on: bool | None = None
    """Whether this program has its valve on; None while that changes, and before."""
    valve_differs: bool = False
    """Whether the last snapshot showed otherwise."""


@dataclass(frozen=True)
class ControllerGuard(Guard[ControllerMemory]):
    """The controller must deliver samples, count its heartbeat, lose little, and not act by itself.

    Parameters
    ----------
    silence_s : float
        Without a new sample, or with a heartbeat that stands, for this long [s of the wall]: trip.
    gap_stop_s : float
        A gap in the samples shorter than this [s] is a note; a longer one left the guards blind: stop.
    rate_Hz : float
        Sample rate, to turn lost samples into time.
    own_clock : bool
        The device stamps its samples itself: a clock that does not count with them has jumped.
    """

    kind: ClassVar = "controller"
    title: ClassVar = "the controller delivers, loses little, and does not act by itself"
    settings: ClassVar = ("guards.controller_silence_s", "guards.gap_stop_s")
    facts_as: ClassVar = "one"
    docs: ClassVar = ("`controller`", "`ring`")
    looks_at: ClassVar = (Samples, Snapshot, PassOver)
    turn: ClassVar = 50

    silence_s: float
    gap_stop_s: float
    rate_Hz: float
    own_clock: bool = True

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return it for every controller."""
        facts, table = site.stand.controller.facts, site.table
        yield cls(table.controller_silence_s, table.gap_stop_s, facts.rate_Hz, facts.clock == "device")

    def begin(self, wall_s: float) -> ControllerMemory:
        """Return that listening begins now."""
        return ControllerMemory(wall_s, wall_s)

    def look(self, memory: ControllerMemory, sight: Sight, beside: Beside) -> tuple[ControllerMemory, Found]:
        """Judge gaps, snapshots, and silence at the end of a pass."""
        match sight:
            case Samples(block=block) if block.stream == CONTROLLER_STREAM:
                after = replace(memory, sample_s=beside.wall_s) if len(block) else memory
                return after, evaluate_gap(self, block)
            case Snapshot(status=status):
                limited = new_limit(memory, status)
                after, trip = evaluate_status(memory, status, beside.at_s, beside.wall_s)
                return after, trip and replace(trip, believed=limited is not None, limited=limited)
            case PassOver() if not beside.cut_off:
                return memory, evaluate_controller_silence(self, memory, beside.at_s, beside.wall_s)
        return memory, None

    def after(self, memory: ControllerMemory, happening: Happening) -> ControllerMemory | None:
        """Return its memory; where its valve is to be stays when all else begins anew."""
        match happening:
            case BegunAnew(wall_s=wall_s):
                return ControllerMemory(wall_s, wall_s, valve_on=memory.valve_on)
            case SwitchedOn():
                return replace(memory, forgiven=None)
            case ValveExpected(on=on):
                return replace(memory, valve_on=on, valve_differs=False)
        return memory

    def margin(self, memory: ControllerMemory, beside: Beside) -> Margin:
        """Return how long ago a sample came, or the heartbeat counted."""
        beat_s = memory.sample_s if memory.heartbeat is None else memory.heartbeat_s
        silent_s = beside.wall_s - min(memory.sample_s, beat_s)
        text = f"{silent_s:.1f} s ago, trips after {self.silence_s:g} s"
        share = silent_s / self.silence_s
        return Margin("silence controller", "silence of controller", text, share, Action.EMERGENCY)


def new_limit(memory: ControllerMemory, status: ControllerStatus) -> Limited | None:
    """Return what a limit of the device was of that a snapshot shows for the first time; None without one."""
    limited = LIMITED.get(status.fault_code)
    old = memory.heartbeat is None or memory.forgiven == status.fault_code
    return None if old else limited


def _lost(block: ScaledBlock, lost_s: float) -> str:
    """Return how many samples were lost before a block, and how many of them the controller missed."""
    time, before = f"({lost_s * 1e3:.0f} ms)", f"lost before sample {block.first_sequence}"
    if block.lost == 1:
        alone = f"1 sample {time} was {before}"
        return f"{alone}, a cycle that the controller missed" if block.missed else alone
    text = f"{block.lost} samples {time} were {before}"
    if not block.missed:
        return text
    if block.missed == block.lost:
        return f"{text}, cycles that the controller missed"
    if block.missed == 1:
        return f"{text}, 1 of them a cycle that the controller missed"
    return f"{text}, {block.missed} of them cycles that the controller missed"


def evaluate_gap(guard: ControllerGuard, block: ScaledBlock) -> Trip | None:
    """Return a trip for samples lost before a block: a note if few, a stop if the guards were blind."""
    if block.lost <= 0:
        return None
    lost_s = block.lost / guard.rate_Hz
    blind = lost_s > guard.gap_stop_s
    what = f"longer than {guard.gap_stop_s:g} s, the guards were blind" if blind else "counted in the run"
    return Trip(
        "ring",
        Action.STOP if blind else Action.NOTE,
        f"{_lost(block, lost_s)}: {what}",
        block.received_s,
        value=float(block.lost),
        limit=guard.gap_stop_s * guard.rate_Hz,
        unit="samples",
        stream=block.stream,
        sequence=block.first_sequence,
        time_us=int(block.time_us[0]) if len(block) else None,
        device_fault=blind,
    )


def evaluate_status(
    memory: ControllerMemory, status: ControllerStatus, at_s: float, wall_s: float
) -> tuple[ControllerMemory, Trip | None]:
    """Judge one snapshot: did the device fault, did its watchdog act, does its heart beat?"""
    beat = memory.heartbeat is None or status.heartbeat != memory.heartbeat
    before = memory
    shown = status.fault_code if status.fault_code or status.state is MotionState.FAULT else None
    came = before.heartbeat is None
    memory = replace(
        memory,
        heartbeat=status.heartbeat,
        heartbeat_s=wall_s if beat else memory.heartbeat_s,
        watchdog_trips=status.watchdog_trips,
        done_sequence=status.done_sequence,
        forgiven=shown if shown == before.forgiven or (came and _is_over(status)) else None,
        foreign=status.foreign_sequence,
        valve_differs=before.valve_on is not None and (status.state in SWITCHED_ON) is not before.valve_on,
    )
    if memory.forgiven is not None:
        return memory, _old_fault(status, at_s) if came else None
    if came and shown is not None:
        return memory, _fault_with_force(status, at_s)
    ended = before.done_sequence is not None and status.done_sequence != before.done_sequence
    why = ""
    if before.watchdog_trips is not None and status.watchdog_trips != before.watchdog_trips:
        why = "its watchdog ran out (it was not fed in time) and it ramped to zero force by itself"
    elif status.state is MotionState.FAULT or status.fault_code:
        why = f"it reports {fault_text(status.fault_code)}"
    elif ended and status.end_reason in (EndReason.WATCHDOG, EndReason.DEVICE_LIMIT):
        why = f"its last motion ended by {status.end_reason.name.lower().replace('_', ' ')}"
    if not why:
        trip = _foreign_command(before, status, at_s)
        return memory, trip or _foreign_switching(before, memory, status, at_s)
    return memory, Trip(
        "controller",
        Action.EMERGENCY,
        f"the controller stopped the motion: {why}; by its own reading, no zero taken off: "
        f"force {status.force_kN:.1f} kN, stroke {status.stroke_mm:.1f} mm",
        at_s,
        value=float(status.fault_code),
        device_fault=True,
    )


def _foreign_command(before: ControllerMemory, status: ControllerStatus, at_s: float) -> Trip | None:
    """Return a trip for another program's command, seen twice: the first reply may have been altered."""
    foreign = status.foreign_sequence
    if foreign is None or foreign != before.foreign:
        return None
    return Trip(
        "controller",
        Action.EMERGENCY,
        f"the controller took a command (number {foreign}) that this program has not given: another program "
        "commands it without the right to; end that program",
        at_s,
        value=float(foreign),
        device_fault=True,
    )


def _foreign_switching(
    before: ControllerMemory, memory: ControllerMemory, status: ControllerStatus, at_s: float
) -> Trip | None:
    """Return a trip for a valve that somebody else has switched, seen twice."""
    if not (before.valve_differs and memory.valve_differs):
        return None
    force = f"(force {status.force_kN:.1f} kN) where this program had it"
    differs = f"off {force} on" if memory.valve_on else f"on {force} off"
    return Trip(
        "controller",
        Action.EMERGENCY,
        f"the controller's valve is {differs}: somebody else has switched it, "
        "or the controller has by itself",
        at_s,
        device_fault=True,
    )


def _is_over(status: ControllerStatus) -> bool:
    """Return whether a fault has been dealt with by the controller: switching on may reset it."""
    if status.fault_code == WATCHDOG_FAULT:
        return True  # a PC was lost a moment ago: the release ends while the first look is taken
    return status.state in FAULT_IS_OVER and abs(status.force_kN) <= RESET_FORCE_MAX_KN


def _old_fault(status: ControllerStatus, at_s: float) -> Trip:
    text = (
        f"the controller shows {fault_text(status.fault_code)} from before this start; its valve is off and "
        f"the force is {status.force_kN:.1f} kN: switching on resets it"
    )
    if status.fault_code == WATCHDOG_FAULT:
        text = (
            "the controller's watchdog had run out before this start (a PC was lost or killed) and it had "
            "ramped to zero force; switching on resets this"
        )
    return Trip("controller", Action.NOTE, text, at_s, value=float(status.fault_code))


def _fault_with_force(status: ControllerStatus, at_s: float) -> Trip:
    state = "its valve is off" if status.state in FAULT_IS_OVER else "it is still taking the force away"
    return Trip(
        "controller",
        Action.EMERGENCY,
        f"the controller shows {fault_text(status.fault_code)} from before this start, {state}, and the "
        f"force is {status.force_kN:.1f} kN: a fault is reset with the valve off and "
        f"{RESET_FORCE_MAX_KN:g} kN at most; see that the specimen is unloaded, then start again",
        at_s,
        value=float(status.fault_code),
        device_fault=True,
    )


def evaluate_controller_silence(
    guard: ControllerGuard, memory: ControllerMemory, at_s: float, wall_s: float
) -> Trip | None:
    """Return a trip if no sample came, or the heartbeat stood, for longer than the limit."""
    silent = {"delivers no new samples": memory.sample_s, "does not count its heartbeat": memory.heartbeat_s}
    for what, since_s in silent.items():
        if wall_s - since_s > guard.silence_s:
            return Trip(
                "controller",
                Action.EMERGENCY,
                f"the controller {what} for {wall_s - since_s:.1f} s (limit {guard.silence_s:g} s): "
                "check its power and the network",
                at_s,
                value=wall_s - since_s,
                limit=guard.silence_s,
                unit="s",
                device_fault=True,
            )
    return None
