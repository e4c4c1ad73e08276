"""Loop areas by an integration that shares nothing with the evaluation: the polygon through the samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def area_between(
    time_s: FloatArray, stroke: FloatArray, force: FloatArray, start_s: float, end_s: float
) -> float:
    """Return the area of the polygon through the samples between two moments, closed by its chord [J]."""
    inside = (time_s > start_s) & (time_s < end_s)
    x = np.concatenate(
        (
            [np.interp(start_s, time_s, stroke)],
            stroke[inside],
            [np.interp(end_s, time_s, stroke)],
        )
    )
    f = np.concatenate(
        ([np.interp(start_s, time_s, force)], force[inside], [np.interp(end_s, time_s, force)])
    )
    return float(np.trapezoid(np.append(f, f[0]), np.append(x, x[0])))
