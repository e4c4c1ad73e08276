"""A synthetic campaign: simulated finely, sampled coarsely, with noise and a lagging sensor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from bufferstand.model.curves import Curves
from bufferstand.model.identification.drive import Drive, Reduction, join, reduce_run
from bufferstand.model.identification.fitting import Solution, solve
from bufferstand.model.identification.parameters import FixedParts
from bufferstand.model.identification.problem import Problem
from bufferstand.model.identification.procedure import experiment_of
from bufferstand.model.identification.starting import start_vector
from bufferstand.model.simulation import simulate
from bufferstand.model.spring import HeatBalance, SpringModel, TemperatureLaw, ViscousBranch

FINER = 5
RATE_Hz = 400.0
FORCE_NOISE_kN = 0.5
STROKE_NOISE_mm = 0.01
STROKE_COUNT_mm = 500.0 / 65536.0
SENSOR_NOISE_C = 0.1
SENSOR_COUNT_C = 0.0625

KNOTS_mm = (0.0, 16.0, 32.0, 48.0, 64.0, 80.0, 96.0)


def truth(per_decade: float = 0.0) -> SpringModel:
    """A buffer like the shipped one, with every effect in it, on seven knots; the spectrum if it is given."""
    x = np.array(KNOTS_mm)
    loading = 15.0 + 2.0 * x + (600.0 - 15.0 - 192.0) / 96.0**4 * x**4
    unloading = loading * (1.0 - 0.17 - 0.45 * (x / 100.0) ** 1.06)
    return SpringModel(
        name="synthetic",
        curves=Curves(
            stroke_mm=KNOTS_mm,
            loading_kN=tuple(loading.tolist()),
            unloading_kN=tuple(unloading.tolist()),
            transition_length_mm=4.0,
            contact_ramp_mm=0.2,
        ),
        temperature=TemperatureLaw(
            reference_C=25.0, sensitivity_per_K=0.009, depth_mm=17.0, loss_sensitivity_per_K=0.0016
        ),
        heat=HeatBalance(capacity_J_per_K=9000.0, loss_W_per_K=12.0, sensor_lag_s=20.0),
        viscous=ViscousBranch(0.045, 8.0, per_decade),
    )


def harmonic(prestress, amplitude, frequency, cycles, rate):
    """A sine from zero stroke and back, with a ramp at 20 mm/s on either side."""
    lead = np.linspace(0.0, prestress - amplitude, max(2, round((prestress - amplitude) / 20.0 * rate)))
    time = np.arange(round(cycles / frequency * rate)) / rate
    swing = prestress - amplitude * np.cos(2.0 * np.pi * frequency * time)
    return np.concatenate([np.zeros(int(rate)), lead, swing, lead[::-1], np.zeros(int(rate))])


def static(end, speed, rate):
    """One triangle at constant speed."""
    rise = np.arange(0.0, end, speed / rate)
    return np.concatenate([np.zeros(int(rate)), rise, rise[::-1], np.zeros(int(rate))])


def rest(duration_s, rate):
    return np.zeros(round(duration_s * rate))


@dataclass(frozen=True, eq=False)
class Piece:
    """A recorded stretch of an experiment: what was true, at the recorded instants."""

    time_s: np.ndarray
    stroke_mm: np.ndarray
    force_kN: np.ndarray
    sensor_s: np.ndarray
    sensor_C: np.ndarray


def simulated(model, parts, start_C, ambient_C):
    """Simulate parts in a row (strokes at the fine rate, or seconds of unrecorded rest)."""
    rate = RATE_Hz * FINER
    strokes, times, spans, at = [], [], [], 0.0
    for part in parts:
        if isinstance(part, float):
            times.append(at + np.arange(1.0, part + 0.5, 0.2))
            strokes.append(np.zeros(times[-1].size))
            spans.append(None)
        else:
            times.append(at + np.arange(1, part.size + 1) / rate)
            strokes.append(part)
            spans.append(part.size)
        at = times[-1][-1]
    time, stroke = np.concatenate(times), np.concatenate(strokes)
    done = simulate(model, time, stroke, temperature_C=start_C, ambient_C=ambient_C)
    pieces, first = [], 0
    for span, one in zip(spans, times, strict=True):
        last = first + one.size
        if span is not None:
            kept = slice(first + 3, last, FINER)
            sensor_s = np.arange(time[first], time[last - 1], 1.0)
            sensed = np.interp(sensor_s, time, done.sensor_temperature_C)
            pieces.append(Piece(time[kept], stroke[kept], done.force_kN[kept], sensor_s, sensed))
        first = last
    return pieces, done


@cache
def campaign(per_decade: float = 0.0):
    """The whole campaign: (pieces, start temperature) of each experiment."""
    model, rate = truth(per_decade), RATE_Hz * FINER
    plan = [
        (12.0, [static(95.0, 5.0, rate), 20.0, static(70.0, 20.0, rate), 20.0,
                harmonic(50.0, 10.0, 0.8, 4, rate), 20.0, harmonic(20.0, 8.0, 0.8, 4, rate)]),
        (21.0, [harmonic(20.0, 20.0, 0.08, 2, rate), 20.0, harmonic(20.0, 20.0, 1.27, 4, rate), 20.0,
                harmonic(40.0, 40.0, 0.04, 1, rate), 20.0, harmonic(40.0, 40.0, 0.32, 3, rate), 20.0,
                harmonic(80.0, 5.0, 0.5, 3, rate), 20.0, harmonic(70.0, 15.0, 0.85, 25, rate), 15.0,
                static(90.0, 20.0, rate), 400.0, static(60.0, 20.0, rate), 900.0,
                harmonic(50.0, 15.0, 0.8, 3, rate)]),
        (45.0, [static(95.0, 10.0, rate), 20.0, harmonic(50.0, 10.0, 0.8, 4, rate), 600.0,
                static(95.0, 10.0, rate)]),
    ]  # fmt: skip
    return [(simulated(model, parts, start, 20.0)[0], start) for start, parts in plan]


def measured(seed: int, experiments=None, first_rested=True) -> list[Drive]:
    """One noisy measurement of the campaign, or of other pieces, reduced to drives."""
    random = np.random.default_rng(seed)
    drives = []
    for pieces in [pieces for pieces, _ in campaign()] if experiments is None else experiments:
        parts = []
        for number, piece in enumerate(pieces):
            noisy = piece.stroke_mm + random.normal(0.0, STROKE_NOISE_mm, piece.stroke_mm.size)
            sensed = piece.sensor_C + random.normal(0.0, SENSOR_NOISE_C, piece.sensor_C.size)
            parts.append(
                reduce_run(
                    piece.time_s,
                    np.round(noisy / STROKE_COUNT_mm) * STROKE_COUNT_mm,
                    piece.force_kN + random.normal(0.0, FORCE_NOISE_kN, piece.force_kN.size),
                    sensor_s=piece.sensor_s,
                    sensor_C=np.round(sensed / SENSOR_COUNT_C) * SENSOR_COUNT_C,
                    ambient_C=20.0,
                    rested=first_rested and not parts,
                    reduction=Reduction(near_mm=0.35, growth=0.25, far_mm=4.0),
                    name=f"run {number}",
                )
            )
        drives.append(join(parts))
    return drives


def frame() -> FixedParts:
    return FixedParts(knots_mm=KNOTS_mm, reference_C=25.0, contact_ramp_mm=0.2)


def fitted(drives) -> Solution:
    """Every parameter at once, from a start that the data give."""
    problem = Problem(frame(), [experiment_of(drive) for drive in drives])
    free = np.ones(problem.size, dtype=np.bool_)
    free[problem.frame.size :] = problem.always_free()[problem.frame.size :]
    return solve(problem, problem.start(start_vector(frame(), drives)), free)


def true_values(model: SpringModel) -> dict[str, float]:
    """What the estimates should be, by their names."""
    table = {
        "transition_length_mm": model.curves.transition_length_mm,
        "sensitivity_per_K": model.temperature.sensitivity_per_K,
        "depth_mm": model.temperature.depth_mm,
        "loss_sensitivity_per_K": model.temperature.loss_sensitivity_per_K,
        "capacity_J_per_K": model.heat.capacity_J_per_K,
        "loss_W_per_K": model.heat.loss_W_per_K,
        "sensor_lag_s": model.heat.sensor_lag_s,
        "beta": model.viscous.beta,
        "tau_s": model.viscous.tau_s,
        "spectrum_per_decade": model.viscous.spectrum_per_decade,
    }
    curves = {"loading": model.curves.loading_kN, "unloading": model.curves.unloading_kN}
    for name, forces in curves.items():
        for knot, force in zip(model.curves.stroke_mm, forces, strict=True):
            table[f"{name}_kN at {knot:g} mm"] = force
    return table
