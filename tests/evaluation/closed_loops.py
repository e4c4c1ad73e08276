"""Loops with known truth for the coverage study, and errors drawn from what the channels' facts say.

Nothing of the code under test is used here: truth is integrated on a fine grid, errors are made from their
physical descriptions (class, zero, hysteresis, smooth deviation of a draw wire, noise, skew).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foundation.channel import ChannelUncertainty
from tests.evaluation.signals import Floats

FORCE = ChannelUncertainty(accuracy_percent=0.5, reversibility_percent=0.75, zero=0.5, u_delay_s=2e-4)
WIRES = (
    ChannelUncertainty(linearity=0.5, zero=0.2, u_delay_s=0.0),
    ChannelUncertainty(linearity=0.5, zero=0.2, u_delay_s=0.0),
)
NOISE_KN, NOISE_MM = 0.15, 0.01


@dataclass(frozen=True)
class Progressive:
    """Progressive loading branch, part of the force lost on unloading; sine stroke low … high."""

    low_mm: float = 10.0
    high_mm: float = 80.0
    frequency_Hz: float = 0.5
    lost: float = 0.45

    def loading(self, stroke_mm: Floats) -> Floats:
        return 20.0 + 1.16 * stroke_mm + 4.64e-4 * stroke_mm**3

    def slope(self, stroke_mm: float) -> float:
        return 1.16 + 3.0 * 4.64e-4 * stroke_mm**2

    def force(self, phase: Floats) -> Floats:
        """Return the force at a phase of the cycle [rad]: rising up to π, falling after."""
        stroke = self.stroke(phase)
        way = np.sin(phase)
        # A smooth passage from one branch to the other: nothing is lost at the turns.
        share = np.where(way < 0.0, self.lost * way**2, 0.0)
        return self.loading(stroke) * (1.0 - share)

    def stroke(self, phase: Floats) -> Floats:
        mean, half = 0.5 * (self.low_mm + self.high_mm), 0.5 * (self.high_mm - self.low_mm)
        return mean - half * np.cos(phase)

    def truth(self) -> dict[str, float]:
        phase = np.linspace(0.0, 2.0 * np.pi, 400_001)
        stroke, force = self.stroke(phase), self.force(phase)
        top = phase.size // 2
        mean, half = 0.5 * (self.low_mm + self.high_mm), 0.5 * (self.high_mm - self.low_mm)
        stored = float(np.trapezoid(force[: top + 1], stroke[: top + 1]))
        absorbed = float(np.trapezoid(force, stroke))
        first = complex(np.trapezoid(force * np.exp(-1j * phase), phase)) / np.pi
        stiffness = first / (-half)
        return {
            "stored_energy_J": stored,
            "absorbed_energy_J": absorbed,
            "damping": absorbed / stored,
            "tangent_stiffness_kN_per_mm": self.slope(mean),
            "secant_stiffness_kN_per_mm": float(force[top] - force[0]) / (2.0 * half),
            "dynamic_stiffness_kN_per_mm": abs(stiffness),
            "storage_stiffness_kN_per_mm": stiffness.real,
            "loss_stiffness_kN_per_mm": stiffness.imag,
            "loss_factor": stiffness.imag / stiffness.real,
            "force_max_kN": float(np.max(force)),
            "stroke_max_mm": self.high_mm,
            "amplitude_mm": half,
            "frequency_Hz": self.frequency_Hz,
        }


def measured(
    loop: Progressive, random: np.random.Generator, *, cycles: float = 3.2, rate_Hz: float = 250.0
) -> tuple[Floats, Floats, Floats]:
    """Return time, stroke and force as a chain with errors within the stated facts records them."""
    time = np.arange(round(cycles * rate_Hz / loop.frequency_Hz)) / rate_Hz
    clock = 1.0 + random.uniform(-1e-4, 1e-4)
    omega = 2.0 * np.pi * loop.frequency_Hz
    start = random.uniform(0.0, 2.0 * np.pi)

    def at(moment: Floats) -> Floats:
        return np.mod(start + omega * moment, 2.0 * np.pi)

    skew = random.normal(0.0, FORCE.u_delay_s or 0.0)
    true_time = time * clock
    phase = at(true_time - skew)
    force = loop.force(phase)
    falling = phase > np.pi
    peak = float(loop.loading(np.array([loop.high_mm]))[0])
    reversal = random.uniform(-1.0, 1.0) * 0.01 * (FORCE.reversibility_percent or 0.0)
    recorded = force * (1.0 + random.uniform(-1.0, 1.0) * 0.01 * (FORCE.accuracy_percent or 0.0))
    recorded = recorded + np.where(falling, reversal * force * (1.0 - force / peak), 0.0)
    recorded = recorded + random.uniform(-1.0, 1.0) * (FORCE.zero or 0.0)
    recorded = recorded + NOISE_KN * random.standard_normal(time.size)
    stroke = loop.stroke(at(true_time))
    wires = [
        stroke
        + wire_deviation(stroke, wire.linearity or 0.0, random)
        + random.uniform(-1.0, 1.0) * (wire.zero or 0.0)
        for wire in WIRES
    ]
    mean = np.mean(wires, axis=0) + NOISE_MM * random.standard_normal(time.size)
    return time, mean, recorded


def wire_deviation(stroke_mm: Floats, limit_mm: float, random: np.random.Generator) -> Floats:
    """Return a smooth random deviation of a draw wire, 0 at contact: three waves of 240, 120 and 80 mm.

    Amplitudes and phases are drawn so that the deviation at a stroke is normal with 0.46 of the limit.
    """
    total = np.zeros_like(stroke_mm)
    for period in (240.0, 120.0, 80.0):
        size = limit_mm * 0.46 * random.rayleigh() / np.sqrt(3.0)
        angle = random.uniform(0.0, 2.0 * np.pi)
        total = total + size * (np.cos(2.0 * np.pi * stroke_mm / period + angle) - np.cos(angle))
    return total
