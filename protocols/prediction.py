"""What the planner asks of the spring model, as the smallest interface that will do, and its adapter."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

from model.prediction import heat_step, predict_harmonic, predict_static
from model.spring import HeatBalance, SpringModel

_INSULATED_S = 1e9
"""Time constant [s] that stands for a perfectly insulated spring: 30 years."""


class CycleEstimate(Protocol):
    """What one settled cycle is expected to do."""

    @property
    def peak_force_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Greatest force [kN]."""
        ...

    @property
    def absorbed_energy_J(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Energy turned into heat in one cycle [J]."""
        ...


class StaticEstimate(CycleEstimate, Protocol):
    """What one quasi-static cycle is expected to do."""

    @property
    def end_stroke_mm(self) -> float:
        """Stroke at which it turns [mm]."""
        ...


@dataclass(frozen=True)
class Temperatures:
    """Of the specimen's mass, which decides forces, and of the sensor on it, which decides the stop [°C]."""

    mass_C: float
    sensor_C: float


class Predictor(Protocol):
    """The spring model as the planner sees it."""

    def harmonic(
        self, prestress_mm: float, amplitude_mm: float, frequency_Hz: float, temperature_C: float
    ) -> CycleEstimate:
        """Return the settled harmonic cycle."""
        ...

    def static(
        self, force_limit_kN: float, stroke_limit_mm: float, speed_mm_per_s: float, temperature_C: float
    ) -> StaticEstimate:
        """Return the cycle from zero to whichever limit comes first, and back."""
        ...

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
        """Return the temperatures after ``duration_s`` of constant heating power.

        With factors the heat law is C dT/dt = ``heating`` P − ``cooling`` λ (T − T_0); the lag stays.
        """
        ...


_UNLIMITED_KN = 1e9


def force_at(predictor: Predictor, stroke_mm: float, speed_mm_per_s: float, temperature_C: float) -> float:
    """Return the force [kN] of a first compression to a stroke at constant speed; 0 at no stroke."""
    if stroke_mm <= 0.0:
        return 0.0
    return predictor.static(_UNLIMITED_KN, stroke_mm, speed_mm_per_s, temperature_C).peak_force_kN


def peak_force(
    predictor: Predictor,
    prestress_mm: float,
    amplitude_mm: float,
    frequency_Hz: float,
    ramp_speed_mm_per_s: float,
    temperature_C: float,
) -> float:
    """Return the greatest force [kN] that a harmonic step can bring.

    The settled loop alone would say too little: it drops below the loading branch, on which the ramp and
    the first cycles still run (94 ± 1 mm: 463 kN settled, 605 kN simulated, 620 kN by this bound).
    """
    settled = predictor.harmonic(prestress_mm, amplitude_mm, frequency_Hz, temperature_C).peak_force_kN
    return max(settled, force_at(predictor, prestress_mm + amplitude_mm, ramp_speed_mm_per_s, temperature_C))


def sensor_after(
    heat: HeatBalance, start: Temperatures, ambient_C: float, power_W: float, duration_s: float
) -> float:
    """Return what the sensor reads [°C] after ``duration_s`` of constant power.

    The sensor follows ``T_0 + gain (T - T_0)`` with first-order lag, while T goes by eq. (7); both
    exponentials are integrated exactly.
    """
    mass_s = (
        min(heat.capacity_J_per_K / heat.loss_W_per_K, _INSULATED_S) if heat.loss_W_per_K else _INSULATED_S
    )
    end_C = ambient_C + power_W * mass_s / heat.capacity_J_per_K  # where T would settle
    steady = ambient_C + heat.sensor_gain * (end_C - ambient_C)
    swing = heat.sensor_gain * (start.mass_C - end_C)
    decay = math.exp(-duration_s / mass_s)
    if heat.sensor_lag_s == 0.0:
        return steady + swing * decay
    follow = math.exp(-duration_s / heat.sensor_lag_s)
    apart = 1.0 / heat.sensor_lag_s - 1.0 / mass_s
    if apart == 0.0:
        mixed = duration_s * follow
    elif apart > 0.0:
        mixed = decay * -math.expm1(-apart * duration_s) / apart
    else:
        mixed = follow * math.expm1(apart * duration_s) / apart
    return start.sensor_C * follow + steady * (1.0 - follow) + swing * mixed / heat.sensor_lag_s


@dataclass(frozen=True)
class ModelPredictor:
    """The identified spring model, asked as :class:`Predictor`."""

    model: SpringModel

    def harmonic(
        self, prestress_mm: float, amplitude_mm: float, frequency_Hz: float, temperature_C: float
    ) -> CycleEstimate:
        """Return the settled harmonic cycle (:func:`model.prediction.predict_harmonic`)."""
        return predict_harmonic(self.model, prestress_mm, amplitude_mm, frequency_Hz, temperature_C)

    def static(
        self, force_limit_kN: float, stroke_limit_mm: float, speed_mm_per_s: float, temperature_C: float
    ) -> StaticEstimate:
        """Return the slow cycle (:func:`model.prediction.predict_static`)."""
        return predict_static(self.model, force_limit_kN, stroke_limit_mm, speed_mm_per_s, temperature_C)

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
        """Return the temperatures: :func:`model.prediction.heat_step`, and the sensor's lag."""
        heat = self.model.heat
        if heating != 1.0 or cooling != 1.0:
            heat = replace(
                heat,
                capacity_J_per_K=heat.capacity_J_per_K / heating,
                loss_W_per_K=heat.loss_W_per_K * cooling / heating,
            )
        return Temperatures(
            heat_step(heat, start.mass_C, ambient_C, power_W, duration_s),
            sensor_after(heat, start, ambient_C, power_W, duration_s),
        )


@dataclass
class CoarsePredictor:
    """A predictor that is asked at every eighth kelvin only and interpolates between, for the planner.

    What a cycle absorbs is smooth in temperature, so that this errs by far less than the model itself.

    Parameters
    ----------
    fine : Predictor
        Who knows.
    step_C : float
        Distance of the temperatures at which it is asked [K].
    """

    fine: Predictor
    step_C: float = 8.0
    _known: dict[tuple[float, ...], _Cycle] = field(default_factory=dict)

    def harmonic(
        self, prestress_mm: float, amplitude_mm: float, frequency_Hz: float, temperature_C: float
    ) -> CycleEstimate:
        """Return the settled harmonic cycle."""

        def ask(at_C: float) -> _Cycle:
            cycle = self.fine.harmonic(prestress_mm, amplitude_mm, frequency_Hz, at_C)
            return _Cycle(cycle.peak_force_kN, cycle.absorbed_energy_J, 0.0)

        return self._between((prestress_mm, amplitude_mm, frequency_Hz), ask, temperature_C)

    def static(
        self, force_limit_kN: float, stroke_limit_mm: float, speed_mm_per_s: float, temperature_C: float
    ) -> StaticEstimate:
        """Return the slow cycle."""

        def ask(at_C: float) -> _Cycle:
            cycle = self.fine.static(force_limit_kN, stroke_limit_mm, speed_mm_per_s, at_C)
            return _Cycle(cycle.peak_force_kN, cycle.absorbed_energy_J, cycle.end_stroke_mm)

        return self._between((force_limit_kN, stroke_limit_mm, speed_mm_per_s, 0.0), ask, temperature_C)

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
        """Return the temperatures, as exact as they are."""
        return self.fine.temperatures_after(
            start, ambient_C, power_W, duration_s, heating=heating, cooling=cooling
        )

    def _between(
        self, what: tuple[float, ...], ask: Callable[[float], _Cycle], temperature_C: float
    ) -> _Cycle:
        low_C = math.floor(temperature_C / self.step_C) * self.step_C
        ends = []
        for at_C in (low_C, low_C + self.step_C):
            key = (*what, at_C)
            if key not in self._known:
                self._known[key] = ask(at_C)
            ends.append(self._known[key])
        share = (temperature_C - low_C) / self.step_C
        low, high = ends
        return _Cycle(
            low.peak_force_kN + share * (high.peak_force_kN - low.peak_force_kN),
            low.absorbed_energy_J + share * (high.absorbed_energy_J - low.absorbed_energy_J),
            low.end_stroke_mm + share * (high.end_stroke_mm - low.end_stroke_mm),
        )


@dataclass(frozen=True)
class _Cycle:
    peak_force_kN: float
    absorbed_energy_J: float
    end_stroke_mm: float
