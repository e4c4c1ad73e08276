"""Draws of figures that are no integrals of the loop: strokes, frequency, speeds, distortion, temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from evaluation.error_model import Draws, stroke_term_slopes
from evaluation.motion import Cycle
from evaluation.quantities import SPEED_WINDOW
from evaluation.record import FloatArray, Temperature
from evaluation.results import CycleResult
from evaluation.uncertainty import PEAK_OF_NOISE, CyclePropagation, stroke_figures, turn_draws

_DISTORTING = range(2, 11)
"""Harmonics of the stroke that count as distortion."""


def stroke_draws(draws: Draws, cycle: Cycle) -> dict[str, FloatArray]:
    """Return the figures of a cycle's turning points of every draw, complete cycle or not."""
    return stroke_figures(*turn_draws(draws, cycle))


def further_draws(
    draws: Draws, propagation: CyclePropagation, result: CycleResult, temperatures: Sequence[Temperature]
) -> dict[str, FloatArray]:
    """Return frequency, speeds, distortion and temperatures of a complete cycle of every draw."""
    cycle, figures = propagation.cycle, result.quantities
    noise = draws.generator.standard_normal((3, draws.time_base.size))
    drawn: dict[str, FloatArray] = {}
    if figures.frequency_Hz is not None:
        u_share = float(np.hypot(cycle.start.u_time_s, cycle.end.u_time_s)) / cycle.duration_s
        drawn["frequency_Hz"] = figures.frequency_Hz * (1.0 + draws.time_base + u_share * noise[0])
    mean_mm = 0.5 * (cycle.stroke_min_mm + cycle.stroke_max_mm)
    stretch = 1.0 + np.einsum("ni,i->n", draws.stroke, stroke_term_slopes(mean_mm)) + draws.time_base
    branches = {"speed_loading_max_mm_per_s": 1, "speed_unloading_max_mm_per_s": 2}
    for name, row in branches.items():
        speed = getattr(figures, name)
        if speed is not None:
            drawn[name] = speed * stretch + _speed_noise(propagation, loading=row == 1) * noise[row]
    if figures.stroke_distortion is not None:
        drawn["stroke_distortion"] = _distortion(draws, propagation)
    return drawn | temperature_draws(draws, result, temperatures)


def temperature_draws(
    draws: Draws, result: CycleResult, temperatures: Sequence[Temperature]
) -> dict[str, FloatArray]:
    """Return the temperatures of every draw; nothing where a sensor on the specimen states no accuracy."""
    sensors = [sensor.accuracy_C for sensor in temperatures if sensor.role == "specimen"]
    limits = [limit for limit in sensors if limit is not None]
    if not sensors or len(limits) < len(sensors):
        return {}
    values: Mapping[str, float | None] = {
        name: getattr(result.quantities, name) for name in ("temperature_start_C", "temperature_max_C")
    }
    return {n: v + max(limits) * draws.thermometer for n, v in values.items() if v is not None}


def _speed_noise(propagation: CyclePropagation, *, loading: bool) -> float:
    """Return the standard deviation that noise gives the largest slope of a local parabola [mm/s]."""
    loop = propagation.loop
    time_s = loop.time_s[loop.loading if loading else loop.unloading]
    window = max(5.0, SPEED_WINDOW * time_s.size)
    step_s = float(time_s[-1] - time_s[0]) / max(1, time_s.size - 1)
    gain = np.sqrt(12.0 / (window * (window**2 - 1.0))) / step_s
    point_mm = propagation.noise.stroke_mm / np.sqrt(propagation.samples_a_point)
    return float(PEAK_OF_NOISE * gain * point_mm)


def _distortion(draws: Draws, propagation: CyclePropagation) -> FloatArray:
    """Return the distortion of every draw: a deviation from the straight line makes harmonics of its own."""
    loop, cycle = propagation.loop, propagation.cycle
    drift = (loop.time_s - cycle.start_s) / cycle.duration_s
    closed = propagation.stroke - np.outer(propagation.stroke[:, -1] - propagation.stroke[:, 0], drift)
    weight = np.gradient(loop.time_s) * 2.0 / cycle.duration_s
    waves = np.exp(-2j * np.pi * np.outer([1, *_DISTORTING], drift)) * weight
    terms = closed @ waves.T
    harmonics = np.einsum("ni,ik->nk", draws.stroke, terms)
    samples = propagation.samples_a_point * loop.time_s.size
    share = propagation.noise.stroke_mm * np.sqrt(2.0 / samples)
    random = draws.generator.standard_normal((2, *harmonics.shape))
    harmonics = harmonics + share * (random[0] + 1j * random[1])
    others = np.sqrt(np.sum(np.abs(harmonics[:, 1:]) ** 2, axis=1))
    return np.asarray(others / np.abs(harmonics[:, 0]))
