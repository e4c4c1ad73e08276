"""The guard of a temperature sensor: it must speak, speak the truth, and stay below the stop threshold."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bufferstand.daq.guards import Action, Trip
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.interfaces import SensorFault

POWER_ON_C = 85.0
"""What a DS18B20 reports after power-on without a conversion; it occurs as a true reading, too."""
SENSOR_RANGE_C = (-55.0, 125.0)
"""Range of the DS18B20; a reading outside it is none."""


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
