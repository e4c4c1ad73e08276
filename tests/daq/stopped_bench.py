"""Thermometers on a heated specimen by closed forms, right ones and ones that freeze; no stand is in it.

The specimen is one heat capacity with a loss to the air; the sensor follows in one to three stages, as on the
cold end of a draw gear. Heat comes in waveforms and slow strokes with rests and waits to cool between them.

``python -m tests.daq.stopped_bench N`` judges N right ones, and each again with the sensor frozen.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from bufferstand.daq.guards.wiring.temperatures.heat import AIR_K, COOLS_S, believed_lag_s, most_J_per_K
from bufferstand.daq.guards.wiring.temperatures.stopped_sensor import STEP_K, HeatAtReading, StoppedSensor

Floats = np.ndarray
BEFORE_S = 20.0
"""The sensor shows the specimen for so long before any heat comes."""


@dataclass(frozen=True)
class Body:
    """A specimen, its sensor, and what is done to it."""

    capacity_J_per_K: float = 15000.0
    cools_s: float = 1500.0
    lag_s: float = 20.0
    stages: int = 1
    gain: float = 1.0
    """Share of the specimen's excess over the air that the sensor shows."""
    start_C: float = 21.0
    air_C: float = 21.0
    air_K_per_h: float = 0.0
    noise_K: float = 0.0
    step_K: float = STEP_K
    period_s: float = 1.0
    stated_times: float | None = 1.0
    """The stated heat capacity over the true one; None: not stated."""
    stated_lag_s: float | None = 20.0
    knows_air: bool = True
    heating: tuple[tuple[float, float, float], ...] = ((1000.0, 1.0, 600.0),)
    """Mean power [W], period of the cycles, at whose end their heat is counted [s], duration [s]."""
    freezes_s: float | None = None
    seed: int = 1


@dataclass(frozen=True)
class Shown:
    """Readings, shape (n,), and what has been absorbed until then."""

    time_s: Floats
    reading_C: Floats
    absorbed_J: Floats
    power_W: Floats


def shown_by(body: Body) -> Shown:
    """Return what the sensor shows, a second's grid between readings."""
    random = np.random.default_rng(body.seed)
    power, lumps = [np.zeros(int(BEFORE_S))], [np.zeros(int(BEFORE_S))]
    for power_W, cycle_s, duration_s in body.heating:
        count = max(1, int(duration_s))
        power.append(np.full(count, power_W))
        done = np.floor((np.arange(count) + 1.0) / cycle_s) - np.floor(np.arange(count) / cycle_s)
        lumps.append(power_W * cycle_s * done)
    power_W, lump_J = np.concatenate(power), np.concatenate(lumps)
    own, stages = body.start_C, [body.start_C] * body.stages
    share = -np.expm1(-body.stages / body.lag_s)
    felt = np.empty(len(power_W))
    for second, watt in enumerate(power_W):
        air_C = body.air_C + body.air_K_per_h * second / 3600.0
        own += watt / body.capacity_J_per_K - (own - air_C) / body.cools_s
        follows = air_C + body.gain * (own - air_C)
        for one in range(body.stages):
            stages[one] += share * (follows - stages[one])
            follows = stages[one]
        felt[second] = follows
    felt = felt + body.noise_K * random.standard_normal(len(felt))
    read = np.arange(0, len(felt), max(1, int(body.period_s)))
    reading_C = np.round(felt[read] / body.step_K) * body.step_K
    if body.freezes_s is not None:
        first = int(np.searchsorted(read, body.freezes_s))
        reading_C[first:] = reading_C[max(0, first - 1)]
    return Shown(read.astype(float), reading_C, np.cumsum(lump_J)[read], power_W[read])


def heats_of(body: Body, shown: Shown) -> Iterable[HeatAtReading]:
    """Yield what the judge of the heat hands on with each reading."""
    stated = None if body.stated_times is None else body.stated_times * body.capacity_J_per_K
    air_C = (body.air_C if body.knows_air else 21.0) - AIR_K[not body.knows_air]
    lag_s = believed_lag_s(body.stated_lag_s)
    for at_s, absorbed_J in zip(shown.time_s, shown.absorbed_J, strict=True):
        rose_K = body.air_K_per_h * at_s / 3600.0 if body.knows_air else 0.0
        yield HeatAtReading(float(absorbed_J), air_C, float(rose_K), most_J_per_K(stated), COOLS_S, lag_s)


def stopped_at_s(body: Body) -> float | None:
    """Return when the sensor is said to have stopped, None where it is not [s]."""
    shown, sensor = shown_by(body), StoppedSensor()
    for at_s, reading_C, heat in zip(shown.time_s, shown.reading_C, heats_of(body, shown), strict=True):
        if sensor.take(float(at_s), float(reading_C), heat) is not None:
            return float(at_s)
    return None


def right_body(seed: int) -> Body:
    """Return a right specimen and sensor at random, over one to three hours."""
    random = np.random.default_rng(seed)

    def pick(*values: float) -> float:
        return float(values[random.integers(len(values))])

    capacity = float(np.exp(random.uniform(np.log(5e3), np.log(8e4))))
    hot_W = capacity * pick(0.002, 0.01, 0.03, 0.08)
    heating: list[tuple[float, float, float]] = []
    for _ in range(random.integers(2, 7)):
        power_W = hot_W * float(np.exp(random.uniform(np.log(0.1), 0.0)))
        cycle_s = pick(0.3, 1.0, 5.0, 30.0, 100.0)
        heating.append((power_W, cycle_s, max(2.0 * cycle_s, pick(20.0, 60.0, 300.0, 1200.0))))
        heating.append((0.0, 1.0, pick(5.0, 30.0, 120.0, 600.0, 1800.0)))
    if random.integers(3) == 0:  # until losses equal the heat
        heating.append((hot_W * 0.2, pick(1.0, 10.0), 5400.0))
    return Body(
        capacity_J_per_K=capacity,
        cools_s=pick(700.0, 1200.0, 2000.0, 4000.0),
        lag_s=pick(5.0, 20.0, 60.0, 120.0, 300.0),
        stages=int(pick(1, 1, 2, 3)),
        gain=pick(1.0, 1.0, 0.8, 0.6),
        start_C=pick(21.0, 21.0, 10.0, 30.0, 36.0),
        air_K_per_h=pick(0.0, 0.0, 1.0, -1.0),
        noise_K=pick(0.0, 0.0, 0.01, 0.03),
        step_K=pick(STEP_K, STEP_K, STEP_K, 2.0 * STEP_K, 8.0 * STEP_K),
        period_s=pick(1.0, 1.0, 2.0, 10.0),
        stated_times=None if random.integers(3) == 0 else random.uniform(0.6, 1.6),
        stated_lag_s=None if random.integers(2) else pick(20.0, 60.0),
        knows_air=bool(random.integers(4)),
        heating=tuple(heating),
        seed=seed,
    )  # fmt: skip


def hottest(body: Body) -> tuple[float, float]:
    """Return the middle of the longest of the strong heatings, and its power [s, W]."""
    at_s, found = BEFORE_S, (0.0, 0.0, 0.0)
    for power_W, _, duration_s in body.heating:
        found = max(found, (power_W * duration_s, at_s + 0.4 * duration_s, power_W))
        at_s += max(1, int(duration_s))
    return found[1], found[2]


def right_alarms(seeds: Iterable[int]) -> list[str]:
    """Return which right sensors are said to have stopped, and when."""
    found = []
    for seed in seeds:
        at_s = stopped_at_s(right_body(seed))
        if at_s is not None:
            found.append(f"{seed}: {at_s:.0f} s")
    return found


def main(count: int) -> None:
    """Print what the study finds."""
    alarms = right_alarms(range(count))
    print(f"{count} right sensors, {len(alarms)} doubted", *alarms, sep="\n  ")
    for lag_s in (5.0, 20.0, 60.0, 120.0, 300.0):
        for power_W in (300.0, 1000.0, 3000.0):
            line = []
            for stated in (1.0, None):
                own = Body(
                    lag_s=lag_s, stated_times=stated, stated_lag_s=20.0 if stated else None,
                    heating=((power_W, 1.0, 1200.0),), freezes_s=320.0,
                )  # fmt: skip
                at_s = stopped_at_s(own)
                line.append("nothing" if at_s is None else f"{at_s - 320.0:.0f} s")
            print(f"frozen, lag {lag_s:.0f} s, {power_W:.0f} W: {line[0]}, capacity not stated {line[1]}")
    after = []
    for seed in range(count):
        body = right_body(seed)
        from_s, _ = hottest(body)
        at_s = stopped_at_s(replace(body, freezes_s=from_s))
        after.append(np.inf if at_s is None else at_s - from_s)
    named = np.array(after)[np.isfinite(after)]
    quarters = np.quantile(named, (0.25, 0.5, 0.75)) if len(named) else np.array([])
    print(f"frozen at random: {len(named)} of {count} named, quartiles {np.round(quarters)} s")


if __name__ == "__main__":
    main(int(sys.argv[1]))
