"""Bounds for the force between the readings from which it was interpolated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import FloatArray

_FEWEST = 16


@dataclass(frozen=True, eq=False)
class InterpolationLimits:
    """What may lie between the readings of a force that was brought to other instants.

    Attributes
    ----------
    step_s : float
        Usual step of its readings.
    time_s : array, shape (N,)
    halved_kN : array, shape (2, N)
        What every second one gives, and what the others give, less what all give.
    """

    step_s: float
    time_s: FloatArray
    halved_kN: FloatArray
    noise_kN: float = 0.0
    """Standard deviation of the readings' noise."""

    def noise_J(self, range_mm: float, duration_s: float) -> float:  # noqa: N802 - the unit keeps its capital
        """Return what the readings' noise alone makes of the difference in a cycle's energy (one u) [J].

        Of n readings at steps dx of a sine stroke: u² = u_F² Σ dx², Σ dx² = (π / √2 · range)² / n. 0 with
        fewer than 16 readings: there a curve looks like noise.
        """
        readings = duration_s / self.step_s
        if readings < _FEWEST:
            return 0.0
        return float(np.pi / np.sqrt(2.0 * readings)) * range_mm * self.noise_kN

    def at(self, first: int, time_s: FloatArray) -> FloatArray:
        """Return what every second reading, from ``first`` on, gives less what all give [kN], shape (M,)."""
        return np.asarray(np.interp(time_s, self.time_s, self.halved_kN[first]), dtype=np.float64)
