"""Stroke speed of a branch as the speed limit is judged by, what noise adds to it, and what rows may hide."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.numerics import FloatArray, moving_slopes
from bufferstand.evaluation.quantities import SPEED_WINDOW
from bufferstand.evaluation.record import Record

_LEAST_WINDOW = 5
_PEAK_OF_NOISE = 5.0
"""The largest of the slopes of all cycles exceeds the true one by less than so many of their deviations."""


class BranchSpeed(NamedTuple):
    """Largest speed of a branch as measured, and what noise alone may have added to it [mm/s]."""

    measured: float
    noise: float


def branch_speed(record: Record, start_s: float, end_s: float, noise_mm: float) -> BranchSpeed | None:
    """Return the largest speed between two moments and what noise may have added to it.

    Slope of a parabola over 5 % of the samples (at least 5), whole windows and recorded samples only:
    at the fitted ends of a loop two points may lie so near to each other that their noise makes a speed.

    Parameters
    ----------
    record : Record
    start_s, end_s : float
        Turning points of the branch.
    noise_mm : float
        Standard deviation of the noise of one stroke sample.

    Returns
    -------
    BranchSpeed or None
        None below five samples.
    """
    first = int(np.searchsorted(record.time_s, start_s, side="right"))
    last = int(np.searchsorted(record.time_s, end_s, side="left"))
    time, stroke = record.time_s[first:last], record.stroke_mm[first:last]
    if time.size < _LEAST_WINDOW:
        return None
    window = max(_LEAST_WINDOW, 2 * int(0.5 * SPEED_WINDOW * time.size) + 1)
    even: FloatArray = np.linspace(time[0], time[-1], time.size)
    step_s = float(even[1] - even[0])
    count = np.array([time.size])
    slope = moving_slopes(np.interp(even, time, stroke)[None], count, window)[0] / step_s
    whole = slope[window // 2 : slope.size - window // 2]
    u = noise_mm * float(np.sqrt(12.0 / (window * (window**2 - 1.0)))) / step_s
    return BranchSpeed(float(np.max(np.abs(whole))), _PEAK_OF_NOISE * u)


def between_rows(time_s: FloatArray, stroke_mm: FloatArray, duration_s: float) -> float:
    """Return the largest speed over 5 % of a branch that rows far apart may hide [mm/s]; 0 where none are.

    A stand may stand in one step of time and hurry in the next, so that all that lies between three rows
    was made about the middle one. Rows that are nearer show it themselves.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
        Rows of the branch, its turning points among them.
    duration_s : float
        Of the branch.
    """
    window_s = SPEED_WINDOW * duration_s
    if time_s.size < 3 or window_s <= 0.0:
        return 0.0
    far = time_s[2:] - time_s[:-2] >= window_s
    return float(np.max(np.abs(stroke_mm[2:] - stroke_mm[:-2])[far], initial=0.0)) / window_s
