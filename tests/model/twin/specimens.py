"""A specimen that is not quite its model, measured with noise, with a fault that begins in a cycle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from bufferstand.model.fit_uncertainty import FitUncertainty, knot_name
from bufferstand.model.identification.drive import Drive, reduce_run
from bufferstand.model.simulation import simulate
from bufferstand.model.spring import SpringModel
from bufferstand.model.twin.parameter_spread import moved_model
from tests.model.identification.synthetic import truth

RATE_Hz = 250.0
FORCE_NOISE_kN = 0.5
STROKE_NOISE_mm = 0.01
AIR_C = 20.0
MISSED_SHARE = 0.001
HELD_OUT = 18
FAULTS = {
    "stiffness": -0.05,
    "loss": 0.2,
    "force_zero_kN": 10.0,
    "stroke_zero_mm": -1.5,
    "stroke_gain": 0.03,
    "delay_s": 0.012,
}
"""What the study puts in, by the names of the kinds."""


@cache
def known_model() -> SpringModel:
    """The model, with what a fit of a good campaign knows of it."""
    model = truth()
    curves = model.curves
    names = ["ln transition_length_mm", "sensitivity_per_K", "ln capacity_J_per_K", "beta", "ln tau_s"]
    deviation = [0.005, 1e-4, 0.01, 5e-4, 0.01]
    for curve in ("loading_kN", "unloading_kN"):
        names += [knot_name(curve, x) for x in curves.stroke_mm]
        deviation += [0.001 * force + 0.05 for force in getattr(curves, curve)]
    fit = FitUncertainty.of(
        tuple(names), np.diag(np.square(deviation)), 2000.0, (HELD_OUT, 0.5, MISSED_SHARE)
    )
    return replace(model, fit=fit)


def drawn_spring(random: np.random.Generator) -> SpringModel:
    """A specimen as the fit's covariance lets it be."""
    spring = known_model()
    assert spring.fit is not None
    deviations = np.array(spring.fit.standard_uncertainty)
    for name, by in zip(spring.fit.parameter, random.normal(0.0, deviations).tolist(), strict=True):
        spring = moved_model(spring, name, by)
    return spring


def widened(spring: SpringModel, factor: float) -> SpringModel:
    """A spring that loses more: its curves further from F*, which stays."""
    curves = spring.curves
    x = np.array(curves.stroke_mm)
    cells = spring.tables.cells_of(x)
    share = spring.tables.at(spring.tables.centre, cells)
    upper, lower = np.array(curves.loading_kN), np.array(curves.unloading_kN)
    centre = lower + share * (upper - lower)
    moved = replace(
        curves,
        loading_kN=tuple((centre + factor * (upper - centre)).tolist()),
        unloading_kN=tuple(np.maximum.accumulate(centre - factor * (centre - lower)).tolist()),
    )
    viscous = replace(spring.viscous, beta=factor * spring.viscous.beta)
    return replace(spring, curves=moved, viscous=viscous)


@dataclass(frozen=True)
class Step:
    """A harmonic step: mean and amplitude [mm], frequency [Hz], number of cycles."""

    mean_mm: float
    amplitude_mm: float
    frequency_Hz: float
    cycles: int


def drawn_step(random: np.random.Generator, cycles: int = 30) -> Step:
    """A step as campaigns have them: some millimetres and more, no faster than 200 mm/s."""
    amplitude = float(random.uniform(8.0, 30.0))
    mean = float(random.uniform(amplitude + 1.0, 90.0 - amplitude))
    fastest = min(2.0, 200.0 / (2.0 * np.pi * amplitude))
    return Step(mean, amplitude, float(np.exp(random.uniform(np.log(0.3), np.log(fastest)))), cycles)


def strokes(step: Step) -> tuple[np.ndarray, np.ndarray, float]:
    """Time and stroke of a step from contact and back, and when its first cycle begins."""
    low = step.mean_mm - step.amplitude_mm
    lead = np.linspace(0.0, low, max(2, round(low / 20.0 * RATE_Hz)))
    count = round(step.cycles / step.frequency_Hz * RATE_Hz)
    swing = step.mean_mm - step.amplitude_mm * np.cos(
        2.0 * np.pi * step.frequency_Hz * np.arange(count) / RATE_Hz
    )
    stroke = np.concatenate([np.zeros(round(RATE_Hz)), lead, swing, lead[::-1], np.zeros(round(RATE_Hz))])
    return np.arange(stroke.size) / RATE_Hz, stroke, (round(RATE_Hz) + lead.size) / RATE_Hz


def measured_step(
    random: np.random.Generator,
    step: Step,
    spring: SpringModel,
    fault: tuple[str, float] | None = None,
    from_cycle: int = 0,
) -> Drive:
    """Return one step as recorded; the fault, if any, begins with cycle ``from_cycle`` (from 0)."""
    time, stroke, begin_s = strokes(step)
    start = AIR_C + float(random.normal(0.0, 0.2))
    force = _force(spring, time, stroke, start)
    read = stroke.copy()
    if fault is not None:
        name, size = fault
        onset_s = begin_s + from_cycle / step.frequency_Hz
        later = time >= onset_s
        if name in ("stiffness", "loss"):
            worse = (
                replace(spring, curves=spring.curves.scaled(1.0 + size))
                if name == "stiffness"
                else widened(spring, 1.0 + size)
            )
            force = np.where(later, _force(worse, time, stroke, start), force)
        elif name == "force_zero_kN":
            force = force + size * later
        elif name == "stroke_zero_mm":
            read = read + size * later
        elif name == "stroke_gain":
            read = np.where(later, read * (1.0 + size), read)
        else:
            force = np.where(later, np.interp(time - size, time, force), force)
    force = force + _form(random, stroke, np.gradient(stroke) >= 0.0, float(force.max()))
    sensor_s = time[:: round(RATE_Hz)]
    return reduce_run(
        time,
        np.round((read + random.normal(0.0, STROKE_NOISE_mm, time.size)) / 0.0076) * 0.0076,
        force + random.normal(0.0, FORCE_NOISE_kN, time.size),
        sensor_s=sensor_s,
        sensor_C=np.full(sensor_s.size, AIR_C) + random.normal(0.0, 0.1, sensor_s.size),
        ambient_C=AIR_C,
        rested=True,
        name="step",
    )


def _force(spring: SpringModel, time: np.ndarray, stroke: np.ndarray, start_C: float) -> np.ndarray:
    return simulate(spring, time, stroke, temperature_C=start_C, ambient_C=AIR_C).force_kN


def _form(random: np.random.Generator, stroke: np.ndarray, rising: np.ndarray, peak_kN: float) -> np.ndarray:
    """What the model's form cannot follow: a smooth error of either branch, alike in all cycles of a step."""
    end = float(stroke.max())
    phase = stroke / end
    found = np.zeros_like(stroke)
    for order in range(4):
        up, down = random.normal(0.0, 1.0, 2)
        found += np.where(rising, up, down) * np.cos(np.pi * order * phase)
    return MISSED_SHARE * peak_kN * found / 2.0 * np.sqrt(8.0 / 5.0) * (stroke > 1.0)
