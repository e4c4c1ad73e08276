"""Draws of figures that are no integrals of the loop: strokes, frequency, speeds, distortion, temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bufferstand.evaluation.error_model import Draws, stroke_term_slopes
from bufferstand.evaluation.motion import Cycle, Loop
from bufferstand.evaluation.record import FloatArray, Temperature
from bufferstand.evaluation.results import CycleResult
from bufferstand.evaluation.speed_noise import speed_lean
from bufferstand.evaluation.uncertainty import CyclePropagation, stroke_figures, turn_draws

_DISTORTING = range(2, 11)
"""Harmonics of the stroke that count as distortion."""
_SPEED_PARTS = 24
"""A branch is looked at in so many parts for where its speed may be largest …"""
_NEAR_LARGEST = 0.95
"""… which are those whose speed is at least this share of the largest."""
_MADE_BY_WIRES = 2.0
"""A fall of the speed by so many standard uncertainties of what the wires make of it may be none."""


def stroke_draws(draws: Draws, cycle: Cycle) -> dict[str, FloatArray]:
    """Return the figures of a cycle's turning points of every draw, complete cycle or not."""
    return stroke_figures(*turn_draws(draws, cycle))


def further_draws(
    draws: Draws, propagation: CyclePropagation, result: CycleResult, temperatures: Sequence[Temperature]
) -> dict[str, FloatArray]:
    """Return frequency, speeds, distortion and temperatures of a complete cycle of every draw."""
    cycle, figures = propagation.cycle, result.quantities
    noise = draws.generator.standard_normal(draws.time_base.size)
    drawn: dict[str, FloatArray] = {}
    if figures.frequency_Hz is not None:
        leaves_s, arrives_s = (
            propagation.moment_share(turn) * u_s
            for turn, u_s in ((cycle.start, cycle.start.u_leave_s), (cycle.end, cycle.end.u_time_s))
        )
        u_share = float(np.hypot(leaves_s, arrives_s)) / cycle.duration_s
        drawn["frequency_Hz"] = figures.frequency_Hz * (1.0 + draws.time_base + u_share * noise)
    for name, branch in (
        ("speed_loading_max_mm_per_s", propagation.loop.loading),
        ("speed_unloading_max_mm_per_s", propagation.loop.unloading),
    ):
        speed = getattr(figures, name)
        if speed is not None:
            spectrum = propagation.stroke_spectrum
            lean = speed_lean(propagation.loop, branch, propagation.samples, spectrum, cycle.index)
            too_fast = speed * _stretch(draws, propagation.loop, branch) + lean.mean
            by_noise = lean.scatter * draws.generator.standard_normal(noise.size)
            drawn[name] = speed * (1.0 + draws.time_base) + too_fast * draws.overreach + by_noise
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


def _speeds(loop: Loop, branch: slice) -> tuple[FloatArray, FloatArray]:
    """Return the mean speeds of parts of a branch as shares of the largest, and their strokes [mm]."""
    time_s, stroke_mm = loop.time_s[branch], loop.stroke_mm[branch]
    knots = np.unique(np.linspace(0, time_s.size - 1, _SPEED_PARTS + 1).round().astype(int))
    speed = np.abs(np.diff(stroke_mm[knots]) / np.diff(time_s[knots]))
    return speed / np.max(speed), 0.5 * (stroke_mm[knots[1:]] + stroke_mm[knots[:-1]])


def _stretch(draws: Draws, loop: Loop, branch: slice) -> FloatArray:
    """Return the relative error that the draw wires make of the largest speed of a branch, for every draw.

    Their deviation stretches the stroke here and shortens it there. Where the speed is even, the largest one
    is found where the stretch is largest, so that the error leans to one side, as that by noise does; where
    it has a peak, what it has fallen by beside it counts against that, but for what the wires may have made.
    """
    share, stroke_mm = _speeds(loop, branch)
    near = share >= _NEAR_LARGEST
    share = share[near]
    slopes = np.stack([stroke_term_slopes(float(at), draws.drums_mm) for at in stroke_mm[near]])
    stretch = draws.stroke @ slopes.T
    apart = stretch - stretch[:, [int(np.argmax(share))]]
    even = np.minimum(1.0, share + _MADE_BY_WIRES * np.sqrt(np.mean(apart**2, axis=0)))
    return np.asarray(np.max(even * (1.0 + stretch), axis=1) - 1.0)


def _distortion(draws: Draws, propagation: CyclePropagation) -> FloatArray:
    """Return the distortion of every draw: a deviation from the straight line makes harmonics of its own."""
    loop, cycle = propagation.loop, propagation.cycle
    drift = (loop.time_s - cycle.start_s) / cycle.duration_s
    closed = propagation.stroke - np.outer(propagation.stroke[:, -1] - propagation.stroke[:, 0], drift)
    weight = np.gradient(loop.time_s) * 2.0 / cycle.duration_s
    waves = np.exp(-2j * np.pi * np.outer([1, *_DISTORTING], drift)) * weight
    terms = closed @ waves.T
    real, imaginary = (draws.stroke @ part for part in (terms.real, terms.imag))
    harmonics = real + 1j * imaginary
    whole = slice(0, loop.time_s.size)
    both = [propagation.stroke_noise_mm(part, whole) for part in (waves.real, waves.imag)]
    share = np.sqrt(np.mean(np.square(both), axis=0))
    random = draws.generator.standard_normal((2, *harmonics.shape))
    harmonics = harmonics + share * (random[0] + 1j * random[1])
    others = np.sqrt(np.sum(np.abs(harmonics[:, 1:]) ** 2, axis=1))
    return np.asarray(others / np.abs(harmonics[:, 0]))
