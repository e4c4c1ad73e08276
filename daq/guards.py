"""Guards as data, and their evaluation as pure functions: observation in, verdict and memory out.

A guard never keeps anything itself: what it must remember from block to block is a small frozen record
that its evaluation takes and returns. The latch lies in :mod:`daq.panel`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np

from daq.scaling import ScaledBlock
from drivers.interfaces import ControllerStatus, EndReason, MotionState, SensorFault

POWER_ON_C = 85.0
"""What a DS18B20 reports after power-on without a conversion; it occurs as a true reading, too."""
SENSOR_RANGE_C = (-55.0, 125.0)
"""Range of the DS18B20; a reading outside it is none."""
FAULT_CODES = {1: "watchdog", 2: "force limit of the device", 3: "stroke limit of the device", 4: "actuator"}
"""What the controller's ``fault_code`` means (register profile)."""
WATCHDOG_FAULT = 1


class Action(IntEnum):
    """What a trip leads to; a higher one overrides a lower one."""

    NOTE = 0
    """Said and recorded; the campaign goes on."""
    STOP_AFTER_CYCLE = 1
    """The cycle under way ends, then the safe stop."""
    STOP = 2
    """Safe stop at once: hold, ramp to zero force, valve off."""
    EMERGENCY = 3
    """Safe stop at once without the hold: unload first."""


@dataclass(frozen=True)
class Trip:
    """A guard that tripped: who, what to do, and all that a person needs to understand it.

    Parameters
    ----------
    guard : str
        Name of the guard (``force``, ``temperature_1`` …).
    action : Action
        What it leads to.
    reason : str
        One sentence with value, limit, unit, sensor and place.
    at_s : float
        Host stand time at which it was noticed [s].
    value, limit : float or None
        The offending value and the limit, in ``unit``.
    unit : str
        Unit of both.
    stream : str
        The stream of the causing sample, empty if none caused it.
    sequence : int or None
        Absolute sequence number of the causing sample.
    time_us : int or None
        Its time stamp [µs].
    device_fault : bool
        True if a device or its wire failed (exit status 4), False for a limit or an operator (3).
    """

    guard: str
    action: Action
    reason: str
    at_s: float
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    stream: str = ""
    sequence: int | None = None
    time_us: int | None = None
    device_fault: bool = False

    def facts(self) -> dict[str, object]:
        """Return the trip as data of a run's event (only what is known)."""
        content: dict[str, object] = {"guard": self.guard, "action": self.action.name.lower()}
        for name in ("value", "limit", "sequence", "time_us"):
            if getattr(self, name) is not None:
                content[name] = getattr(self, name)
        if self.unit:
            content["unit"] = self.unit
        if self.stream:
            content["stream"] = self.stream
        return content


# --- a channel that must stay between limits ---------------------------------------------------------


@dataclass(frozen=True)
class ChannelGuard:
    """A signal of the controller's samples that must stay between two limits; every sample counts.

    Parameters
    ----------
    name : str
        Name of the guard.
    signal : str
        Channel or derived signal of :class:`daq.scaling.ScaledBlock`.
    upper, lower : float or None
        Limits in ``unit``; a sample beyond one of them, or no number at all, is an excess.
    unit : str
        Unit of the signal.
    label : str
        What a person calls it, with its sensor and place.
    action : Action
        What the trip leads to.
    hold_s : float
        The excess must last this long [s of device time]; 0 trips at the first sample.
    """

    name: str
    signal: str
    upper: float | None
    lower: float | None
    unit: str
    label: str
    action: Action = Action.STOP
    hold_s: float = 0.0


@dataclass(frozen=True)
class ChannelMemory:
    """Since when (time stamp of the first sample, µs) the signal is beyond its limits without a break."""

    since_us: int | None = None


def evaluate_channel(
    guard: ChannelGuard, memory: ChannelMemory, block: ScaledBlock
) -> tuple[ChannelMemory, Trip | None]:
    """Judge every sample of a block.

    Returns
    -------
    tuple of ChannelMemory and Trip or None
        The trip names the first sample at which the excess had lasted ``hold_s``; a block without the
        signal (or without samples) changes nothing.
    """
    value = block.values.get(guard.signal)
    if value is None or not len(value):
        return memory, None
    lower = -np.inf if guard.lower is None else guard.lower
    upper = np.inf if guard.upper is None else guard.upper
    if lower <= value.min() and value.max() <= upper:  # false for NaN, too
        return ChannelMemory(), None
    beyond = ~((value >= lower) & (value <= upper))
    index = np.arange(len(value))
    start = np.maximum.accumulate(np.where(beyond, -1, index)) + 1  # first row of the excess each row is in
    since = np.where(start < len(value), block.time_us[np.minimum(start, len(value) - 1)], 0)
    if memory.since_us is not None:
        since = np.where(start == 0, memory.since_us, since)
    tripped = np.flatnonzero(beyond & (block.time_us - since >= round(guard.hold_s * 1e6)))
    after = ChannelMemory(int(since[-1]) if beyond[-1] else None)
    if not len(tripped):
        return after, None
    return after, _excess(guard, block, int(tripped[0]))


def _excess(guard: ChannelGuard, block: ScaledBlock, row: int) -> Trip:
    value = float(block.values[guard.signal][row])
    over = guard.upper is not None and not value <= guard.upper
    limit = guard.upper if over else guard.lower
    sequence, time_us = block.first_sequence + row, int(block.time_us[row])
    where = f"sample {sequence} at {time_us / 1e6:.3f} s of the device's clock"
    if np.isnan(value):
        said = f"{guard.label} is not a number"
    else:
        said = (
            f"{guard.label} {value:.2f} {guard.unit} {'exceeds' if over else 'is below'} "
            f"the limit of {limit:.2f} {guard.unit}"
        )
    if guard.hold_s:
        said += f" for {guard.hold_s:g} s"
    return Trip(
        guard.name,
        guard.action,
        f"{said} ({where})",
        block.received_s,
        value=None if np.isnan(value) else value,
        limit=limit,
        unit=guard.unit,
        stream=block.stream,
        sequence=sequence,
        time_us=time_us,
    )


# --- temperature -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TemperatureGuard:
    """A temperature sensor that must speak, speak the truth, and stay below the stop threshold.

    Parameters
    ----------
    stream : str
        The sensor's stream; its channel has the same name.
    place : str
        Where it sits.
    stop_C : float or None
        Threshold [°C]; reached is tripped. None watches only that the sensor speaks (ambient).
    resume_C : float or None
        Below this [°C] the campaign may go on after a trip.
    grace_s : float
        Without a true reading for this long [s of the wall] it counts as a trip.
    jump_K : float
        A reading of exactly 85 °C that differs by more than this from the last true one is the
        power-on value.
    frozen_s : float
        The very same reading for this long [s of the wall] is worth a note.
    action, silence_action : Action
        What an excess, and what silence leads to.
    """

    stream: str
    place: str
    stop_C: float | None
    resume_C: float | None
    grace_s: float
    jump_K: float = 5.0
    frozen_s: float = 1800.0
    action: Action = Action.STOP
    silence_action: Action = Action.STOP

    @property
    def label(self) -> str:
        """Return how a person calls the sensor."""
        return f"{self.stream} ({self.place})" if self.place else self.stream


@dataclass(frozen=True)
class TemperatureMemory:
    """What was last heard of a sensor; times of the wall [s]."""

    since_s: float
    """When listening began or the last true reading came."""
    value_C: float | None = None
    sequence: int | None = None
    time_us: int | None = None
    complaint: str = ""
    same_since_s: float | None = None
    frozen_said: bool = False
    silence_said: bool = False


def evaluate_reading(
    guard: TemperatureGuard, memory: TemperatureMemory, block: ScaledBlock, wall_s: float
) -> tuple[TemperatureMemory, Trip | None]:
    """Judge the readings of one sensor: only a new, true one ends the silence.

    Returns
    -------
    tuple of TemperatureMemory and Trip or None
        The trip names the first reading that reached the stop threshold.
    """
    trip: Trip | None = None
    values = block.values.get(guard.stream, np.empty(0))
    for row in range(len(values)):
        value, sequence = float(values[row]), block.first_sequence + row
        time_us = int(block.time_us[row])
        complaint = _complaint(guard, memory, value, time_us)
        if complaint:
            memory = replace(memory, complaint=complaint)
            continue
        same = value == memory.value_C and memory.same_since_s is not None
        memory = TemperatureMemory(
            wall_s,
            value,
            sequence,
            time_us,
            same_since_s=memory.same_since_s if same else wall_s,
            frozen_said=same and memory.frozen_said,
        )
        if trip is None and guard.stop_C is not None and value >= guard.stop_C:
            trip = Trip(
                guard.stream,
                guard.action,
                f"{guard.label} {value:.2f} °C has reached the stop threshold of {guard.stop_C:g} °C "
                f"(reading {sequence} at {time_us / 1e6:.1f} s)",
                block.received_s,
                value=value,
                limit=guard.stop_C,
                unit="°C",
                stream=block.stream,
                sequence=sequence,
                time_us=time_us,
            )
    return memory, trip


def _complaint(guard: TemperatureGuard, memory: TemperatureMemory, value_C: float, time_us: int) -> str:
    """Return why a reading cannot be believed, empty if it can."""
    if not SENSOR_RANGE_C[0] <= value_C <= SENSOR_RANGE_C[1]:
        return f"its last reading, {value_C:.2f} °C, is outside the sensor's range"
    if value_C == POWER_ON_C and (memory.value_C is None or abs(value_C - memory.value_C) > guard.jump_K):
        return "its last reading, exactly 85.0 °C, is the power-on value (supply or conversion failed)"
    if memory.time_us is not None and time_us <= memory.time_us:
        return f"it repeats its reading of {memory.time_us / 1e6:.1f} s instead of taking a new one"
    return ""


def evaluate_fault(memory: TemperatureMemory, fault: SensorFault) -> TemperatureMemory:
    """Keep what a sensor's driver complained about: it explains the silence, should it last."""
    return replace(memory, complaint=fault.what)


def evaluate_silence(
    guard: TemperatureGuard, memory: TemperatureMemory, at_s: float, wall_s: float
) -> tuple[TemperatureMemory, Trip | None]:
    """Judge a sensor by the time since its last true reading; called in every pass of the loop.

    Returns
    -------
    tuple of TemperatureMemory and Trip or None
        A trip once the grace is over; a note once for a reading that never changes.
    """
    silent_s = wall_s - memory.since_s
    if silent_s > guard.grace_s:
        if memory.silence_said and guard.silence_action is Action.NOTE:
            return memory, None
        last = "never" if memory.value_C is None else f"last true reading {memory.value_C:.2f} °C"
        why = memory.complaint or "nothing was received; check the cable and the bus"
        return replace(memory, silence_said=True), Trip(
            guard.stream,
            guard.silence_action,
            f"{guard.label} has given no true reading for {silent_s:.1f} s (limit {guard.grace_s:g} s; "
            f"{last}): {why}",
            at_s,
            value=silent_s,
            limit=guard.grace_s,
            unit="s",
            stream=guard.stream,
            sequence=memory.sequence,
            device_fault=True,
        )
    same_s = 0.0 if memory.same_since_s is None else wall_s - memory.same_since_s
    if same_s > guard.frozen_s and not memory.frozen_said:
        return replace(memory, frozen_said=True), Trip(
            guard.stream,
            Action.NOTE,
            f"{guard.label} has reported exactly {memory.value_C:.4f} °C for {same_s:.0f} s: "
            "true at rest, else check that it touches the specimen",
            at_s,
            value=same_s,
            limit=guard.frozen_s,
            unit="s",
            stream=guard.stream,
        )
    return memory, None


# --- the controller itself ---------------------------------------------------------------------------


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
    """

    silence_s: float
    gap_stop_s: float
    rate_Hz: float


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


# --- two ways to the same force ----------------------------------------------------------------------


@dataclass(frozen=True)
class AgreementGuard:
    """The force through the controller and through its own amplifier must agree in the mean.

    Means over windows are compared, because the two clocks differ by the wire's latency: at 1500 kN/s
    ten milliseconds are 15 kN that nothing is wrong with.

    Parameters
    ----------
    tolerance_kN : float
        Largest difference of the two window means [kN].
    window_s : float
        Length of a window [s of stand time].
    windows : int
        So many windows in a row must disagree.
    """

    tolerance_kN: float
    window_s: float = 2.0
    windows: int = 3


@dataclass(frozen=True)
class WindowSum:
    """Sum and number of the samples of a window."""

    total: float = 0.0
    count: int = 0

    def plus(self, values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> WindowSum:
        """Return the sum with more samples in it."""
        return WindowSum(self.total + float(values.sum()), self.count + len(values))


@dataclass(frozen=True)
class AgreementMemory:
    """The window under way, and how many in a row have disagreed."""

    opened_s: float
    force: WindowSum = field(default_factory=WindowSum)
    force_2: WindowSum = field(default_factory=WindowSum)
    disagreed: int = 0


def evaluate_agreement(
    guard: AgreementGuard, memory: AgreementMemory, block: ScaledBlock, at_s: float
) -> tuple[AgreementMemory, Trip | None]:
    """Add a block of either stream; at the end of a window compare the means.

    Returns
    -------
    tuple of AgreementMemory and Trip or None
        A note when ``windows`` windows in a row have disagreed (then again after as many).
    """
    if "force" in block.values:
        memory = replace(memory, force=memory.force.plus(block.values["force"]))
    if "force_2" in block.values:
        memory = replace(memory, force_2=memory.force_2.plus(block.values["force_2"]))
    if at_s - memory.opened_s < guard.window_s:
        return memory, None
    one, two = memory.force, memory.force_2
    if not one.count or not two.count:
        return AgreementMemory(at_s), None
    difference = one.total / one.count - two.total / two.count
    disagreed = memory.disagreed + 1 if abs(difference) > guard.tolerance_kN else 0
    if disagreed < guard.windows:
        return AgreementMemory(at_s, disagreed=disagreed), None
    return AgreementMemory(at_s), Trip(
        "agreement",
        Action.NOTE,
        f"force and force_2 (its own amplifier) differ by {difference:+.2f} kN in the mean of "
        f"{guard.windows} × {guard.window_s:g} s (tolerance {guard.tolerance_kN:g} kN): "
        "check both calibrations and zeros",
        at_s,
        value=difference,
        limit=guard.tolerance_kN,
        unit="kN",
        stream=block.stream,
        sequence=block.first_sequence,
    )
