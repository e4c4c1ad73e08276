"""Kinds of wrong wiring, scale and sensor, and right campaigns at random: for the tests and for the study.

``python -m tests.daq.wiring_kinds N M`` judges N right campaigns and every kind of wrong one on M of them.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tests.daq.wiring_bench import (
    Case,
    Floats,
    Signals,
    Wrong,
    both,
    exchanged,
    judge,
    late,
    scaled,
    signals_of,
    slips,
    thermometers,
    unhooked,
)


@dataclass(frozen=True)
class Kind:
    """What is wrong, the sensors that may be named, and what is said of them."""

    wrong: Wrong
    sensors: tuple[str, ...]
    doubts: tuple[str, ...]
    long: bool = False
    """It needs heat, or half a stroke, to happen."""


def _force(*doubts: str, **how: float) -> Kind:
    return Kind(scaled("force", **how), ("force",), doubts or ("scale",))


def _both_wires(by: float, *doubts: str) -> Kind:
    return Kind(scaled("stroke_1", "stroke_2", by=by), ("stroke_1, stroke_2",), doubts or ("scale",))


WIRED: Mapping[str, Kind] = {
    "force: sign": _force("sign", by=-1.0),
    "force: a tenth": _force(by=0.1),
    "force: ten times": _force(by=10.0),
    "force: half": _force(by=0.5),
    "force: twice": _force(by=2.0),
    "force: t for kN": _force(by=1.0 / 9.80665),
    "force: kip for kN": _force(by=4.4482),
    "force: zero 5 kN off": _force("zero", plus=5.0),
    "force: 0.8 s late": Kind(late("force", by_s=0.8), ("force",), ("still", "delay", "disagrees")),
    "force: 50 ms late": Kind(late("force", by_s=0.05), ("force",), ("delay",)),
    "force: low pass of 0.5 Hz": Kind(late("force", low_pass_Hz=0.5), ("force",), ("disagrees", "delay")),
    "both forces: sign": Kind(scaled("force", "force_2", by=-1.0), ("force",), ("sign",)),
    "both forces: a tenth": Kind(scaled("force", "force_2", by=0.1), ("force",), ("scale",)),
    "both forces: ten times": Kind(scaled("force", "force_2", by=10.0), ("force",), ("scale",)),
    "both forces: half": Kind(scaled("force", "force_2", by=0.5), ("force",), ("scale",)),
    "both forces: twice": Kind(scaled("force", "force_2", by=2.0), ("force",), ("scale",)),
    "second force: sign": Kind(scaled("force_2", by=-1.0), ("force_2",), ("sign",)),
    "second force: a tenth": Kind(scaled("force_2", by=0.1), ("force_2",), ("scale",)),
    "second force: 0.3 s late": Kind(late("force_2", by_s=0.3), ("force_2",), ("delay",)),
    "wire: sign": Kind(scaled("stroke_1", by=-1.0), ("stroke_1",), ("sign",)),
    "wire: half": Kind(scaled("stroke_1", by=0.5), ("stroke_1",), ("scale",)),
    "wire: twice": Kind(scaled("stroke_1", by=2.0), ("stroke_1",), ("scale",)),
    "wires: half": _both_wires(0.5),
    "wires: twice": _both_wires(2.0),
    "wires: mm for inches": _both_wires(1.0 / 25.4, "still"),
    "wires: 15 mm off": Kind(scaled("stroke_1", "stroke_2", plus=15.0), ("stroke_1, stroke_2",), ("zero",)),
    "wire: unhooked": Kind(unhooked("stroke_1"), ("stroke_1",), ("still",)),
    "wires: 0.1 s late": Kind(late("stroke_1", "stroke_2", by_s=0.1), ("stroke_1, stroke_2",), ("delay",)),
    "piston: 1.1 times": Kind(scaled("position", by=1.1), ("position",), ("scale",)),
    "piston: twice": Kind(scaled("position", by=2.0), ("position",), ("scale", "zero")),
    "piston: inches": Kind(scaled("position", by=1.0 / 25.4), ("position",), ("scale", "zero")),
    "piston: sign": Kind(scaled("position", by=-1.0), ("position",), ("sign",)),
    "piston and command: 1.1 times": Kind(
        scaled("position", "command", by=1.1), ("stroke_1, stroke_2",), ("scale",)
    ),
    "force and wire exchanged": Kind(exchanged("force", "stroke_1"), ("force, stroke_1",), ("swapped",)),
}
"""Each must be named within the first fifth of the first full stroke."""


def _falls(tau_s: float) -> Wrong:
    def hung(signals: Signals) -> Floats:
        value = signals.readings_C["temperature_1"].copy()
        at = int(np.argmax(signals.reading_s > 90.0))
        passed_s = signals.reading_s[at:] - signals.reading_s[at]
        air_C = signals.case.air_C
        value[at:] = np.round((air_C + (value[at] - air_C) * np.exp(-passed_s / tau_s)) * 16.0) / 16.0
        return value

    return thermometers(temperature_1=hung)


def _repeats(signals: Signals) -> Floats:
    value = signals.readings_C["temperature_1"].copy()
    value[5:] = value[5]
    return value


def _of(name: str) -> Wrong:
    return thermometers(temperature_1=lambda signals: signals.readings_C[name])


LATER: Mapping[str, Kind] = {
    "wire: slips by 5 mm": Kind(slips("stroke_1", 5.0), ("stroke_1",), ("slipped",)),
    "wires: both slip by 5 mm": Kind(
        both(slips("stroke_1", 5.0), slips("stroke_2", 5.0)), ("stroke_1, stroke_2",), ("slipped",)
    ),
}
WARM = Case(sines=((50.0, 25.0, 1.0, 120),), static_first=False, static_mm=1.0, block_s=0.2)
"""A campaign with much heat: 1 kW."""
THERMAL: Mapping[str, Kind] = {
    "thermometers swapped": Kind(
        thermometers(
            temperature_1=lambda signals: signals.readings_C["temperature_3"],
            temperature_3=lambda signals: signals.readings_C["temperature_1"],
        ),
        ("temperature_1, temperature_3",),
        ("swapped",),
    ),
    "specimen's never attached": Kind(_of("temperature_3"), ("temperature_1",), ("no heat",)),
    "room's lies on the specimen": Kind(
        thermometers(temperature_3=lambda signals: signals.readings_C["temperature_2"]),
        ("temperature_3",),
        ("follows the specimen",),
    ),
    "falls off, 60 s": Kind(_falls(60.0), ("temperature_1",), ("fallen off",)),
    "falls off, 15 s": Kind(_falls(15.0), ("temperature_1",), ("fallen off",)),
    "falls off, at once": Kind(_falls(0.1), ("temperature_1",), ("fallen off",)),
    "repeats an old value": Kind(thermometers(temperature_1=_repeats), ("temperature_1",), ("no heat",)),
}


def conditioner(random: np.random.Generator) -> tuple[float, float | None]:
    """Return an ordinary delay [s] and low pass [Hz] of a conditioner that nobody has stated."""
    return (
        float(random.choice([0.0, 0.0, 0.005, 0.02])),
        (None, None, 20.0, 50.0, 100.0)[random.integers(5)],
    )


def right_case(seed: int) -> Case:
    """Return a right campaign at random: specimens up to 40 % off, gaps, zeros, lags, slow sensors …"""
    random = np.random.default_rng(seed)

    def pick(*values: float) -> float:
        return float(values[random.integers(len(values))])

    buffer = bool(random.integers(3))
    far_mm = 80.0 if buffer else 36.0
    sines = []
    for _ in range(random.integers(1, 3)):
        mean = random.uniform(0.2, 0.6) * far_mm
        amplitude = random.uniform(0.2, 0.9) * min(mean, far_mm - mean)
        frequency = min(2.5, pick(20.0, 80.0, 160.0, 300.0) / (2.0 * np.pi * amplitude))
        sines.append((mean, amplitude, frequency, int(random.integers(2, 6))))
    of_force = conditioner(np.random.default_rng(seed + 10_000))
    of_second = conditioner(np.random.default_rng(seed + 20_000))
    return Case(
        model="category-a-elastomer" if buffer else "draw-hook-elastomer",
        factor=random.uniform(0.6, 1.4),
        static_mm_per_s=pick(1.0, 5.0, 20.0, 50.0),
        static_mm=random.uniform(0.4, 0.95) * far_mm,
        sines=tuple(sines),
        static_first=bool(random.integers(2)),
        counted=bool(random.uniform() < 0.7),
        contact_mm=random.uniform(0.0, 10.0),
        wire_zero_mm=(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)),
        force_zero_kN=random.uniform(-2.0, 2.0),
        frame_kN_per_mm=pick(100.0, 120.0, 150.0, 300.0),
        stated_frame_kN_per_mm=None if random.integers(3) == 0 else 150.0,
        lag_s=pick(0.005, 0.02, 0.05, 0.1),
        reversal_s=pick(0.0, 0.01, 0.03, 0.05),
        force_noise_kN=pick(0.05, 0.15, 0.4),
        stroke_noise_mm=pick(0.005, 0.01, 0.03),
        tilt=random.uniform(-0.005, 0.005),
        latency_s=pick(0.0, 0.002, 0.01),
        lost=pick(0.0, 0.0, 0.01, 0.03),
        wires=int(pick(2, 2, 1)),
        second=bool(random.uniform() < 0.7),
        start_C=pick(5.0, 15.0, 21.0, 30.0, 36.0),
        sensor_s=pick(5.0, 20.0, 60.0, 120.0),
        capacity_times=random.uniform(0.6, 1.6),
        friction_kN=pick(0.0, 0.0, 2.0, 4.0),
        knows_model=bool(random.uniform() < 0.9),
        force_late_s=of_force[0],
        force_low_pass_Hz=of_force[1],
        second_late_s=of_second[0],
        second_low_pass_Hz=of_second[1],
        seed=seed,
    )


def plain_case(seed: int) -> Case:
    """Return a right campaign at random in which everything that can be seen is there to be seen: two wires,
    two forces without a delay, a model that is right, first contact touched off, and a slow first stroke."""
    own = right_case(seed)
    return replace(
        own, second=True, wires=2, counted=True, static_first=True, knows_model=True, factor=1.0,
        static_mm_per_s=min(own.static_mm_per_s, 5.0), contact_mm=max(own.contact_mm, 1.0),
        force_late_s=0.0, force_low_pass_Hz=None, second_late_s=0.0, second_low_pass_Hz=None,
    )  # fmt: skip


def false_alarms(seeds: Iterable[int]) -> list[str]:
    """Return what was doubted of right campaigns."""
    found = []
    for seed in seeds:
        verdict = judge(signals_of(right_case(seed)))
        if verdict.trip is not None:
            found.append(f"{seed}: {verdict.trip.reason}")
    return found


def warm_alarms(seeds: Iterable[int]) -> list[str]:
    """Return what was doubted of right campaigns of much heat, with slow and quick sensors."""
    found = []
    for seed in seeds:
        own = right_case(seed)
        case = replace(
            WARM, sensor_s=own.sensor_s, capacity_times=own.capacity_times, start_C=own.start_C,
            factor=own.factor, knows_model=own.knows_model, seed=seed,
        )  # fmt: skip
        verdict = judge(signals_of(case))
        if verdict.trip is not None:
            found.append(f"{seed}: {verdict.trip.reason}")
    return found


def main(right: int, wrong: int) -> None:
    """Print what the study finds."""
    alarms = false_alarms(range(right)) + warm_alarms(range(right // 10))
    print(
        f"right campaigns: {right} + {right // 10} of much heat, {len(alarms)} doubted", *alarms, sep="\n  "
    )
    for name, kind in {**WIRED, **LATER}.items():
        shares, named = [], 0
        for seed in range(wrong):
            case = plain_case(seed)
            verdict = judge(kind.wrong(signals_of(case)))
            shares.append(verdict.share if verdict.trip else np.inf)
            named += verdict.trip is not None and verdict.trip.sensor in kind.sensors
        print(f"{name:32s} named {named} of {wrong}, at {100.0 * float(np.max(shares)):.0f} % at most")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
