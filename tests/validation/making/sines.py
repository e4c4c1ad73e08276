"""Sine strokes with a linear viscoelastic force: the loop is an ellipse, and every figure a closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.validation.making.standard_set import Agreed, FloatArray, of_step, summary

PI = float(np.pi)


@dataclass(frozen=True)
class Ellipse:
    """x = x_m - x_a cos ωt, F = F_m - F_a cos(ωt + δ)."""

    mean_mm: float = 40.0
    amplitude_mm: float = 15.0
    frequency_Hz: float = 0.5
    mean_kN: float = 90.0
    force_kN: float = 60.0
    delta: float = 0.2

    def values(self) -> dict[str, tuple[float, str]]:
        """Return every agreed mean with its equation."""
        x, f, d = self.amplitude_mm, self.force_kN, self.delta
        absorbed = PI * f * x * np.sin(d)
        stored = 2.0 * x * self.mean_kN + 0.5 * absorbed
        k1, k2 = f / x * np.cos(d), f / x * np.sin(d)
        return {
            "absorbed_energy_J": (absorbed, "π F_a x_a sin δ"),
            "stored_energy_J": (stored, "2 x_a F_m + (π/2) F_a x_a sin δ"),
            "damping": (absorbed / stored, "W_a / W_s"),
            "storage_stiffness_kN_per_mm": (k1, "F_a/x_a cos δ"),
            "loss_stiffness_kN_per_mm": (k2, "F_a/x_a sin δ"),
            "dynamic_stiffness_kN_per_mm": (f / x, "F_a/x_a"),
            "loss_factor": (np.tan(d), "tan δ"),
            "tangent_stiffness_kN_per_mm": (k1, "dF/dx at the mean stroke, loading: F_a/x_a cos δ"),
            "secant_stiffness_kN_per_mm": (k1, "force at the turning points: F_m ± F_a cos δ"),
            "force_max_kN": (self.mean_kN + f, "F_m + F_a"),
            "force_min_kN": (self.mean_kN - f, "F_m - F_a"),
            "prestress_mm": (self.mean_mm, "x_m"),
            "amplitude_mm": (x, "x_a"),
            "frequency_Hz": (self.frequency_Hz, "f"),
        }

    def stroke_mm(self, time_s: FloatArray) -> FloatArray:
        """Return the stroke at moments since the motion began."""
        return self.mean_mm - self.amplitude_mm * np.cos(2.0 * PI * self.frequency_Hz * time_s)

    def force_at(self, time_s: FloatArray) -> FloatArray:
        """Return the force at moments since the motion began [kN]."""
        return self.mean_kN - self.force_kN * np.cos(2.0 * PI * self.frequency_Hz * time_s + self.delta)


def sampled(
    ellipse: Ellipse, rate_Hz: float, cycles: float, begin_phase: float = 0.3
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return time, stroke and force of an endless motion, from ``begin_phase`` of a cycle on."""
    count = round(rate_Hz * cycles / ellipse.frequency_Hz)
    time_s = np.arange(count) / rate_Hz
    moment = time_s + begin_phase / ellipse.frequency_Hz
    return time_s, ellipse.stroke_mm(moment), ellipse.force_at(moment)


MOTION = ("prestress_mm", "amplitude_mm")
ENERGIES = ("absorbed_energy_J", "stored_energy_J", "damping")
STIFFNESSES = (
    "storage_stiffness_kN_per_mm",
    "loss_stiffness_kN_per_mm",
    "dynamic_stiffness_kN_per_mm",
    "loss_factor",
    "tangent_stiffness_kN_per_mm",
    "secant_stiffness_kN_per_mm",
)
FORCES = ("force_max_kN", "force_min_kN")


def agreed_means(
    ellipse: Ellipse,
    shares: dict[tuple[str, ...], float],
    step: int | None = None,
) -> list[Agreed]:
    """Return the agreed means of an ellipse, groups of names each to a share of themselves."""
    make: Callable[..., Agreed] = summary
    values = ellipse.values()
    found = []
    for names, share in shares.items():
        for name in names:
            value, source = values[name]
            if step is None:
                found.append(make(name, value, source, share=share))
            else:
                found.append(of_step(step, name, value, source, share=share))
    return found
