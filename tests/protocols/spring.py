"""A spring in closed form, in place of the identified model: its figures can be checked by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from scipy.optimize import brentq

from protocols.prediction import Temperatures


@dataclass(frozen=True)
class Cycle:
    peak_force_kN: float
    absorbed_energy_J: float
    end_stroke_mm: float = 0.0


@dataclass(frozen=True)
class ClosedFormSpring:
    """F = s(T) (15 kN + 2 kN/mm x + c x⁴), 600 kN at 96 mm and 25 °C; W_a = 2.5 J/mm² A² s(T)."""

    capacity_J_per_K: float = 15_000.0
    loss_W_per_K: float = 10.0
    preload_kN: float = 15.0

    def softening(self, temperature_C: float) -> float:
        return max(0.05, 1.0 - 0.01 * (temperature_C - 25.0))

    def force_at(self, stroke_mm: float, temperature_C: float) -> float:
        c = (600.0 - 15.0 - 192.0) / 96.0**4
        return self.softening(temperature_C) * (self.preload_kN + 2.0 * stroke_mm + c * stroke_mm**4)

    def harmonic(
        self, prestress_mm: float, amplitude_mm: float, frequency_Hz: float, temperature_C: float
    ) -> Cycle:
        stiffening = 1.0 + 0.01 * math.log10(1.0 + frequency_Hz)
        peak_kN = stiffening * self.force_at(prestress_mm + amplitude_mm, temperature_C)
        return Cycle(peak_kN, 2.5 * amplitude_mm**2 * self.softening(temperature_C))

    def static(
        self,
        force_limit_kN: float,
        stroke_limit_mm: float,
        speed_mm_per_s: float,  # noqa: ARG002 - this spring knows no rate here
        temperature_C: float,
    ) -> Cycle:
        end_mm = stroke_limit_mm
        if self.force_at(end_mm, temperature_C) > force_limit_kN:
            end_mm = brentq(lambda x: self.force_at(x, temperature_C) - force_limit_kN, 0.0, end_mm)
        absorbed_J = 2.5 * (end_mm / 2.0) ** 2 * self.softening(temperature_C)
        return Cycle(self.force_at(end_mm, temperature_C), absorbed_J, end_mm)

    def temperatures_after(
        self,
        start: Temperatures,
        ambient_C: float,
        power_W: float,
        duration_s: float,
        *,
        heating: float = 1.0,
        cooling: float = 1.0,
    ) -> Temperatures:
        if heating != 1.0 or cooling != 1.0:
            return replace(
                self,
                capacity_J_per_K=self.capacity_J_per_K / heating,
                loss_W_per_K=self.loss_W_per_K * cooling / heating,
            ).temperatures_after(start, ambient_C, power_W, duration_s)
        gain = -math.expm1(-self.loss_W_per_K * duration_s / self.capacity_J_per_K)
        now_C = start.mass_C + (power_W / self.loss_W_per_K - (start.mass_C - ambient_C)) * gain
        return Temperatures(now_C, now_C)
