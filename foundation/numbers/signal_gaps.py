"""The step of time from which on a signal counts as having a hole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation.numbers.quantiles import median

HOLE_S, HOLE_PERIODS = 0.1, 4.0
"""A signal without a sample for so long [s], and so many of its own periods, has a hole."""


def hole_from_s(time_s: NDArray[np.float64]) -> float:
    """Return which time from one sample to the next is a hole, where it is longer [s].

    Parameters
    ----------
    time_s : NDArray[float64]
        Two instants of samples at least, rising, shape (n,) [s].
    """
    return max(HOLE_S, HOLE_PERIODS * median(np.diff(time_s)))
