"""Records that are written by event: a sample whenever stroke or force has changed by so much.

Such a logger writes nothing while nothing changes. Its steps of time differ as much as the speed does; what
changes from sample to sample does not. Told from that, a long step has lost nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

_LEAST_SAMPLES = 32
_WIDE_TIME = 3.0
"""Steps of time differ by event: what 99 % stay below is this many times what 2 % do at least …"""
_APART = (0.02, 0.99)
_BEAT = 0.9
"""Steps of nearly the longest (this share of it) may be those of a logger that writes now and then anyway."""
_ALIKE = (0.05, 0.98)
_NARROW_CHANGE = 0.4
"""… and the changes do not: all but 5 % are no less than this share of that which 98 % stay below."""
_LARGER = 1.6
"""A change this many times the usual one was not written when it should have been."""


def event_changes(time_s: FloatArray, stroke_mm: FloatArray, force_kN: FloatArray) -> FloatArray | None:
    """Return the change of each step as a share of that at which the logger writes; None where it does not.

    Parameters
    ----------
    time_s, stroke_mm, force_kN : arrays, shape (N,)

    Returns
    -------
    array, shape (N - 1,), or None
        The larger of the changes of stroke and force, each over its own usual one.
    """
    if time_s.size < _LEAST_SAMPLES:
        return None
    step = np.diff(time_s)
    written = step < _BEAT * float(np.max(step))
    if np.count_nonzero(written) < _LEAST_SAMPLES:
        return None
    short, long = np.quantile(step[written], _APART)
    if long < _WIDE_TIME * short:
        return None
    shares = []
    for values in (stroke_mm, force_kN):
        change = np.abs(np.diff(values))
        most = float(np.quantile(change, _ALIKE[1]))
        shares.append(change / most if most > 0.0 else np.zeros_like(change))
    change = np.maximum(*shares)
    return change if float(np.quantile(change[written], _ALIKE[0])) >= _NARROW_CHANGE else None


def lost_between(changes: FloatArray) -> IndexArray:
    """Return the samples before which more changed than an event (:func:`event_changes`)."""
    return np.asarray(np.flatnonzero(changes > _LARGER) + 1, dtype=np.intp)
