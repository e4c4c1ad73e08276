"""What the planner asks of the spring model, as the smallest interface that is enough, and its adapter."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bufferstand.model import (
    CyclePrediction,
    HeatBalance,
    SpringModel,
    heat_step,
    predict_forces,
    predict_harmonic,
    predict_static,
)
from bufferstand.protocols.prediction.machine_stroke import Sine, piston_mm, stroke_behind, stroke_sine

Floats = NDArray[np.float64]

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


class HarmonicEstimate(CycleEstimate, Protocol):
    """What one settled harmonic cycle is expected to do."""

    @property
    def lower_force_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Force at the lower turning point [kN]."""
        ...

    @property
    def stroke(self) -> Sine:
        """What the specimen does, where it is the piston that was told to make a sine."""
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
    """The specimen as the planner sees it.

    Strokes are the specimen's. Where a machine that gives way (``give_mm_per_kN``, 1 / k) is between it and
    what is told to move, they are the piston's, and the specimen's follow from the forces.
    """

    @property
    def known_to_mm(self) -> float:
        """To which stroke forces are known [mm]; 0: none is, infinite: to any."""
        ...

    @property
    def knows_heat(self) -> bool:
        """Whether temperatures can be predicted."""
        ...

    @property
    def sensor_lag_s(self) -> float | None:
        """By how much a sensor on the specimen lags behind its spring [s]; None: not known."""
        ...

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the user should know of where the figures come from; nothing for a spring model."""
        ...

    def bounding(self) -> Predictor:
        """Return the same specimen with the greatest forces that it may have: by it limits are judged."""
        ...

    def harmonic(
        self,
        prestress_mm: float,
        amplitude_mm: float,
        frequency_Hz: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> HarmonicEstimate:
        """Return the settled harmonic cycle."""
        ...

    def static(
        self,
        force_limit_kN: float,
        stroke_limit_mm: float,
        speed_mm_per_s: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> StaticEstimate:
        """Return the cycle from zero to whichever limit comes first, and back."""
        ...

    def forces(self, time_s: Floats, stroke_mm: Floats, temperature_C: float) -> Floats:
        """Return the force [kN] along a path of the specimen's strokes from rest, shape (n,)."""
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


def force_at(
    predictor: Predictor,
    stroke_mm: float,
    speed_mm_per_s: float,
    temperature_C: float,
    give_mm_per_kN: float = 0.0,
) -> float:
    """Return the force [kN] of a first compression to a stroke at constant speed; 0 at no stroke.

    With ``give_mm_per_kN`` it is the piston that goes there.
    """
    if stroke_mm <= 0.0:
        return 0.0
    return predictor.static(
        _UNLIMITED_KN, stroke_mm, speed_mm_per_s, temperature_C, give_mm_per_kN
    ).peak_force_kN


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
class HarmonicCycle:
    """A settled harmonic cycle; see :class:`HarmonicEstimate`."""

    peak_force_kN: float
    lower_force_kN: float
    absorbed_energy_J: float
    stroke: Sine


@dataclass(frozen=True)
class StaticCycle:
    """A slow cycle; see :class:`StaticEstimate`."""

    peak_force_kN: float
    absorbed_energy_J: float
    end_stroke_mm: float


@dataclass(frozen=True)
class ModelPredictor:
    """The identified spring model, asked as :class:`Predictor`."""

    model: SpringModel
    known_to_mm: float = math.inf
    knows_heat: bool = True
    assumptions: tuple[str, ...] = ()

    @property
    def sensor_lag_s(self) -> float:
        """By how much the sensor lags behind the spring [s]."""
        return self.model.heat.sensor_lag_s

    def bounding(self) -> Predictor:
        """Return itself: a model says the most that its spring gives at a temperature."""
        return self

    def harmonic(
        self,
        prestress_mm: float,
        amplitude_mm: float,
        frequency_Hz: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> HarmonicCycle:
        """Return the settled harmonic cycle (:func:`bufferstand.model.prediction.predict_harmonic`)."""

        def cycle(stroke: Sine) -> CyclePrediction:
            return predict_harmonic(
                self.model, stroke.mean_mm, stroke.amplitude_mm, frequency_Hz, temperature_C
            )

        def turning_forces(stroke: Sine) -> tuple[float, float]:
            found = cycle(stroke)
            return found.lower_force_kN, found.peak_force_kN

        stroke = stroke_sine(Sine(prestress_mm, amplitude_mm), turning_forces, give_mm_per_kN)
        found = cycle(stroke)
        return HarmonicCycle(found.peak_force_kN, found.lower_force_kN, found.absorbed_energy_J, stroke)

    def static(
        self,
        force_limit_kN: float,
        stroke_limit_mm: float,
        speed_mm_per_s: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> StaticCycle:
        """Return the slow cycle (:func:`bufferstand.model.prediction.predict_static`)."""

        def to(stroke_mm: float) -> StaticCycle:
            found = predict_static(self.model, force_limit_kN, stroke_mm, speed_mm_per_s, temperature_C)
            return StaticCycle(found.peak_force_kN, found.absorbed_energy_J, found.end_stroke_mm)

        return static_behind(to, stroke_limit_mm, give_mm_per_kN)

    def forces(self, time_s: Floats, stroke_mm: Floats, temperature_C: float) -> Floats:
        """Return the forces along a path (:func:`bufferstand.model.prediction.predict_forces`)."""
        return predict_forces(self.model, time_s, stroke_mm, temperature_C)

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
        """Return the temperatures: :func:`bufferstand.model.prediction.heat_step`, and the sensor's lag."""
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


def static_behind(
    to: Callable[[float], StaticCycle], position_limit_mm: float, give_mm_per_kN: float
) -> StaticCycle:
    """Return the slow cycle of a specimen whose piston turns at a position, or at the force limit before it.

    Parameters
    ----------
    to : callable
        The cycle to a stroke of the specimen [mm], or to its force limit, whichever comes first.
    position_limit_mm : float
        Where the piston turns [mm].
    give_mm_per_kN : float
        1 / k of the machine; 0 for a rigid one.
    """
    whole = to(position_limit_mm)
    if give_mm_per_kN == 0.0:
        return whole
    if piston_mm(whole.end_stroke_mm, whole.peak_force_kN, give_mm_per_kN) <= position_limit_mm:
        return whole  # the force limit comes first, machine or not
    end_mm = stroke_behind(position_limit_mm, lambda stroke_mm: to(stroke_mm).peak_force_kN, give_mm_per_kN)
    return to(end_mm) if end_mm > 0.0 else StaticCycle(0.0, 0.0, 0.0)
