"""Whether a sensor's readings cover a cycle: the longest time in it without a reading.

The points of a cycle are its start, each reading in it, and its end. They cover it where none is farther
from the next than a limit (docs/evaluation-document.md). Of a cycle without a reading in it, the nearest
reading outside takes the place of those inside: fast cycles follow each other between two readings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Temperature

READING_INTERVAL_S = 15.0
"""Readings cover a cycle up to this distance, unless the limit set says otherwise."""


class TemperatureGap(NamedTuple):
    """A stretch of time in which a sensor has no reading [s]."""

    from_s: float
    to_s: float

    @property
    def length_s(self) -> float:
        """How long it is [s]."""
        return self.to_s - self.from_s

    def text(self, interval_s: float) -> str:
        """Return where it is and how long, beside the limit."""
        return (
            f"no reading from {self.from_s:.1f} s to {self.to_s:.1f} s of the record "
            f"({self.length_s:.1f} s, permitted {interval_s:g} s)"
        )


def readings_of(sensor: Temperature) -> tuple[FloatArray, FloatArray]:
    """Return the valid readings of a sensor in order of time: moments [s] and temperatures [°C]."""
    good = np.isfinite(sensor.time_s) & np.isfinite(sensor.temperature_C)
    time_s, value_C = sensor.time_s[good], sensor.temperature_C[good]
    if np.any(time_s[1:] < time_s[:-1]):
        order = np.argsort(time_s, kind="stable")
        return time_s[order], value_C[order]
    return time_s, value_C


def read_at(time_s: FloatArray, value_C: FloatArray, at_s: FloatArray, interval_s: float) -> FloatArray:
    """Return what readings say at some moments [°C]: the line between those beside a moment, or the nearest.

    Readings farther apart than ``interval_s`` do not speak for what is between them: the nearest counts. NaN
    where it is farther away than that, too.

    Parameters
    ----------
    time_s, value_C : arrays, shape (N,)
        Valid readings in order of time, at least one.
    at_s : array, shape (C,)
    interval_s : float
    """
    after = np.searchsorted(time_s, at_s)
    before, behind = np.maximum(after - 1, 0), np.minimum(after, time_s.size - 1)
    to_before, to_behind = np.abs(at_s - time_s[before]), np.abs(time_s[behind] - at_s)
    nearest = value_C[np.where(to_before < to_behind, before, behind)]
    joined = time_s[behind] - time_s[before] <= interval_s
    read = np.where(joined, np.interp(at_s, time_s, value_C), nearest)
    return np.where(np.minimum(to_before, to_behind) <= interval_s, read, np.nan)


def longest_hole(time_s: FloatArray, start_s: float, end_s: float) -> TemperatureGap | None:
    """Return the longest stretch without a reading in a cycle.

    Parameters
    ----------
    time_s : array, shape (N,)
        Moments of valid readings, rising.
    start_s, end_s : float
        Of the cycle.

    Returns
    -------
    Hole or None
        None where there is no reading at all. Where none lies in the cycle, the stretch reaches from the
        nearest one to the far end of the cycle.
    """
    if time_s.size == 0:
        return None
    first, last = np.searchsorted(time_s, start_s), np.searchsorted(time_s, end_s, side="right")
    if last > first:
        points = np.concatenate(([start_s], time_s[first:last], [end_s]))
        at = int(np.argmax(np.diff(points)))
        return TemperatureGap(float(points[at]), float(points[at + 1]))
    sides = []
    if first > 0:
        sides.append(TemperatureGap(float(time_s[first - 1]), end_s))
    if last < time_s.size:
        sides.append(TemperatureGap(start_s, float(time_s[last])))
    return min(sides, key=lambda hole: hole.length_s)


def covers(
    time_s: FloatArray, start_s: FloatArray, end_s: FloatArray, interval_s: float = READING_INTERVAL_S
) -> NDArray[np.bool_]:
    """Say which cycles the readings cover: :func:`longest_hole` is no longer than ``interval_s``.

    Parameters
    ----------
    time_s : array, shape (N,)
        Moments of valid readings, rising.
    start_s, end_s : arrays, shape (C,)
        Of the cycles.
    interval_s : float
        Longest distance between points of a cycle that are next to each other [s].

    Returns
    -------
    array of bool, shape (C,)
    """
    if time_s.size == 0:
        return np.zeros(start_s.size, dtype=bool)
    first, last = np.searchsorted(time_s, start_s), np.searchsorted(time_s, end_s, side="right")
    some = last > first
    after = np.where(last < time_s.size, time_s[np.minimum(last, time_s.size - 1)], np.inf)
    before = np.where(first > 0, time_s[np.maximum(first - 1, 0)], -np.inf)
    to_first = time_s[np.minimum(first, time_s.size - 1)] - start_s
    from_last = end_s - time_s[np.maximum(last - 1, 0)]
    ends = np.where(some, np.maximum(to_first, from_last), np.minimum(after - start_s, end_s - before))
    covered = np.asarray(ends <= interval_s)
    holes = np.flatnonzero(np.diff(time_s) > interval_s)
    if holes.size:
        # The first hole that begins in or after the cycle is inside if it also ends in it.
        following = np.append(holes, time_s.size)[np.searchsorted(holes, first)]
        covered &= ~(some & (following + 1 < last))
    return covered
