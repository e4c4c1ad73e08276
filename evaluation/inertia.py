"""Inertia of what moves between the load cell and the specimen.

The cell pushes the mass and the mass pushes the specimen: F_specimen = F + m a, with a = -d²x/dt² the
deceleration of the mass (a m ω² x_a cos of a sine stroke: in phase with the stroke, so that K′ grows by
m ω² and the loop keeps its area). 150 kg at 2.55 Hz and 5 mm make 0.19 kN.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.signal import savgol_filter

from evaluation.motion import Cycle
from evaluation.record import FloatArray, Record
from foundation.errors import BadInput

WINDOW = 0.2
"""Acceleration: quartic over this share of the shortest cycle (at least 7 samples)."""
_DEGREE = 4
_LEAST_SAMPLES = 7
_KN_PER_KG_MM_S2 = 1e-6

MassSource = Literal["none", "stand", "option"]


@dataclass(frozen=True)
class InertiaCorrection:
    """What was done about inertia: mass [kg], where it was stated, and the largest force added [kN]."""

    moving_mass_kg: float = 0.0
    source: MassSource = "none"
    largest_force_kN: float = 0.0


def corrected(
    record: Record, cycles: Sequence[Cycle], moving_mass_kg: float, source: MassSource
) -> tuple[Record, InertiaCorrection]:
    """Return the record with the force that acts on the specimen.

    Parameters
    ----------
    record : Record
        Force as the load cell read it.
    cycles : sequence of Cycle
        Of this record; the shortest one sets the window in which acceleration is fitted.
    moving_mass_kg : float
        Mass between load cell and specimen that moves with the stroke; 0: nothing is done.
    source : "stand" or "option"
        Where the mass was stated.

    Raises
    ------
    BadInput
        If the mass is negative or no number.
    """
    if not (np.isfinite(moving_mass_kg) and moving_mass_kg >= 0.0):
        raise BadInput(
            f"a moving mass of {moving_mass_kg:g} kg is none", remedy="state 0 kg or more (0: no correction)"
        )
    if moving_mass_kg == 0.0 or not cycles:
        return record, InertiaCorrection()
    window_s = WINDOW * min(cycle.duration_s for cycle in cycles)
    deceleration = -acceleration_mm_per_s2(record, window_s)
    added = moving_mass_kg * deceleration * _KN_PER_KG_MM_S2
    largest = float(np.max(np.abs(added), initial=0.0))
    return (
        replace(record, force_kN=record.force_kN + added),
        InertiaCorrection(moving_mass_kg, source, largest),
    )


def correct_inertia(
    record: Record, cycles: Sequence[Cycle], stand_kg: float | None, option_kg: float | None
) -> tuple[Record, InertiaCorrection]:
    """Return :func:`corrected` by the mass of the option, else of the stand file, else not at all."""
    if option_kg is not None:
        return corrected(record, cycles, option_kg, "option")
    return corrected(record, cycles, stand_kg or 0.0, "stand")


def acceleration_mm_per_s2(record: Record, window_s: float) -> FloatArray:
    """Return the second derivative of the stroke [mm/s²], shape (N,), from local polynomials.

    Never across a break; 0 in a stretch too short to be fitted.
    """
    result = np.zeros_like(record.stroke_mm)
    for first, last in pairwise([0, *record.breaks, record.time_s.size]):
        time, stroke = record.time_s[first:last], record.stroke_mm[first:last]
        if time.size < _LEAST_SAMPLES:
            continue
        step = float(time[-1] - time[0]) / (time.size - 1)
        samples = max(_LEAST_SAMPLES, 2 * int(0.5 * window_s / step) + 1)
        samples = min(samples, time.size - 1 + time.size % 2)
        even = np.linspace(time[0], time[-1], time.size)
        fitted = savgol_filter(np.interp(even, time, stroke), samples, _DEGREE, deriv=2, delta=step)
        result[first:last] = np.interp(time, even, fitted)
    return result
