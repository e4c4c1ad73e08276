"""A spring in closed form, in place of the identified model: its figures can be checked by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from bufferstand.protocols.prediction.machine_stroke import Sine, stroke_sine
from bufferstand.protocols.prediction.predictor import (
    Floats,
    HarmonicCycle,
    Predictor,
    StaticCycle,
    Temperatures,
    static_behind,
)


@dataclass(frozen=True)
class ClosedFormSpring:
    """F = s(T) (15 kN + 2 kN/mm x + c x⁴), 600 kN at 96 mm and 25 °C; W_a = 2.5 J/mm² A² s(T)."""

    capacity_J_per_K: float = 15_000.0
    loss_W_per_K: float = 10.0
    preload_kN: float = 15.0

    known_to_mm: float = math.inf
    knows_heat: bool = True
    sensor_lag_s: float | None = 0.0
    assumptions: tuple[str, ...] = ()

    def bounding(self) -> Predictor:
        return self

    def softening(self, temperature_C: float) -> float:
        return max(0.05, 1.0 - 0.01 * (temperature_C - 25.0))

    def force_at(self, stroke_mm: float, temperature_C: float) -> float:
        c = (600.0 - 15.0 - 192.0) / 96.0**4
        return self.softening(temperature_C) * (self.preload_kN + 2.0 * stroke_mm + c * stroke_mm**4)

    def harmonic(
        self,
        prestress_mm: float,
        amplitude_mm: float,
        frequency_Hz: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> HarmonicCycle:
        stiffening = 1.0 + 0.01 * math.log10(1.0 + frequency_Hz)

        def forces(sine: Sine) -> tuple[float, float]:
            lower, upper = (self.force_at(mm, temperature_C) for mm in (sine.lower_mm, sine.upper_mm))
            return 0.7 * lower if sine.lower_mm > 0.0 else 0.0, stiffening * upper

        stroke = stroke_sine(Sine(prestress_mm, amplitude_mm), forces, give_mm_per_kN)
        lower_kN, peak_kN = forces(stroke)
        absorbed_J = 2.5 * stroke.amplitude_mm**2 * self.softening(temperature_C)
        return HarmonicCycle(peak_kN, lower_kN, absorbed_J, stroke)

    def forces(self, time_s: Floats, stroke_mm: Floats, temperature_C: float) -> Floats:  # noqa: ARG002
        return np.array([self.force_at(mm, temperature_C) for mm in stroke_mm])

    def static(
        self,
        force_limit_kN: float,
        stroke_limit_mm: float,
        speed_mm_per_s: float,  # noqa: ARG002 - this spring knows no rate here
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> StaticCycle:
        return static_behind(
            lambda mm: self._slow(force_limit_kN, mm, temperature_C), stroke_limit_mm, give_mm_per_kN
        )

    def _slow(self, force_limit_kN: float, end_mm: float, temperature_C: float) -> StaticCycle:
        if self.force_at(0.0, temperature_C) >= force_limit_kN:
            return StaticCycle(force_limit_kN, 0.0, 0.0)
        if self.force_at(end_mm, temperature_C) > force_limit_kN:
            end_mm = brentq(lambda x: self.force_at(x, temperature_C) - force_limit_kN, 0.0, end_mm)
        absorbed_J = 2.5 * (end_mm / 2.0) ** 2 * self.softening(temperature_C)
        return StaticCycle(self.force_at(end_mm, temperature_C), absorbed_J, end_mm)

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
