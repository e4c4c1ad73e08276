"""Steps of time longer than those around them: a logger may change its rate and lose nothing."""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.numerics import FloatArray, IndexArray

LONGER = 1.5
"""A step is unusual that is longer than this many usual ones (a missing sample makes 2) …"""
_NEAR = 8
"""… where usual is the second longest of so many steps before it and as many after it."""
_CHUNK = 65_536


def unusual_steps(time_s: FloatArray) -> IndexArray:
    """Return the samples that follow a step longer than 1.5 times those around it.

    What is usual is judged by the neighbours, not by the whole record: where a logger changes its rate, one
    side has steps as long as the step between.

    Parameters
    ----------
    time_s : array, shape (N,)
        Strictly rising [s].

    Returns
    -------
    array of int
        In order; none of a record of fewer than four samples.
    """
    if time_s.size < 4:
        return np.zeros(0, dtype=np.intp)
    step = np.diff(time_s)
    # A step that is not longer than both of its neighbours' … is not longer than most around it.
    lower = np.concatenate((step[1:2], np.minimum(step[:-2], step[2:]), step[-2:-1]))
    suspects = np.flatnonzero(step > LONGER * lower)
    found = [
        part[step[part] > LONGER * _usual(step, part)]
        for part in np.split(suspects, range(_CHUNK, suspects.size, _CHUNK))
    ]
    return np.asarray(np.concatenate(found) + 1, dtype=np.intp)


def _usual(step: FloatArray, at: IndexArray) -> FloatArray:
    """Return the second longest of the steps about each of some steps, itself left out."""
    around = np.concatenate((np.arange(-_NEAR, 0), np.arange(1, _NEAR + 1)))
    places = at[:, None] + around
    there = (places >= 0) & (places < step.size)
    steps = np.where(there, step[np.clip(places, 0, step.size - 1)], 0.0)
    return np.asarray(np.partition(steps, -2, axis=1)[:, -2])
