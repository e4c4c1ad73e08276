"""Guards of how fast something changes: the stroke in milliseconds, the specimen's temperature in minutes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.kinds.temperature import TemperatureGuard
from bufferstand.daq.guards.margin import Margin, Peaks
from bufferstand.daq.guards.sights import Phase, Samples, Sight
from bufferstand.daq.guards.site import Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock

SPEED_FACTOR = 1.25
"""Default trip of the speed guard over the speed limit in force: a motion may overshoot its speed."""


@dataclass(frozen=True)
class SpeedMemory:
    """The last ``window`` samples: time stamps [µs] and values; and the extremes of the speed of late."""

    time_us: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    value: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    peaks: Peaks = field(default_factory=Peaks)


@dataclass(frozen=True)
class SpeedGuard(Guard[SpeedMemory]):
    """A signal of the controller's samples that must not change faster than a limit, in either direction.

    Parameters
    ----------
    name, signal, unit, label : str
        As of :class:`bufferstand.daq.guards.kinds.channel.ChannelGuard`; ``unit`` is that of the speed.
    limit : float
        Largest speed, in ``unit``.
    action : Action
        What the trip leads to.
    window : int
        The speed is the difference over so many samples: noise must not look like speed.
    """

    kind: ClassVar = "speeds"
    title: ClassVar = "how fast the stroke changes"
    settings: ClassVar = ("guards.speed_trip_mm_per_s", "guards.action.speed")
    facts_as: ClassVar = "list"
    docs: ClassVar = ("`speed`",)
    looks_at: ClassVar = (Samples,)
    turn: ClassVar = 80
    remembers: ClassVar = SpeedMemory
    of_zero: ClassVar = True

    name: str
    signal: str
    limit: float
    unit: str
    label: str
    action: Action = Action.STOP
    window: int = 20

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return that of the stroke."""
        limit = site.table.speed_trip_mm_per_s or SPEED_FACTOR * site.envelope.speed.value
        label = "stroke (mean of the draw wires on the specimen)"
        yield cls("speed", "stroke", limit, "mm/s", label, site.does("speed"))

    @property
    def key(self) -> str:
        """Return its name."""
        return self.name

    def look(self, memory: SpeedMemory, sight: Sight, beside: Beside) -> tuple[SpeedMemory, Found]:
        """Judge every sample of a block that has the signal."""
        return evaluate_speed(self, memory, sight.block) if isinstance(sight, Samples) else (memory, None)

    def margin(self, memory: SpeedMemory, beside: Beside) -> Margin:
        """Return the greatest speed of late, either way."""
        span, action = memory.peaks.span(), self.action
        if span is None:
            return Margin(self.name, "speed", f"trips at {self.limit:g} {self.unit}", None, action)
        value = max(-span[0], span[1])
        text = f"{value:.0f} of {self.limit:g} {self.unit}, {max(0.0, self.limit - value):.0f} left"
        return Margin(self.name, "speed", text, value / self.limit, action)


def evaluate_speed(
    guard: SpeedGuard, memory: SpeedMemory, block: ScaledBlock
) -> tuple[SpeedMemory, Trip | None]:
    """Judge every sample of a block against the one ``window`` samples before it, by their time stamps.

    A gap as long as the window begins anew.
    """
    new = block.values.get(guard.signal)
    if new is None or not len(new):
        return memory, None
    if block.lost >= guard.window:
        memory = SpeedMemory(peaks=memory.peaks)
    time_us = np.concatenate((memory.time_us, block.time_us))
    value = np.concatenate((memory.value, new))
    kept = time_us[-guard.window :], value[-guard.window :]
    if len(value) <= guard.window:
        return SpeedMemory(*kept, memory.peaks), None
    span_s = np.maximum(time_us[guard.window :] - time_us[: -guard.window], 1) / 1e6
    speed = (value[guard.window :] - value[: -guard.window]) / span_s
    least, greatest = float(speed.min()), float(speed.max())
    known = math.isfinite(least) and math.isfinite(greatest)
    peaks = memory.peaks.seen(block.received_s, least, greatest) if known else memory.peaks
    after = SpeedMemory(*kept, peaks)
    beyond = np.flatnonzero(np.abs(speed) > guard.limit)  # no number: the channel's guard says it
    if not len(beyond):
        return after, None
    row = int(beyond[0])
    sequence = block.first_sequence + len(new) - len(speed) + row
    at_us = int(time_us[guard.window + row])
    return after, Trip(
        guard.name,
        guard.action,
        f"{guard.label} changes at {speed[row]:+.0f} {guard.unit}, faster than {guard.limit:.0f} "
        f"(sample {sequence} at {at_us / 1e6:.3f} s of the device's clock)",
        block.received_s,
        value=float(speed[row]),
        limit=guard.limit,
        unit=guard.unit,
        stream=block.stream,
        sequence=sequence,
        time_us=at_us,
    )


HeatingMemory = tuple[tuple[float, float], ...]
"""Readings of the window: time of the stand [s] and temperature [°C]."""


@dataclass(frozen=True)
class HeatingGuard(Guard[HeatingMemory]):
    """A specimen's sensor must not rise faster than a limit: heat that no step of a plan makes.

    Parameters
    ----------
    stream, label : str
        The sensor.
    limit_K_per_min : float
        Largest rise.
    action : Action
        What the trip leads to.
    window_s : float
        The rise is taken over this time of the readings [s]; over half of it at least.
    """

    kind: ClassVar = "heating"
    title: ClassVar = "how fast the specimen warms up"
    settings: ClassVar = ("guards.heating_max_K_per_min", "guards.action.heating")
    facts_as: ClassVar = "list"
    docs: ClassVar = ("`heating of …`",)
    looks_at: ClassVar = (Samples,)
    turn: ClassVar = 30
    remembers: ClassVar = tuple

    stream: str
    label: str
    limit_K_per_min: float
    action: Action = Action.STOP
    window_s: float = 20.0

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return one for each thermometer on the specimen."""
        for thermometer in TemperatureGuard.made_for(site):
            if thermometer.stop_C is not None:
                limit = site.table.heating_max_K_per_min
                yield cls(thermometer.stream, thermometer.label, limit, site.does("heating"))

    @property
    def key(self) -> str:
        """Return the sensor's stream."""
        return self.stream

    def look(self, memory: HeatingMemory, sight: Sight, beside: Beside) -> tuple[HeatingMemory, Found]:
        """Judge the sensor's reading, after its own guard has said whether it is true."""
        if not isinstance(sight, Samples) or sight.block.stream != self.stream:
            return memory, None
        return evaluate_heating(self, memory, sight.block, beside.latest_temperatures().get(self.stream))

    def during(self, phase: Phase) -> Self | None:
        """Return nothing where no step heats the specimen."""
        return None if phase is Phase.COOLING else self

    def margin(self, memory: HeatingMemory, beside: Beside) -> Margin:
        """Return how fast its readings rise."""
        name, limit, rate = f"heating {self.stream}", self.limit_K_per_min, self.rate_K_per_min(memory)
        action = self.action
        if rate is None:
            return Margin(name, name, f"trips at {limit:g} K/min", None, action)
        return Margin(name, name, f"{rate:+.1f} of {limit:g} K/min", max(0.0, rate / limit), action)

    def rate_K_per_min(self, memory: HeatingMemory) -> float | None:  # noqa: N802 - the unit keeps its capital
        """Return how fast the readings of a window rise, None where they reach back too little."""
        if len(memory) < 2 or memory[-1][0] - memory[0][0] < 0.5 * self.window_s:
            return None
        return (memory[-1][1] - memory[0][1]) / (memory[-1][0] - memory[0][0]) * 60.0


def evaluate_heating(
    guard: HeatingGuard, memory: HeatingMemory, block: ScaledBlock, last_true_C: float | None
) -> tuple[HeatingMemory, Trip | None]:
    """Judge the newest reading of a block; one that is not the sensor's last true reading is left out."""
    values = block.values.get(guard.stream)
    if values is None or not len(values) or float(values[-1]) != last_true_C:
        return memory, None
    time_s, value_C = float(block.time_us[-1]) / 1e6, float(values[-1])
    kept = tuple((at, value) for at, value in memory if time_s - guard.window_s <= at < time_s)
    after = (*kept, (time_s, value_C))
    rate = guard.rate_K_per_min(after)
    if rate is None or rate <= guard.limit_K_per_min:
        return after, None
    sequence = block.first_sequence + len(values) - 1
    return after, Trip(
        f"heating of {guard.stream}",
        guard.action,
        f"{guard.label} rises by {rate:.1f} K/min, faster than {guard.limit_K_per_min:g}: "
        f"{value_C:.2f} °C after {kept[0][1]:.2f} °C {time_s - kept[0][0]:.0f} s before "
        f"(reading {sequence} at {time_s:.1f} s): "
        "look at the specimen for smoke and at the sensor",
        block.received_s,
        value=rate,
        limit=guard.limit_K_per_min,
        unit="K/min",
        stream=block.stream,
        sequence=sequence,
        time_us=int(block.time_us[-1]),
    )
