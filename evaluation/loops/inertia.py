"""Inertia of what moves between the load cell and the specimen.

Cell on the moving side (it pushes the mass, the mass pushes the specimen): F = F_cell - m a (a = d²x/dt²).
It reads too little by m ω² x_a, in phase with the stroke: K′ grows by m ω², and the loop keeps its area. Cell
on the fixed side (behind the specimen; m moves between the face whose force is asked for and the cell):
F = F_cell + m a. 150 kg at 2.55 Hz and 5 mm make 0.19 kN.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bufferstand.evaluation.facts import (
    MASS_ACCURACY_PERCENT,
    Cycle,
    ForceCell,
    InertiaCorrection,
    MassSource,
    MovingMass,
)
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Record
from bufferstand.foundation import BadInput
from bufferstand.foundation.numbers import MASS_ACCURACY_MOST_PERCENT, MOVING_MASS_MOST_KG, median

WINDOW = 0.2
"""Acceleration: quartic over this share of the shortest cycle (at least 7 samples)."""
_DEGREE = 4
_LEAST_SAMPLES = 7
_KN_PER_KG_MM_S2 = 1e-6


@dataclass(frozen=True, eq=False)
class InertiaForce:
    """Force that the correction added, shape (N,) [kN], the limit of its relative error, and its noise."""

    added_kN: FloatArray
    limit: float
    noise_kN: float


def correct_inertia(
    record: Record, cycles: Sequence[Cycle], stand: MovingMass, option: MovingMass
) -> tuple[Record, InertiaCorrection, InertiaForce | None]:
    """Return the record with the force that acts on the specimen, and what was added to it.

    Parameters
    ----------
    record : Record
        Force as the load cell read it.
    cycles : sequence of Cycle
        Of this record; the shortest one sets the window in which acceleration is fitted.
    stand, option : MovingMass
        As the stand file and as the options state it; the latter comes first. 0 kg or none: nothing is done.

    Raises
    ------
    BadInput
        If the mass, or the limit of its error, is negative, no number, or larger than any.
    """
    mass = option.over(stand)
    kg = mass.kg or 0.0
    percent = MASS_ACCURACY_PERCENT if mass.accuracy_percent is None else mass.accuracy_percent
    if not 0.0 <= kg <= MOVING_MASS_MOST_KG:
        raise BadInput(
            f"a moving mass of {kg:g} kg is none",
            remedy=f"state 0 to {MOVING_MASS_MOST_KG:g} kg (0: no correction)",
        )
    if not 0.0 <= percent <= MASS_ACCURACY_MOST_PERCENT:
        raise BadInput(
            f"the moving mass cannot be known to {percent:g} %",
            remedy=f"state 0 to {MASS_ACCURACY_MOST_PERCENT:g} %",
        )
    if kg == 0.0 or not cycles:
        return record, InertiaCorrection(), None
    cell: ForceCell = mass.force_cell or "moving-side"
    window_s = WINDOW * min(cycle.duration_s for cycle in cycles)
    sign = -1.0 if cell == "moving-side" else 1.0
    added = sign * kg * _KN_PER_KG_MM_S2 * acceleration_mm_per_s2(record, window_s)
    largest = float(np.max(np.abs(added), initial=0.0))
    source: MassSource = "stand" if option.kg is None else "option"
    noise_kN = kg * _KN_PER_KG_MM_S2 * acceleration_noise_mm_per_s2(record, window_s)
    return (
        replace(record, force_kN=record.force_kN + added),
        InertiaCorrection(kg, source, largest, percent, cell),
        InertiaForce(added, percent / 100.0, noise_kN),
    )


def acceleration_noise_mm_per_s2(record: Record, window_s: float) -> float:
    """Return the standard deviation that white noise of the stroke gives the acceleration [mm/s²]."""
    if record.time_s.size < _LEAST_SAMPLES:
        return 0.0
    from scipy.signal import savgol_coeffs  # noqa: PLC0415 - half a second, for runs with a moving mass only

    step_s = median(np.diff(record.time_s))
    weights = savgol_coeffs(_odd_window(window_s, step_s), _DEGREE, deriv=2, delta=step_s)
    return record.stroke_sampling.sigma * float(np.linalg.norm(weights))


def _odd_window(window_s: float, step_s: float) -> int:
    return max(_LEAST_SAMPLES, 2 * int(0.5 * window_s / step_s) + 1)


def acceleration_mm_per_s2(record: Record, window_s: float) -> FloatArray:
    """Return the second derivative of the stroke [mm/s²], shape (N,), from local polynomials.

    Never across a break; 0 in a stretch too short to be fitted.
    """
    from scipy.signal import savgol_filter  # noqa: PLC0415 - half a second, for runs with a moving mass only

    result = np.zeros_like(record.stroke_mm)
    for first, last in pairwise([0, *record.breaks, record.time_s.size]):
        time, stroke = record.time_s[first:last], record.stroke_mm[first:last]
        if time.size < _LEAST_SAMPLES:
            continue
        step = float(time[-1] - time[0]) / (time.size - 1)
        samples = min(_odd_window(window_s, step), time.size - 1 + time.size % 2)
        even = np.linspace(time[0], time[-1], time.size)
        fitted = savgol_filter(np.interp(even, time, stroke), samples, _DEGREE, deriv=2, delta=step)
        result[first:last] = np.interp(time, even, fitted)
    return result
