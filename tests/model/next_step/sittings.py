"""Simulated sittings: pieces in a row on a spring that is known, as the fit would keep them, with noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bufferstand.model.curves import Curves
from bufferstand.model.identification import Answer, BandStage, Drive, LagStage, Reduction, answer
from bufferstand.model.next_step import Loops, Piece, Rest, RunNoise, SharedErrors, SlowStroke, drive_of
from bufferstand.model.spring import SpringModel
from bufferstand.model.tables import BandTables
from tests.model.identification.synthetic import truth

AMBIENT_C = 20.0
REACH_mm = 96.0 / 0.95
"""Slow strokes go to 96 mm, so that the knots of the fit are those of the synthetic curves."""
SPEED_MAX_mm_per_s = 250.0
ERRORS = SharedErrors(0.001, 0.05, 0.001, 1e-4, 0.0005, 0.2)
NOISE = RunNoise(0.4, 0.3, 0.1, 1.0, 1.0, Reduction(near_mm=0.35, growth=0.25, far_mm=4.0))
_SLOW_kN = 0.04
"""Slow part of the noise of the force: it resembles itself over some fifty nodes."""


def stiffer(model: SpringModel, factor: float) -> SpringModel:
    """The same spring with all forces by so much larger."""
    curves = model.curves
    return replace(
        model,
        curves=Curves(
            stroke_mm=curves.stroke_mm,
            loading_kN=tuple(factor * F for F in curves.loading_kN),
            unloading_kN=tuple(factor * F for F in curves.unloading_kN),
            transition_length_mm=curves.transition_length_mm,
            contact_ramp_mm=curves.contact_ramp_mm,
        ),
    )


def drawn(random: np.random.Generator, per_decade: float, factor: float) -> SpringModel:
    """A spring like the synthetic one, other laws within a factor; ``factor`` on its forces."""
    model = stiffer(truth(per_decade), factor)
    by = np.exp(random.normal(0.0, 0.25, 7))
    heat, law, viscous = model.heat, model.temperature, model.viscous
    return replace(
        model,
        temperature=replace(
            law, sensitivity_per_K=law.sensitivity_per_K * by[0], depth_mm=law.depth_mm * by[1]
        ),
        heat=replace(
            heat,
            capacity_J_per_K=heat.capacity_J_per_K * by[2],
            loss_W_per_K=heat.loss_W_per_K * by[3],
            sensor_lag_s=heat.sensor_lag_s * by[4],
        ),
        viscous=replace(viscous, beta=viscous.beta * by[5], tau_s=viscous.tau_s * by[6]),
    )


def _answered(model: SpringModel, drive: Drive) -> Answer:
    band = BandStage.of(BandTables.of(model.curves, model.temperature.depth_mm), drive.stroke_mm)
    lag = LagStage.of(band, drive.time_s, model.viscous, half=drive.half)
    ends = {"start_C": AMBIENT_C, "sensor_start_C": AMBIENT_C, "ambient_C": AMBIENT_C}
    return answer(model, drive.time_s, band, lag, **ends)


def sitting(model: SpringModel, pieces: list[Piece], seed: int, noise: RunNoise = NOISE) -> Drive:
    """What is measured of pieces in a row from rest; the same seed measures the same first pieces alike."""
    drive = drive_of(tuple(pieces), noise, AMBIENT_C)
    given = _answered(model, drive)
    channels, white, slow, turns, read = np.random.default_rng(seed).spawn(5)
    error = channels.normal(size=6)
    count = drive.node.size
    force = given.force_kN[drive.node] * (1.0 + ERRORS.force_share * error[0])
    force += ERRORS.force_zero_kN * error[1]
    rate = np.gradient(given.force_kN, drive.time_s + 1e-9 * np.arange(drive.time_s.size))[drive.node]
    force += ERRORS.delay_s * error[2] * rate
    force += drive.force_sigma_kN * white.normal(size=count)
    force += drive.turn_kN * turns.normal(size=int(drive.half.max()) + 1)[drive.half[drive.node]]
    force += _SLOW_kN * _slow(slow, count)
    sensor = np.interp(drive.sensor_s, drive.time_s, given.sensor_C)
    sensor = sensor + ERRORS.sensor_C * error[3] + noise.sensor_C * read.normal(size=sensor.size)
    return replace(drive, force_kN=force, sensor_C=sensor, rested=True, runs=((0.0, "sitting"),))


def _slow(random: np.random.Generator, count: int) -> np.ndarray:
    """Noise of many octaves down to fifty nodes and more, standard deviation 1."""
    white = random.normal(size=(4, count))
    total = np.zeros(count)
    for one, length in zip(white, (4, 16, 64, 256), strict=True):
        total += np.repeat(one[: count // length + 1], length)[:count]
    return total / 2.0


def stopped(
    model: SpringModel, pieces: list[Piece], stop_C: float = 40.0, resume_C: float = 36.0
) -> list[Piece]:
    """The pieces as the stand runs them: one whose specimen comes to the stop is ended, and waited after.

    As ``on_temperature_stop = "skip"`` with ``temperature_resume_C = 36`` of that campaign does.
    """
    found: list[Piece] = []
    for piece in pieces:
        found.append(piece)
        T = temperatures(model, found)
        if not isinstance(piece, Loops) or T.max() <= stop_C:
            continue
        cycles = piece.cycles
        while cycles > 1 and T.max() > stop_C:
            share = (stop_C - AMBIENT_C) / (T.max() - AMBIENT_C)
            cycles = max(1, min(cycles - 1, int(cycles * share)))
            found[-1] = replace(piece, cycles=cycles)
            T = temperatures(model, found)
        tau_s = model.heat.capacity_J_per_K / model.heat.loss_W_per_K
        wait_s = tau_s * np.log(max(T[-1] - AMBIENT_C, 0.1) / (resume_C - AMBIENT_C))
        if wait_s > 0.0:
            found.append(Rest(float(wait_s)))
    return found


def temperatures(model: SpringModel, pieces: list[Piece]) -> np.ndarray:
    """Temperatures of the mass at the nodes of pieces in a row."""
    return _answered(model, drive_of(tuple(pieces), NOISE, AMBIENT_C)).temperature_C


def template(reach_mm: float = REACH_mm) -> list[Piece]:
    """The fixed campaign of ``fit --missing-runs`` (model/identification/suggested_runs.py), all of it."""
    reach = 0.95 * reach_mm

    def at_speed(prestress: float, amplitude: float, speed: float, cycles: int) -> Loops:
        return Loops(prestress, amplitude, speed / (2.0 * np.pi * amplitude), cycles)

    slow = SlowStroke(reach, 5.0, 2)
    inner = [
        at_speed(at * reach, size * reach, 20.0, 3) for at in (0.25, 0.5, 0.75) for size in (0.02, 0.05, 0.15)
    ]
    rates = [
        Loops(at * reach, 0.2 * reach, rate, cycles)
        for at in (0.22, 0.42)
        for rate, cycles in zip((0.02, 0.08, 0.32, 1.27), (2, 3, 4, 6), strict=True)
    ]
    warm = at_speed(0.74 * reach, 0.16 * reach, 80.0, 120)
    short = Loops(0.3 * reach, 0.1 * reach, 0.5, 3)
    cooling = [Rest(300.0), short] * 3
    return [slow, *inner, *rates, warm, slow, *inner, warm, *cooling]
