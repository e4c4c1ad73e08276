"""Records of several steps in closed form: blocks of sines, sweeps, strokes of different height."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Record, Temperature, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.run_kinds import Kind
from tests.evaluation.signals import STATED, Floats

STORAGE, LOSS, MEAN_kN = 4.0, 0.6, 250.0


@dataclass(frozen=True)
class Block:
    """Sines of one step: x = mean - amplitude cos(ωt); F = F_m + K′(x - 50) + K″ dx/dt / ω."""

    amplitude_mm: float = 20.0
    frequency_Hz: float = 1.0
    mean_mm: float = 50.0
    cycles: int = 8

    @property
    def damping(self) -> float:
        """W_a / W_s of the closed form."""
        absorbed = np.pi * LOSS * self.amplitude_mm**2
        at_mean = MEAN_kN + STORAGE * (self.mean_mm - 50.0)
        return float(absorbed / (2.0 * self.amplitude_mm * at_mean + 0.5 * absorbed))


def columns(
    blocks: Sequence[Block], *, rate_Hz: float = 200.0, ramp_s: float = 0.5, noise: float = 0.0, seed: int = 1
) -> tuple[Floats, Floats, Floats]:
    """Return time, stroke, force of blocks with smooth ramps between them; ``noise`` in mm and 10 kN."""
    stroke: list[Floats] = []
    force: list[Floats] = []
    for block in blocks:
        begin = block.mean_mm - block.amplitude_mm
        if stroke and ramp_s:
            share = np.linspace(0.0, 1.0, round(ramp_s * rate_Hz), endpoint=False)
            ramp = stroke[-1][-1] + (begin - stroke[-1][-1]) * share**2 * (3.0 - 2.0 * share)
            stroke.append(ramp)
            force.append(MEAN_kN + STORAGE * (ramp - 50.0))
        angle = 2.0 * np.pi * np.arange(round(block.cycles * rate_Hz / block.frequency_Hz))
        angle *= block.frequency_Hz / rate_Hz
        own = block.mean_mm - block.amplitude_mm * np.cos(angle)
        stroke.append(own)
        turned = LOSS * block.amplitude_mm * np.sin(angle)
        force.append(MEAN_kN + STORAGE * (own - 50.0) + turned)
    x, f = np.concatenate(stroke), np.concatenate(force)
    random = np.random.default_rng(seed)
    x = x + noise * random.standard_normal(x.size)
    return np.arange(x.size) / rate_Hz, x, f + 10.0 * noise * random.standard_normal(x.size)


def sweep(
    from_Hz: float, to_Hz: float, *, from_mm: float = 20.0, to_mm: float = 20.0, lasts_s: float = 60.0
) -> tuple[Floats, Floats, Floats]:
    """Return a sine whose frequency and amplitude change little by little, each linearly in time."""
    time = np.arange(0.0, lasts_s, 1.0 / 200.0)
    angle = 2.0 * np.pi * (from_Hz * time + 0.5 * (to_Hz - from_Hz) / lasts_s * time**2)
    amplitude = from_mm + (to_mm - from_mm) * time / lasts_s
    random = np.random.default_rng(2)
    stroke = 50.0 - amplitude * np.cos(angle) + 0.005 * random.standard_normal(time.size)
    force = MEAN_kN + STORAGE * (stroke - 50.0) + LOSS * amplitude * np.sin(angle)
    return time, stroke, force


def strokes(tops_mm: Sequence[float], speeds_mm_per_s: Sequence[float] = ()) -> tuple[Floats, Floats, Floats]:
    """Return a static run of strokes of given height, released fully between them."""
    points, now = [(0.0, 0.0), (2.0, 0.0)], 2.0
    speeds = speeds_mm_per_s or [5.0] * len(tops_mm)
    for top, speed in zip(tops_mm, speeds, strict=True):
        for step_s, stroke in ((top / speed, top), (top / speed, 0.0), (4.0, 0.0)):
            now += step_s
            points.append((now, stroke))
    knots = np.array(points)
    time = np.arange(round(now * 50.0) + 1) / 50.0
    stroke = np.interp(time, knots[:, 0], knots[:, 1])
    rising = np.diff(stroke, prepend=-1e-9) >= 0.0
    force = 15.0 + 2.0 * stroke + 3.8e-6 * stroke**4
    force = np.where(rising, force, 0.45 * force)
    random = np.random.default_rng(3)
    noise = random.standard_normal((2, time.size))
    return time, stroke + 0.01 * noise[0], force + 0.1 * noise[1]


def record_of(given: tuple[Floats, Floats, Floats], *, temperature_C: float | None = 20.0) -> Record:
    """Return a record of columns, at a temperature that stays."""
    time = given[0]
    sensors = []
    if temperature_C is not None:
        at = np.arange(0.0, time[-1], 1.0)
        sensors = [Temperature("temperature_1", at, np.full(at.size, temperature_C), accuracy_C=0.5)]
    return make_record(*given, temperatures=sensors)


def evaluated(
    given: tuple[Floats, Floats, Floats],
    kind: Kind = "harmonic",
    *,
    name: str = "stepped",
    temperature_C: float | None = 20.0,
    draws: int = 0,
) -> RunEvaluation:
    """Evaluate columns; without draws only the figures."""
    facts = RunFacts(name, kind, specimen={"id": "B1"}, **STATED)
    return evaluate_run(record_of(given, temperature_C=temperature_C), facts, Options(draws=draws))
