"""The least and the greatest sample of a column, and whether it stands alone."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence

import numpy as np

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record.record import Ends, Peak
from bufferstand.foundation.numbers import median

NEAR = 16
"""So many samples to each side are kept with an extreme one."""
_CHUNK = 32_768
"""Samples that are looked at together."""
_BESIDE = 4
"""A lone sample is compared with so many on each side."""
_STEPS_APART = 4.0
"""It is further from both neighbours than so many of the largest step between those beside it. The tip of a
triangle is one step away, a smooth peak less, the largest of noisy samples about two."""
_NOISE_APART = 10.0
"""… and than so many standard deviations of the noise about it …"""
_SHARE_APART = 0.005
"""… and than this share of the range of the channel in the run …"""
_LEAST_APART: Mapping[str, float] = {"force": 0.1, "stroke": 0.05, "speed": 1.0, "temperature": 1.0}
"""… and than a few steps of a usual converter [kN, mm, mm/s, K]."""
_CONVERTER_STEPS = 4.0
"""… and than so many steps of the converter: where it is coarse, most samples are alike to the last digit."""
_HOLE = 5.0
"""What is further in time than so many steps of those about it is no neighbour: a log that is written by
event has none while nothing changes."""
_ROUNDING = 1e-9
"""Values that differ by less than this share of the range differ by rounding."""
_FEWEST_NEAR = 6
_DIFFERENCE_GAIN = 1.4826 / np.sqrt(20.0)
"""Median of absolute third differences to the standard deviation of white noise."""


def peaks_of(time_s: FloatArray, value: FloatArray, breaks: Sequence[int] = ()) -> Ends | None:
    """Return the least and the greatest sample of a column.

    Parameters
    ----------
    time_s, value : arrays, shape (N,)
        What is no number does not count.
    breaks : sequence of int
        Index i: a break lies before sample i.

    Returns
    -------
    (Peak, Peak) or None
        None where no sample is a number.
    """
    if not value.size:
        return None
    least, greatest = _places(value)
    if not np.isfinite(value[least] + value[greatest]):
        known = np.flatnonzero(np.isfinite(value) & np.isfinite(time_s))
        if not known.size:
            return None
        inner = np.searchsorted(known, np.asarray(breaks, dtype=np.intp)).tolist()
        return peaks_of(time_s[known], value[known], inner)
    return _peak(time_s, value, breaks, least), _peak(time_s, value, breaks, greatest)


def _places(value: FloatArray) -> tuple[int, int]:
    """Return where the least and the greatest value are; both find a NaN, if there is one."""
    if value.size <= _CHUNK:
        return int(np.argmin(value)), int(np.argmax(value))
    # Part by part, so that what one has brought into the processor's cache serves both.
    whole = value[: value.size // _CHUNK * _CHUNK].reshape(-1, _CHUNK)
    ends = np.array([(np.min(part), np.max(part)) for part in (*whole, value[whole.size :]) if part.size])
    low, high = int(np.argmin(ends[:, 0])), int(np.argmax(ends[:, 1]))
    least = int(np.argmin(value[low * _CHUNK : (low + 1) * _CHUNK]))
    return low * _CHUNK + least, high * _CHUNK + int(np.argmax(value[high * _CHUNK : (high + 1) * _CHUNK]))


def _peak(time_s: FloatArray, value: FloatArray, breaks: Sequence[int], row: int) -> Peak:
    after = bisect_right(breaks, row)
    first = max(0, row - NEAR, breaks[after - 1] if after else 0)
    last = min(value.size, row + NEAR + 1, breaks[after] if after < len(breaks) else value.size)
    if last - first > 1:
        steps = np.diff(time_s[first:last])
        holes = np.flatnonzero(steps > _HOLE * median(steps)) + first + 1
        first = int(np.max(holes[holes <= row], initial=first))
        last = int(np.min(holes[holes > row], initial=last))
    return Peak(float(value[row]), float(time_s[row]), value[first:last].copy(), row - first)


def joined(one: Ends | None, other: Ends | None) -> Ends | None:
    """Return the ends of two stretches together; of equal ones, the first."""
    if one is None or other is None:
        return other if one is None else one
    least = other[0] if other[0].value < one[0].value else one[0]
    greatest = other[1] if other[1].value > one[1].value else one[1]
    return least, greatest


def stands_alone(peak: Peak, quantity: str, range_: float) -> float | None:
    """Return by how much a sample differs from its neighbours, where no other one leads to it; else None.

    Parameters
    ----------
    peak : Peak
    quantity : str
        ``force``, ``stroke``, ``speed`` or ``temperature``.
    range_ : float
        Of the channel in the run, in its unit.
    """
    near, at = peak.near, peak.at
    left, right = near[max(0, at - _BESIDE) : at], near[at + 1 : at + 1 + _BESIDE]
    if near.size < _FEWEST_NEAR or not left.size + right.size:
        return None
    ends = [side for side in (left[-1:], right[:1]) if side.size]
    apart = float(min(abs(peak.value - end[0]) for end in ends))
    steps = np.concatenate((np.abs(np.diff(left)), np.abs(np.diff(right))))
    least = max(
        _STEPS_APART * float(np.max(steps, initial=0.0)),
        _NOISE_APART * _noise_about(near, at),
        _CONVERTER_STEPS * _converter_step(near, at, range_),
        _SHARE_APART * range_,
        _LEAST_APART[quantity],
    )
    return apart if apart > least else None


def _noise_about(near: FloatArray, at: int) -> float:
    """Return the standard deviation of the noise about a sample, without itself."""
    others = np.delete(near, at)
    return median(np.abs(np.diff(others, 3))) * float(_DIFFERENCE_GAIN) if others.size > 3 else 0.0


def _converter_step(near: FloatArray, at: int, range_: float) -> float:
    """Return the least difference between two values about a sample, without itself; 0: they are alike."""
    apart = np.diff(np.sort(np.delete(near, at)))
    apart = apart[apart > _ROUNDING * range_]
    return float(np.min(apart)) if apart.size else 0.0
