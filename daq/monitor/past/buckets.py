"""Samples in buckets of time: the least and greatest value of each."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Extremes = Mapping[str, tuple[Floats, Floats]]
"""Least and greatest values by channel, shape (buckets,) each; NaN where nothing was read."""
LONGEST_S = 30.0
"""A value that is read seldom holds until the next one, unless that comes later than this [s]."""


def bucketed(
    time_s: Floats, values: Mapping[str, Floats], width_s: float
) -> tuple[NDArray[np.int64], Extremes]:
    """Put samples into buckets.

    Parameters
    ----------
    time_s : NDArray[float64]
        Rising [s], shape (n,), n > 0.
    values : mapping of str to NDArray[float64]
        By channel, shape (n,) each; NaN where a value is missing.
    width_s : float
        Of a bucket; number k begins at k times this [s].

    Returns
    -------
    tuple of NDArray[int64] and mapping
        Numbers of the buckets that hold samples, rising, each once; and their extremes.
    """
    return _reduced(
        np.floor(time_s / width_s).astype(np.int64), {name: (one, one) for name, one in values.items()}
    )


def coarser(
    numbers: NDArray[np.int64], extremes: Extremes, factor: int
) -> tuple[NDArray[np.int64], Extremes]:
    """Return buckets that are so many times as wide, from :func:`bucketed` ones."""
    return _reduced(numbers // factor, extremes)


def _reduced(numbers: NDArray[np.int64], extremes: Extremes) -> tuple[NDArray[np.int64], Extremes]:
    first = np.flatnonzero(np.diff(numbers, prepend=numbers[0] - 1))
    return numbers[first], {
        name: (np.fmin.reduceat(low, first), np.fmax.reduceat(high, first))
        for name, (low, high) in extremes.items()
    }


def held(
    time_s: Floats,
    values: Mapping[str, Floats],
    every_s: float,
    longest_s: float,
    since_s: float = -math.inf,
) -> tuple[Floats, dict[str, Floats]]:
    """Return samples that come seldom as a reader of the newest value sees them: again until the next one.

    Parameters
    ----------
    time_s, values
        As for :func:`bucketed`.
    every_s : float
        So often a value is repeated [s].
    longest_s : float
        An interruption that lasts longer stays one [s].
    since_s : float
        Buckets of that width that end before this time [s] are not asked for: nothing is repeated for them.
    """
    steps = np.diff(time_s)
    seldom = (steps > every_s) & (steps <= longest_s)
    if not seldom.any():
        return time_s, dict(values)
    more = np.append(np.where(seldom, np.ceil(steps / every_s), 1.0), 1.0)
    skipped = np.clip(np.floor((since_s - time_s) / every_s), 0.0, more - 1.0).astype(np.int64)
    times = more.astype(np.int64) - skipped
    rows = np.repeat(np.arange(len(time_s)), times)
    nth = np.arange(len(rows)) - np.repeat(np.cumsum(times) - times - skipped, times)
    return time_s[rows] + nth * every_s, {name: one[rows] for name, one in values.items()}
