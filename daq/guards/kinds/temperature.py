"""The guard of a temperature sensor: it must speak, speak the truth, and stay below the stop threshold."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import Complaint, PassOver, Phase, Samples, Sight
from bufferstand.daq.guards.site import Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers import ReadingLimits, SensorFault

DS18B20 = ReadingLimits(-55.0, 125.0, power_on_C=85.0)
"""What the sensor can show of which nobody says what it is; 85 °C occurs as a true reading, too."""


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


@dataclass(frozen=True)
class TemperatureGuard(Guard[TemperatureMemory]):
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
        A reading of exactly the power-on value that differs by more than this from the last true one is none.
    frozen_s : float
        The very same reading for this long [s of the wall] is worth a note.
    action, silence_action : Action
        What an excess, and what silence leads to.
    readings : ReadingLimits
        What the sensor can show; the run file holds it where it is no DS18B20.
    """

    kind: ClassVar = "temperatures"
    title: ClassVar = "thermometers: the temperature stop, and whether they speak the truth"
    settings: ClassVar = (
        "limits.temperature_stop_C", "limits.temperature_resume_C", "limits.temperature_stale_s",
        "guards.action.temperature", "guards.action.ambient_silence",
    )  # fmt: skip
    facts_as: ClassVar = "list"
    docs: ClassVar = ("`temperature_n` (specimen)", "`temperature_n` (ambient)", "`temperature_n`")
    looks_at: ClassVar = (Samples, Complaint, PassOver)
    turn: ClassVar = 20

    stream: str
    place: str
    stop_C: float | None
    resume_C: float | None
    grace_s: float
    jump_K: float = 5.0
    frozen_s: float = 1800.0
    action: Action = Action.STOP
    silence_action: Action = Action.STOP
    readings: ReadingLimits = DS18B20

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return one for each thermometer; those that do not touch the specimen are only heard."""
        limits = site.limits
        for name, facts in site.thermometers.items():
            ambient = name in site.ambient
            yield cls(
                name,
                facts.channels[0].place,
                None if ambient else limits.temperature_stop_C,
                None if ambient else limits.temperature_resume_C,
                limits.temperature_stale_s,
                action=site.does("temperature"),
                silence_action=site.does("ambient_silence") if ambient else Action.STOP,
                readings=facts.readings or DS18B20,
            )

    @property
    def key(self) -> str:
        """Return the sensor's stream."""
        return self.stream

    def facts(self) -> Any:
        """Return it as data for the run file; what a DS18B20 can show is left out."""
        content = super().facts()
        if self.readings == DS18B20:
            del content["readings"]
        return content

    @classmethod
    def from_facts(cls, facts: Any) -> Self:
        """Return it from its data in a run file."""
        readings = facts.get("readings")
        return super().from_facts(
            facts if readings is None else facts | {"readings": ReadingLimits(**readings)}
        )

    def begin(self, wall_s: float) -> TemperatureMemory:
        """Return that listening begins now."""
        return TemperatureMemory(wall_s)

    def look(
        self, memory: TemperatureMemory, sight: Sight, beside: Beside
    ) -> tuple[TemperatureMemory, Found]:
        """Judge the sensor's readings, and its silence at the end of a pass."""
        match sight:
            case Samples(block=block) if block.stream == self.stream:
                return evaluate_reading(self, memory, block, beside.wall_s)
            case Complaint(fault=fault) if fault.stream == self.stream:
                return evaluate_fault(memory, fault), None
            case PassOver():
                return evaluate_silence(self, memory, beside.at_s, beside.wall_s)
        return memory, None

    def during(self, phase: Phase) -> Self | None:
        """Return it without its stop where a specimen may be warm: a silent sensor trips there, too."""
        return replace(self, stop_C=None) if phase is Phase.COOLING else self

    def stopping_at(self, stop_C: float, resume_C: float) -> Self:
        """Return it with other thresholds, where it has any [°C]."""
        return self if self.stop_C is None else replace(self, stop_C=stop_C, resume_C=resume_C)

    def margin(self, memory: TemperatureMemory, beside: Beside) -> Margin:
        """Return how much of the way from the air to its stop the specimen has gone; else its silence."""
        action = self.silence_action if self.stop_C is None else self.action
        if memory.value_C is None:
            text = f"no reading yet (grace {self.grace_s:g} s)"
            return Margin(self.stream, self.label, text, None, action)
        silent_s, value_C = beside.wall_s - memory.since_s, memory.value_C
        if self.stop_C is None:
            text = f"{value_C:.1f} °C, {silent_s:.0f} s old"
            return Margin(self.stream, self.label, text, silent_s / self.grace_s, action)
        left_K = max(0.0, self.stop_C - value_C)
        text = f"{value_C:.1f} of {self.stop_C:g} °C, {left_K:.1f} left, {silent_s:.0f} s old"
        air_C = beside.ambient_C
        share = (value_C - air_C) / (self.stop_C - air_C) if self.stop_C > air_C else value_C / self.stop_C
        return Margin(self.stream, self.label, text, max(0.0, share), action)

    @property
    def label(self) -> str:
        """Return how a person calls the sensor."""
        return f"{self.stream} ({self.place})" if self.place else self.stream


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
    can = guard.readings
    if not can.low_C <= value_C <= can.high_C:
        return f"its last reading, {value_C:.2f} °C, is outside the sensor's range"
    far = memory.value_C is None or abs(value_C - memory.value_C) > guard.jump_K
    if value_C == can.power_on_C and far:
        return f"its last reading, exactly {value_C} °C, is the power-on value (supply or conversion failed)"
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
