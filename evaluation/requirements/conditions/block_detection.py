"""Block contact: where the loading branch turns so steep that the spring has met its stop."""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.facts import Loop
from bufferstand.evaluation.numerics import FloatArray

_END, _BEFORE = 0.01, (0.10, 0.05)
"""Shares of the stroke: the end that is judged, and the part below the top that it is compared with."""
_LEAST_SAMPLES = 4


def block_contact(loop: Loop, slope_ratio: float) -> float | None:
    """Return the stroke at which block contact begins [mm], or None where there is none.

    There is block contact where the slope of the last 1 % of the stroke is more than ``slope_ratio`` times
    that between 10 and 5 % below the top, and times that of the secant. It begins where the slope, in steps
    of 1 % of the stroke, first stays above that.

    Parameters
    ----------
    loop : Loop
    slope_ratio : float
    """
    stroke, force = loop.stroke_mm[loop.loading], loop.force_kN[loop.loading]
    low, high = float(stroke[0]), float(stroke[-1])
    span = high - low
    before = _slope(stroke, force, high - _BEFORE[0] * span, high - _BEFORE[1] * span)
    if before is None:
        return None
    steep = slope_ratio * max(before, float(force[-1] - force[0]) / span)
    begins = None
    for step in range(1, round(_BEFORE[1] / _END) + 1):
        last = high - (step - 1) * _END * span
        slope = _slope(stroke, force, last - _END * span, last)
        if slope is None or slope <= steep:
            break
        begins = last - _END * span
    return begins


def _slope(stroke_mm: FloatArray, force_kN: FloatArray, first_mm: float, last_mm: float) -> float | None:
    """Return the slope of a line through a stretch; through its ends where too few samples are in it."""
    inside = (stroke_mm >= first_mm) & (stroke_mm <= last_mm)
    if last_mm <= first_mm:
        return None
    if np.count_nonzero(inside) < _LEAST_SAMPLES or np.ptp(stroke_mm[inside]) < 0.5 * (last_mm - first_mm):
        order = np.argsort(stroke_mm, kind="stable")
        first, last = np.interp([first_mm, last_mm], stroke_mm[order], force_kN[order])
        return float(last - first) / (last_mm - first_mm)
    return float(np.polynomial.polynomial.polyfit(stroke_mm[inside] - first_mm, force_kN[inside], 1)[1])
