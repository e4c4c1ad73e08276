"""What may lie between the readings of a force that was interpolated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SEVERAL = (2, 3)
"""Of so many readings one each is left, once from each of them on."""
PARTS = sum(SEVERAL)

_FEWEST = 16


@dataclass(frozen=True, eq=False)
class Between:
    """What may lie between the readings of a force that was brought to other instants.

    Attributes
    ----------
    step_s : float
        Usual step of its readings.
    time_s : array, shape (N,)
    fewer_kN : array, shape (5, N)
        What parts of them give, less what all give (:class:`evaluation.channels.bring.Brought`).
    """

    step_s: float
    time_s: FloatArray
    fewer_kN: FloatArray
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

    def by_one_of(self, several: int, first: int, time_s: FloatArray) -> FloatArray:
        """Return by how much one of several readings gives another force at some moments [kN], shape (M,).

        Parameters
        ----------
        several : int
            2 or 3.
        first : int
            From which of them on.
        time_s : array, shape (M,)
        """
        part = sum(known for known in SEVERAL if known < several) + first
        return np.asarray(np.interp(time_s, self.time_s, self.fewer_kN[part]), dtype=np.float64)
