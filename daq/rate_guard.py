"""Guards of how fast something changes: the stroke in milliseconds, the specimen's temperature in minutes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards import Action, Trip
from bufferstand.daq.scaling import ScaledBlock


@dataclass(frozen=True)
class SpeedGuard:
    """A signal of the controller's samples that must not change faster than a limit, in either direction.

    Parameters
    ----------
    name, signal, unit, label : str
        As of :class:`bufferstand.daq.guards.ChannelGuard`; ``unit`` is that of the speed.
    limit : float
        Largest speed, in ``unit``.
    action : Action
        What the trip leads to.
    window : int
        The speed is the difference over so many samples: noise must not look like speed.
    """

    name: str
    signal: str
    limit: float
    unit: str
    label: str
    action: Action = Action.STOP
    window: int = 20


@dataclass(frozen=True)
class SpeedMemory:
    """The last ``window`` samples: time stamps [µs] and values."""

    time_us: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    value: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))


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
        memory = SpeedMemory()
    time_us = np.concatenate((memory.time_us, block.time_us))
    value = np.concatenate((memory.value, new))
    after = SpeedMemory(time_us[-guard.window :], value[-guard.window :])
    if len(value) <= guard.window:
        return after, None
    span_s = np.maximum(time_us[guard.window :] - time_us[: -guard.window], 1) / 1e6
    speed = (value[guard.window :] - value[: -guard.window]) / span_s
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


@dataclass(frozen=True)
class HeatingGuard:
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

    stream: str
    label: str
    limit_K_per_min: float
    action: Action = Action.STOP
    window_s: float = 20.0


HeatingMemory = tuple[tuple[float, float], ...]
"""Readings of the window: time of the stand [s] and temperature [°C]."""


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
    if not kept or time_s - kept[0][0] < 0.5 * guard.window_s:
        return after, None
    rate = (value_C - kept[0][1]) / (time_s - kept[0][0]) * 60.0
    if rate <= guard.limit_K_per_min:
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
