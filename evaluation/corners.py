"""The moment at which a flank of the stroke meets a dwell, from the flank's own samples.

The first sample inside the dwell's band is up to a step late: on average half a step at either end, so that a
cycle would be a step too long (1 % of it at 100 samples a cycle). A line through the flank has no such bias.
"""

from __future__ import annotations

import numpy as np

from evaluation.record import FloatArray

FLANK_SAMPLES = 6
"""A flank is fitted over at least so many samples, where it has them."""
_MOST_BANDS = 30.0
"""Samples further than this many bands from the dwell are no part of its flank, but for the least three."""
_LEAST = 3
_SURE = 3.0


def corner_moment(
    time_s: FloatArray, value: FloatArray, first_in: int, level: float, band: float, sigma: float
) -> tuple[float, float] | None:
    """Return when a rising flank reaches a level, and the standard uncertainty of the moment [s].

    Parameters
    ----------
    time_s, value : arrays, shape (N,)
        Turned so that the flank rises with increasing time and ends in the dwell.
    first_in : int
        First sample inside the dwell's band.
    level : float
        Height of the dwell behind the corner.
    band : float
        Half-width of the dwell's band.
    sigma : float
        Noise of one sample.

    Returns
    -------
    (float, float) or None
        Never before the last sample of the flank, nor after the dwell's first sample by more than what is
        left to climb; None where the flank has fewer than three samples.
    """
    near = first_in - int(np.searchsorted(-value[:first_in][::-1], -(level - 9.0 * band), side="right"))
    first = min(near, first_in - FLANK_SAMPLES)
    first = max(0, first)
    while first < first_in - _LEAST and value[first] < level - _MOST_BANDS * band:
        first += 1
    if first_in - first < _LEAST:
        return None
    time, flank = time_s[first:first_in] - time_s[first_in], value[first:first_in]
    middle = float(np.mean(time))
    spread = float(np.sum((time - middle) ** 2))
    speed = float(np.sum((time - middle) * flank)) / spread
    if speed <= 0.0:
        return None
    residual = flank - np.mean(flank) - speed * (time - middle)
    scatter = max(float(np.sqrt(residual @ residual / max(1, time.size - 2))), sigma)
    reach = (level - float(np.mean(flank))) / speed
    u_s = scatter / speed * float(np.sqrt(1.0 / time.size + reach**2 / spread))
    # One noisy sample must not cut off the later half of the moments that are as likely as the earlier one.
    latest = max(0.0, (level - float(value[first_in]) + _SURE * sigma) / speed)
    return float(time_s[first_in]) + float(np.clip(middle + reach, time[-1], latest)), u_s
