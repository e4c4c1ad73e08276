"""Stroke speed of a branch as the speed limit is judged by, and what noise alone adds to it."""

from __future__ import annotations

import numpy as np

from evaluation.quantities import SPEED_WINDOW
from evaluation.record import FloatArray, Record
from evaluation.smoothing import moving_slopes

_LEAST_WINDOW = 5
_PEAK_OF_NOISE = 5.0
"""The largest of the slopes of all cycles exceeds the true one by less than so many of their deviations."""


def branch_speed(record: Record, start_s: float, end_s: float, noise_mm: float) -> tuple[float, float] | None:
    """Return the largest speed between two moments and what noise may have added to it [mm/s].

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
    (float, float) or None
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
    return float(np.max(np.abs(whole))), _PEAK_OF_NOISE * u
