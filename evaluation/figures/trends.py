"""Damping and stiffness over frequency with their linear fits (paper, Figs 8a and 8b)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.figures.plot import Fit, Floats, Plot, Points
from bufferstand.evaluation.wording import said

LEAST_FREEDOM = 3
"""A confidence band is drawn from so many degrees of freedom on: with fewer, its width says more of
Student's t (4.3 at two) than of the points."""
FREQUENCY_LABEL = said("Frequency of loading [Hz]")


@dataclass(frozen=True, eq=False)
class TrendSeries:
    """One quantity over frequency at otherwise equal conditions.

    Parameters
    ----------
    label : str
        The common conditions, as the legend says them.
    frequency_Hz, value, expanded_uncertainty : ndarray, shape (n,)
        The measured values; an unknown uncertainty is 0.
    slope_per_Hz, intercept : float or None
        The fitted line, None where there is none.
    band : tuple of ndarray, shape (m,), optional
        Frequencies [Hz], lower and upper limit of the fit's confidence band.
    confounded : bool
        Something else varies along with the frequency: the line is no effect of it, and gets no band.
    """

    label: str
    frequency_Hz: Floats
    value: Floats
    expanded_uncertainty: Floats
    slope_per_Hz: float | None = None
    intercept: float | None = None
    band: tuple[Floats, Floats, Floats] | None = None
    confounded: bool = False
    slope: str = ""
    """The slope ± U with its unit, as the legend says it; empty where its U is not known."""


def trend_plot(series: Sequence[TrendSeries], y_label: str) -> Plot:
    """Return a quantity over frequency (paper, Figs 8a and 8b)."""
    points = tuple(
        Points(one.label, one.frequency_Hz, one.value, one.expanded_uncertainty, tone)
        for tone, one in enumerate(series)
    )
    fits = tuple(fit for tone, one in enumerate(series) if (fit := _fit(one, tone)) is not None)
    reach = max((float(np.max(one.frequency_Hz)) for one in series), default=1.0)
    lows = [float(np.min(one.value - one.expanded_uncertainty)) for one in series]
    highs = [float(np.max(one.value + one.expanded_uncertainty)) for one in series]
    lows += [float(np.min(fit.y)) for fit in fits]
    highs += [float(np.max(fit.y)) for fit in fits]
    low, high = min(lows, default=0.0), max(highs, default=1.0)
    # A trend that is flat within a few per cent must look flat: the axis spans at least a fifth of the value.
    spare = max(0.15 * (high - low), 0.1 * abs(high))
    return Plot(
        FREQUENCY_LABEL,
        y_label,
        kind="trend",
        points=points,
        fits=fits,
        x_range=(0.0, 1.06 * reach),
        y_range=(max(0.0, low - spare) if low >= 0 else low - spare, high + spare),
        height_mm=56.0,
    )


def _fit(series: TrendSeries, tone: int) -> Fit | None:
    if series.slope_per_Hz is None or series.intercept is None:
        return None
    ends = np.array([np.min(series.frequency_Hz), np.max(series.frequency_Hz)])
    lower = upper = None
    x = ends
    freedom = series.frequency_Hz.size - 2
    if series.band is not None and freedom >= LEAST_FREEDOM and not series.confounded:
        x, lower, upper = series.band
    label = (
        said("linear fit, slope {slope}, ν = {freedom}", slope=series.slope, freedom=freedom)
        if series.slope
        else said("linear fit, ν = {freedom}", freedom=freedom)
    )
    return Fit(label, x, series.intercept + series.slope_per_Hz * x, lower, upper, tone, dash=tone + 1)
