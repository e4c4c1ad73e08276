"""How transducers drift: with time, and with their own temperature while the stand warms up.

Load cell and draw wires sit on steel that the hydraulics warm after switching on, to first order:
``ΔT(t) = ΔT_end (1 − exp(−t/τ))``. The zero of a channel is ``z(t) = z0 + ż t + z_T ΔT(t)``, its gain
``1 + g_T ΔT(t)``. All of it is a function of time, so slices of any length give the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.simulated.settings import SimulationSettings

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TransducerDrift:
    """What becomes of zero and gain of channels that are sampled together; force in kN, wires in mm.

    Parameters
    ----------
    zero : tuple of float
        Of each channel when the stand is switched on.
    per_h : tuple of float
        Drift of each zero in an hour.
    per_K : tuple of float
        Change of each zero with temperature.
    gain_per_K : tuple of float
        Relative change of each gain with temperature.
    warm_up_K, warm_up_s : float
        Final rise of the temperature [K], and its time constant [s].
    """

    zero: tuple[float, ...]
    per_h: tuple[float, ...]
    per_K: tuple[float, ...]
    gain_per_K: tuple[float, ...]
    warm_up_K: float = 0.0
    warm_up_s: float = 3600.0

    @classmethod
    def of(cls, settings: SimulationSettings, wires: int = 2) -> Self:
        """Return the drift of the force and so many draw wires, in this order; the third is as the first."""

        def each(pair: tuple[float, float]) -> tuple[float, ...]:
            return tuple(pair[wire % 2] for wire in range(wires))

        return cls(
            (settings.force_zero_kN, *each(settings.wire_zero_mm)),
            (settings.force_drift_kN_per_h, *each(settings.wire_drift_mm_per_h)),
            (settings.force_zero_kN_per_K, *each(settings.wire_zero_mm_per_K)),
            (settings.force_gain_per_K, *[settings.wire_gain_per_K] * wires),
            settings.warm_up_K,
            settings.warm_up_s,
        )

    def warmth_K(self, time_s: FloatArray) -> FloatArray:  # noqa: N802 - the unit keeps its capital
        """Return how much warmer the transducers are than at the start [K], same shape as ``time_s``."""
        return np.asarray(-self.warm_up_K * np.expm1(-time_s / self.warm_up_s), dtype=np.float64)

    def feel(self, time_s: FloatArray, values: FloatArray) -> None:
        """Let channels drift in place.

        Parameters
        ----------
        time_s : NDArray, shape (n,)
            Stand time of each sample [s].
        values : NDArray, shape (n, channels)
            Their true values; what the transducers make of them afterwards. The first channels where there
            are fewer than this drift knows.
        """
        some = values.shape[1]
        zero, per_h, per_K, gain_per_K = self._rows
        warmth = self.warmth_K(time_s)[:, np.newaxis]
        values *= 1.0 + gain_per_K[:some] * warmth
        values += zero[:some] + per_K[:some] * warmth
        values += per_h[:some] * (time_s[:, np.newaxis] / 3600.0)

    @cached_property
    def _rows(self) -> FloatArray:
        """Zero, its drifts and the gain's, shape (4, channels)."""
        return np.array((self.zero, self.per_h, self.per_K, self.gain_per_K))
