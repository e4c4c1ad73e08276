"""What sensors of any quantity feel in the simulated machine."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.simulated.imperfections import TransducerDrift
from bufferstand.drivers.simulated.settings import SimulationSettings

FloatArray = NDArray[np.float64]

FORCE, STROKE, POSITION, COMMAND, TRUE_FORCE = range(5)
"""Columns of the truth that sensors feel: load cell, specimen, piston, set point, contact."""
BAR_PER_KN_MM2 = 1e4
"""1 kN on 1 mm² is 10 kbar."""
FELT = ("force", "stroke", "position", "command", "pressure", "temperature", "speed", "acceleration")
"""Every quantity that the simulated machine has."""


class FeltQuantities:
    """Follows the machine slice by slice.

    Parameters
    ----------
    settings : SimulationSettings
    drift : TransducerDrift
        What becomes of a further force, as of the first one.
    """

    def __init__(self, settings: SimulationSettings, drift: TransducerDrift) -> None:
        self._settings = settings
        self._drift = drift
        self._last = (0.0, 0.0, 0.0)

    def at(self, time_s: FloatArray, truth: FloatArray) -> Mapping[str, FloatArray]:
        """Return what each of :data:`FELT` is, shape (n,), in kN, mm, bar, °C, mm/s and m/s².

        Parameters
        ----------
        time_s : NDArray, shape (n,)
            Stand time of each sample [s]; slices follow one another.
        truth : NDArray, shape (n, columns)
            Force of the load cell, stroke, position, command and force of the contact come first.
        """
        force_kN = truth[:, FORCE : FORCE + 1].copy()
        self._drift.feel(time_s, force_kN)
        speed_mm_per_s, acceleration = self._moved(time_s, truth[:, STROKE])
        return {
            "force": force_kN[:, 0],
            "stroke": truth[:, STROKE],
            "position": truth[:, POSITION],
            "command": truth[:, COMMAND],
            "pressure": truth[:, TRUE_FORCE] * BAR_PER_KN_MM2 / self._settings.piston_area_mm2,
            "temperature": self._settings.ambient_C + self._drift.warmth_K(time_s),
            "speed": speed_mm_per_s,
            "acceleration": acceleration,
        }

    def contact_force(self, time_s: FloatArray, truth: FloatArray) -> FloatArray:
        """Return what a second amplifier of the load cell feels, without the delay of the first [kN]."""
        force_kN = truth[:, TRUE_FORCE : TRUE_FORCE + 1].copy()
        self._drift.feel(time_s, force_kN)
        return force_kN[:, 0]

    def _moved(self, time_s: FloatArray, stroke_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return speed [mm/s] and acceleration [m/s²] of the specimen from one sample to the next."""
        last_s, last_mm, last_speed = self._last
        steps_s = np.diff(time_s, prepend=last_s)
        speed = np.diff(stroke_mm, prepend=last_mm) / steps_s
        acceleration = np.diff(speed, prepend=last_speed) / steps_s / 1000.0
        self._last = float(time_s[-1]), float(stroke_mm[-1]), float(speed[-1])
        return speed, acceleration
