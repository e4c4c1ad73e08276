"""The temperatures of cycles: at their start, and the highest one during them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.quantities.temperature.coverage import (
    READING_INTERVAL_S,
    covers,
    read_at,
    readings_of,
)
from bufferstand.evaluation.record import Temperature


def temperatures_of(
    temperatures: Sequence[Temperature],
    start_s: FloatArray,
    end_s: FloatArray,
    interval_s: float = READING_INTERVAL_S,
) -> tuple[FloatArray, FloatArray]:
    """Return temperature at the start and highest one during cycles, over all sensors on the specimen [°C].

    Parameters
    ----------
    temperatures : sequence of Temperature
    start_s, end_s : arrays, shape (C,)
        Of the cycles.
    interval_s : float
        How far readings may be from each other, and from start and end, to cover a cycle [s].

    Returns
    -------
    (array, array)
        Shape (C,) each. The first is NaN where no sensor on the specimen has a reading within
        ``interval_s`` of the start, the second where none covers the cycle by itself. What a further sensor
        reads in a cycle that it does not cover counts for the highest.
    """
    starts, highest = np.full(start_s.size, np.nan), np.full(start_s.size, np.nan)
    covered = np.zeros(start_s.size, dtype=bool)
    for sensor in temperatures:
        time_s, value_C = readings_of(sensor)
        if sensor.role != "specimen" or time_s.size == 0:
            continue
        at_start, at_end = (read_at(time_s, value_C, at_s, interval_s) for at_s in (start_s, end_s))
        starts = np.fmax(starts, at_start)
        within = np.fmax(at_start, at_end)
        first, last = np.searchsorted(time_s, start_s), np.searchsorted(time_s, end_s, side="right")
        some = np.flatnonzero(last > first)
        if some.size:
            # Every other maximum is over what lies between two cycles, and is not asked for.
            padded = np.append(value_C, -np.inf)
            bounds = np.stack((first[some], last[some]), axis=1).ravel()
            within[some] = np.fmax(within[some], np.maximum.reduceat(padded, bounds)[::2])
        highest = np.fmax(highest, within)
        covered |= covers(time_s, start_s, end_s, interval_s)
    return starts, np.where(covered, highest, np.nan)
