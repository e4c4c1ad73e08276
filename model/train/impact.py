"""Two wagons that meet with their buffers: what one buffer stores and absorbs (after EN 15551, Annex E)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.model.spring import SpringModel
from bufferstand.model.stepper import SpringStepper

_STEP_S = 1e-4
_LONGEST_S = 5.0
_SPEEDS_M_PER_S = (0.05, 8.0)
_SPEED_TOLERANCE_M_PER_S = 1e-4


@dataclass(frozen=True)
class ImpactPrediction:
    """One buffer of two wagons that met.

    Parameters
    ----------
    speed_m_per_s : float
        With which the wagons met.
    stroke_mm, peak_force_kN : float
        Largest stroke and force.
    stored_energy_J, absorbed_energy_J : float
        Work up to the largest stroke, and what of it was not given back.
    """

    speed_m_per_s: float
    stroke_mm: float
    peak_force_kN: float
    stored_energy_J: float
    absorbed_energy_J: float

    @property
    def damping(self) -> float:
        """Absorbed by stored energy."""
        return self.absorbed_energy_J / self.stored_energy_J


def predict_impact(
    model: SpringModel, wagon_mass_t: float, speed_m_per_s: float, temperature_C: float
) -> ImpactPrediction:
    """Predict the meeting of two free equal wagons, each with two buffers of this kind on that end.

    Four equal springs, two in a row and two beside each other: with x of one buffer and F its force the
    wagons' relative motion is (M / 2) x'' = -F, x' = v / 2 at contact.

    Parameters
    ----------
    model : SpringModel
        The buffer's spring, at rest before.
    wagon_mass_t : float
        M of each wagon [t].
    speed_m_per_s : float
        With which they meet.
    temperature_C : float
        Of spring and air.

    Returns
    -------
    ImpactPrediction

    Raises
    ------
    ValueError
        If mass or speed is not above 0, or the wagons have not parted after five seconds.
    """
    if not (wagon_mass_t > 0.0 and speed_m_per_s > 0.0):
        raise ValueError("mass and speed must be above 0")
    spring = SpringStepper(model, temperature_C, temperature_C)
    mass_t, x, speed = 0.5 * wagon_mass_t, 0.0, 0.5 * speed_m_per_s
    strokes, forces = [0.0], [0.0]
    for _ in range(round(_LONGEST_S / _STEP_S)):
        x += 1e3 * speed * _STEP_S
        force = spring.step(x, _STEP_S)
        speed -= force / mass_t * _STEP_S
        strokes.append(x)
        forces.append(force)
        if speed < 0.0 and force <= 0.0:
            break
    else:
        raise ValueError("the wagons have not parted after five seconds")
    stroke, F = np.array(strokes), np.array(forces)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (F[1:] + F[:-1]) * np.diff(stroke))])
    top = int(np.argmax(stroke))
    return ImpactPrediction(
        speed_m_per_s, float(stroke[top]), float(F.max()), float(work[top]), float(work[-1])
    )


def impact_to(
    model: SpringModel, wagon_mass_t: float, stroke_mm: float, temperature_C: float
) -> ImpactPrediction:
    """Return the impact that compresses each buffer just so far (within a few hundredths of a millimetre).

    Parameters
    ----------
    model : SpringModel
    wagon_mass_t : float
        Of each wagon [t].
    stroke_mm : float
        Largest stroke, above 0.
    temperature_C : float
        Of spring and air.

    Raises
    ------
    ValueError
        If no speed from 0.05 to 8 m/s compresses them so far.
    """
    low, high = _SPEEDS_M_PER_S
    if not predict_impact(model, wagon_mass_t, high, temperature_C).stroke_mm > stroke_mm > 0.0:
        raise ValueError(f"no impact of up to {high:g} m/s compresses the buffers by {stroke_mm:g} mm")
    while high - low > _SPEED_TOLERANCE_M_PER_S:
        middle = 0.5 * (low + high)
        if predict_impact(model, wagon_mass_t, middle, temperature_C).stroke_mm < stroke_mm:
            low = middle
        else:
            high = middle
    return predict_impact(model, wagon_mass_t, low, temperature_C)
