"""The sensors of the specimen's stroke, one to four of them: what they say together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

MOST_STROKES = 4
"""Draw wires, or other sensors of the stroke, that a stand can have."""
STROKE_CHANNELS = tuple(f"stroke_{number}" for number in range(1, MOST_STROKES + 1))
"""The channels that measure the specimen's stroke, which is the mean of those there are."""


def mean_of_strokes(values: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the stroke: the mean of its sensors, or what the only one reads [mm].

    Parameters
    ----------
    values : sequence of NDArray, shape (n,) each
        What each sensor reads [mm]; one at least.
    """
    if len(values) == 1:
        return values[0]
    total = values[0] + values[1]
    for further in values[2:]:
        total += further
    total /= len(values)
    return total


def tilt_of_strokes(values: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return by how much sensors differ: of two the first less the second, of more the largest difference.

    Parameters
    ----------
    values : sequence of NDArray, shape (n,) each
        What each sensor reads [mm]; two at least.
    """
    if len(values) == 2:
        return np.asarray(values[0] - values[1], dtype=np.float64)
    return np.asarray(np.maximum.reduce(values) - np.minimum.reduce(values), dtype=np.float64)


def farthest_strokes(values: Mapping[str, float]) -> tuple[str, str, float] | None:
    """Return which two sensors differ most, and by how much; None where there are not two.

    Parameters
    ----------
    values : mapping of str to float
        What channels read [mm]; those that are no sensor of the stroke are passed over.

    Returns
    -------
    (str, str, float) or None
        Of two sensors the first, the second and their difference; of more the greatest and the least [mm].
    """
    there = [name for name in STROKE_CHANNELS if name in values]
    if len(there) < 2:
        return None
    one, two = (
        there if len(there) == 2 else (max(there, key=values.__getitem__), min(there, key=values.__getitem__))
    )
    return one, two, values[one] - values[two]
