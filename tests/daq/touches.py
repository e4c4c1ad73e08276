"""Samples of a touch by closed form: a rigid frame line, a preload, a spring, noise and counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.zero.first_contact import TouchSamples

FloatArray = NDArray[np.float64]
RATE_HZ = 1000.0
WIRE_STEP_MM = 500.0 / 65536.0
POSITION_STEP_MM = 0.01


@dataclass(frozen=True)
class Specimen:
    """A spring with preload behind a frame; ``bend`` is its progressive part [kN/mm²]."""

    stiffness_kN_per_mm: float = 1.0
    preload_kN: float = 10.0
    bend: float = 0.0
    frame_kN_per_mm: float = 150.0

    def pushed(self, way_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force and compression for the piston's way behind the contact; both of shape (n,).

        ``F = k_f (d − s) = P + k s + b s²``: a quadratic equation for s, solved without cancelling.
        """
        way = np.maximum(way_mm, 0.0)
        over = np.maximum(self.frame_kN_per_mm * way - self.preload_kN, 0.0)
        sum_of = self.frame_kN_per_mm + self.stiffness_kN_per_mm
        stroke = 2.0 * over / (sum_of + np.sqrt(sum_of**2 + 4.0 * self.bend * over))
        return self.frame_kN_per_mm * (way - stroke), stroke


def touched(
    specimen: Specimen,
    *,
    gap_mm: float,
    wires_mm: tuple[float, float],
    noise_kN: float,
    seed: int,
    speed_mm_per_s: float = 0.5,
    rest_kN: float = 0.4,
    on_plate: bool = False,
    bandwidth_Hz: float = 15.0,
) -> TouchSamples:
    """Return the samples of a touch: a second at rest, creep, turn at the force, back.

    ``on_plate``: the wires follow the plate before the contact; else they hang on the specimen.
    """
    random = np.random.default_rng(seed)
    force_kN = min(2.0, max(0.5, 8.0 * noise_kN))
    step = speed_mm_per_s / RATE_HZ
    creep = np.arange(0.0, gap_mm + 12.0, step)
    turn = int(np.flatnonzero(specimen.pushed(creep - gap_mm)[0] >= force_kN)[0]) + 6
    command = np.concatenate((np.zeros(1000), creep[:turn], creep[turn:0:-1], np.zeros(300)))
    share = 1.0 - np.exp(-2.0 * np.pi * bandwidth_Hz / RATE_HZ)
    way = np.zeros_like(command)
    for row in range(1, way.size):  # a servo of first order: it lags, and rounds the turn
        way[row] = way[row - 1] + share * (command[row] - way[row - 1])
    force, stroke = specimen.pushed(way - gap_mm)
    felt = stroke + (np.minimum(way - gap_mm, 0.0) if on_plate else 0.0)

    def read(values: FloatArray, noise: float, count: float) -> FloatArray:
        return np.asarray(np.rint((values + random.normal(0.0, noise, values.size)) / count) * count)

    return TouchSamples(
        np.arange(way.size) / RATE_HZ,
        force + rest_kN + random.normal(0.0, noise_kN, way.size),
        read(way, 0.01, POSITION_STEP_MM),
        {f"stroke_{n + 1}": read(felt + wires_mm[n], 0.01, WIRE_STEP_MM) for n in range(2)},
        {},
        {"position": POSITION_STEP_MM, "stroke_1": WIRE_STEP_MM, "stroke_2": WIRE_STEP_MM},
    )
