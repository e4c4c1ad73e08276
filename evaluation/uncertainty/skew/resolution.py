"""Lower limits of the uncertainty of a measured skew, whatever the scatter of its cycles.

A generated record has no scatter, and a skew from it would seem certain to nanoseconds. The other parts are
the steps of time stamps and converters, the clock, a loss of the reference that varies with the rate, and a
delay of a filter that varies with the frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import FloatArray, sampling_of
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty.error_model import TIME_BASE_LIMIT

TIME_STEP_S = 1e-6
"""Time stamps of a run file are whole microseconds."""
LOSS_VARIES = 0.1
"""Limit of the change of the reference's loss factor between the lowest and the highest frequency, as a share
of it. Steel's loss hardly depends on the rate; guides, air and a film of oil do (our number)."""
_SQRT3 = float(np.sqrt(3.0))
_SQRT12 = float(np.sqrt(12.0))


@dataclass(frozen=True)
class Resolution:
    """Steps of the converters of a record, in standard deviations: force [kN], stroke [mm]."""

    force_kN: float
    stroke_mm: float

    @classmethod
    def of(cls, record: Record) -> Resolution:
        """Return those that the record shows; 0 where noise hides them, which scatters instead."""
        return cls(*(sampling_of(column).step / _SQRT12 for column in (record.force_kN, record.stroke_mm)))

    def skew_s(self, force_kN: float, stroke_mm: float, samples: int, frequency_Hz: float) -> float:
        """Return what they do to the skew of one cycle [s], rounding taken as white noise.

        With amplitudes F_a and x_a, N samples: u(W_a) = π √(2/N) √((σ_F x_a)² + (σ_x F_a)²), and a second of
        skew is π ω F_a x_a. Samples in step with the motion repeat their rounding in every cycle, so that
        cycles do not average it out.

        Parameters
        ----------
        force_kN, stroke_mm : float
            Amplitudes.
        samples : int
            In a cycle.
        frequency_Hz : float
        """
        share = np.hypot(self.force_kN / force_kN, self.stroke_mm / stroke_mm)
        return float(np.sqrt(2.0 / samples) * share / (2.0 * np.pi * frequency_Hz))


def skew_floors(
    omega: FloatArray,
    weights: FloatArray,
    resolution_s: Sequence[float],
    *,
    skew_s: float,
    delay_s: float,
    loss: float | None,
) -> dict[str, float]:
    """Return the standard uncertainties of a skew that do not show in its scatter, by source [s].

    Parameters
    ----------
    omega, weights, resolution_s : arrays, shape (P,)
        Angular frequency of each point [rad/s], its weight in the skew found, and :meth:`Resolution.skew_s`.
    skew_s : float
        The skew found.
    delay_s : float
        Delay of the force channel in all.
    loss : float or None
        Limit of the loss factor of the reference where it was fitted over the frequency; None at one.
    """
    floors = {
        # Rectangular, a step wide, of force and of stroke.
        "time stamps": float(np.hypot(TIME_STEP_S, TIME_STEP_S)) / _SQRT12,
        "clock": TIME_BASE_LIMIT * abs(skew_s) / _SQRT3,
        "resolution": float(np.linalg.norm(weights * np.asarray(resolution_s))),
        # A low pass of first order delays by T (1 - (ω T)²/3): what a second filter follows it by is within.
        "filters": abs(delay_s) * float(np.max(omega) * delay_s) ** 2 / 3.0 / _SQRT3,
    }
    if loss is not None:
        floors["reference loss over rate"] = LOSS_VARIES * loss / float(np.ptp(omega)) / _SQRT3
    return floors
