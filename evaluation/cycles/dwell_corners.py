"""The moment at which a flank of the stroke meets a dwell, from the flank's own samples.

The first sample inside the dwell's band is up to a step late: on average half a step at either end, so that a
cycle would be a step too long (1 % of it at 100 samples a cycle). A line through the flank has no such bias.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.numerics import FloatArray

FLANK_SAMPLES = 6
"""A flank is fitted over at least so many samples, where it has them."""
_MOST_BANDS = 30.0
"""Samples further than this many bands from the dwell are no part of its flank, but for the least three."""
_LEAST = 3
_SURE = 3.0
_RISES = 0.01
"""Over its samples a flank rises by some bands. Values that are held rise by rounding alone."""


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
        left to climb; None where the flank has fewer than three samples, or does not rise (values that
        are held over many rows).
    """
    near = first_in - int(np.searchsorted(-value[:first_in][::-1], -(level - 9.0 * band), side="right"))
    first = min(near, first_in - FLANK_SAMPLES)
    first = max(0, first)
    while first < first_in - _LEAST and value[first] < level - _MOST_BANDS * band:
        first += 1
    if first_in - first < _LEAST:
        return None
    line = _line(time_s[first:first_in] - time_s[first_in], value[first:first_in], sigma)
    if line.speed * float(time_s[first_in - 1] - time_s[first]) <= _RISES * band:
        return None
    corner_s, u_s = line.reaches(level)
    u_s = float(np.hypot(u_s, _eased_s(time_s, value, (first, first_in), level, band, line, sigma)))
    # One noisy sample must not cut off the later half of the moments that are as likely as the earlier one.
    latest = max(0.0, (level - float(value[first_in]) + _SURE * sigma) / line.speed)
    last_s = float(time_s[first_in - 1] - time_s[first_in])
    return float(time_s[first_in]) + float(np.clip(corner_s, last_s, latest)), u_s


class _Line(NamedTuple):
    """A straight line through samples: their mean moment and value, its slope, Σ (t - t_mean)², noise."""

    middle_s: float
    mean: float
    speed: float
    spread: float
    scatter: float
    samples: int

    def reaches(self, level: float) -> tuple[float, float]:
        """Return when it reaches a level, and the standard uncertainty of that."""
        reach = (level - self.mean) / self.speed
        u_s = self.scatter / self.speed * float(np.sqrt(1.0 / self.samples + reach**2 / self.spread))
        return self.middle_s + reach, u_s


def _line(time_s: FloatArray, value: FloatArray, sigma: float) -> _Line:
    """Return the line by least squares; of noise that is less than ``sigma`` nobody is sure."""
    middle, mean = float(np.mean(time_s)), float(np.mean(value))
    since = time_s - middle
    spread = float(since @ since)
    speed = float(since @ value) / spread
    residual = value - mean - speed * since
    scatter = max(float(np.sqrt(residual @ residual / max(1, time_s.size - 2))), sigma)
    return _Line(middle, mean, speed, spread, scatter, time_s.size)


def _eased_s(
    time_s: FloatArray,
    value: FloatArray,
    near: tuple[int, int],
    level: float,
    band: float,
    line: _Line,
    sigma: float,
) -> float:
    """Return the standard uncertainty of a corner that a stand eases into [s]; 0 where none is to be seen.

    There the flank is the slower the nearer it is, and the stroke arrives later than its last part says. By
    how much the part before tells: what the lines through the two (of 9, and of 9 to 30 bands) differ by. It
    is two thirds of that with constant deceleration, and more of a lag that has no end.
    """
    first, first_in = near
    below = -(level - _MOST_BANDS * band)
    far = first_in - int(np.searchsorted(-value[:first_in][::-1], below, side="right"))
    if first - far < _LEAST:
        return 0.0
    other = _line(time_s[far:first] - time_s[first_in], value[far:first], sigma)
    if other.speed <= 0.0:
        return 0.0
    (near_s, u_near_s), (far_s, u_far_s) = line.reaches(level), other.reaches(level)
    return max(0.0, near_s - far_s - 2.0 * float(np.hypot(u_near_s, u_far_s)))
