"""The guard of the controller itself: it must deliver, live, lose little, and not act by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

from daq.guards import Action, Trip
from daq.scaling import ScaledBlock
from drivers.interfaces import ControllerStatus, EndReason, MotionState

FAULT_CODES = {1: "watchdog", 2: "force limit of the device", 3: "stroke limit of the device", 4: "actuator"}
"""What the controller's ``fault_code`` means (register profile)."""
WATCHDOG_FAULT = 1


@dataclass(frozen=True)
class ControllerGuard:
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

    silence_s: float
    gap_stop_s: float
    rate_Hz: float
    own_clock: bool = True


@dataclass(frozen=True)
class ControllerMemory:
    """What was last seen of the controller; times of the wall [s]."""

    sample_s: float
    heartbeat_s: float
    heartbeat: int | None = None
    watchdog_trips: int | None = None
    done_sequence: int | None = None
    forgiven: bool = False
    """Its watchdog had acted before we came (a PC was lost); switching on resets that fault."""


def evaluate_gap(guard: ControllerGuard, block: ScaledBlock) -> Trip | None:
    """Return a trip for samples lost before a block: a note if few, a stop if the guards were blind."""
    if block.lost <= 0:
        return None
    lost_s = block.lost / guard.rate_Hz
    blind = lost_s > guard.gap_stop_s
    return Trip(
        "ring",
        Action.STOP if blind else Action.NOTE,
        f"{block.lost} samples ({lost_s * 1e3:.0f} ms) were lost before sample {block.first_sequence}: "
        + (f"longer than {guard.gap_stop_s:g} s, the guards were blind" if blind else "counted in the run"),
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
    memory = replace(
        memory,
        heartbeat=status.heartbeat,
        heartbeat_s=wall_s if beat else memory.heartbeat_s,
        watchdog_trips=status.watchdog_trips,
        done_sequence=status.done_sequence,
        forgiven=status.fault_code == WATCHDOG_FAULT and (before.forgiven or before.heartbeat is None),
    )
    if memory.forgiven:
        return memory, None if before.forgiven else _old_watchdog_fault(at_s)
    ended = before.done_sequence is not None and status.done_sequence != before.done_sequence
    why = ""
    if before.watchdog_trips is not None and status.watchdog_trips != before.watchdog_trips:
        why = "its watchdog ran out (it was not fed in time) and it ramped to zero force by itself"
    elif status.state is MotionState.FAULT or status.fault_code:
        code = FAULT_CODES.get(status.fault_code, "unknown cause")
        why = f"it reports fault {status.fault_code} ({code})"
    elif ended and status.end_reason in (EndReason.WATCHDOG, EndReason.DEVICE_LIMIT):
        why = f"its last motion ended by {status.end_reason.name.lower().replace('_', ' ')}"
    if not why:
        return memory, None
    return memory, Trip(
        "controller",
        Action.EMERGENCY,
        f"the controller stopped the motion: {why}; force {status.force_kN:.1f} kN, "
        f"stroke {status.stroke_mm:.1f} mm",
        at_s,
        value=float(status.fault_code),
        device_fault=True,
    )


def _old_watchdog_fault(at_s: float) -> Trip:
    return Trip(
        "controller",
        Action.NOTE,
        "the controller's watchdog had run out before this start (a PC was lost or killed) and it had "
        "ramped to zero force; switching on resets this",
        at_s,
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
