"""Loading and unloading curve from measured points: what tables begin with, and the identification too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import isotonic_regression

from bufferstand.foundation import BadInput
from bufferstand.model.curves import Curves

Floats = NDArray[np.float64]

_LEAST_POINTS = 5
_TRANSITIONS = 3.0


@dataclass(frozen=True)
class MeasuredCurves:
    """Curves from a measured loop, and how they were smoothed.

    Attributes
    ----------
    curves : Curves
    smoothing : str
        In words, for whoever publishes them.
    residual_kN : float
        Root mean square of the measured loading branch about its curve.
    """

    curves: Curves
    smoothing: str
    residual_kN: float


def measured_curves(
    stroke_mm: ArrayLike,
    force_kN: ArrayLike,
    *,
    points: int = 22,
    transition_length_mm: float = 4.0,
    contact_ramp_mm: float = 0.0,
) -> MeasuredCurves:
    """Return the curves of one slow loop: from contact to a largest stroke and back.

    The unloading branch begins with the transition from one curve to the other, which is no part of F_u: over
    three transition lengths below the largest stroke F_u keeps the share of F_l that it has there. Better
    curves come from the identification, which finds F_u and the transition together.

    Parameters
    ----------
    stroke_mm, force_kN : array_like, shape (N,)
        One loop, compression positive, stroke 0 at contact.
    points : int
        Points of the tables, evenly over the stroke.
    transition_length_mm : float
        L of k_t = max(k_l, k_u) + (F_l - F_u) / L.
    contact_ramp_mm : float
        As in :class:`bufferstand.model.curves.Curves`.

    Raises
    ------
    BadInput
        If the loop is too short, or leaves part of the stroke without samples.
    """
    x, F = np.asarray(stroke_mm, dtype=np.float64), np.asarray(force_kN, dtype=np.float64)
    top = int(np.argmax(x)) if x.size else 0
    if x.ndim != 1 or x.shape != F.shape or top < _LEAST_POINTS or x.size - top < _LEAST_POINTS:
        raise BadInput("a loop needs a loading and an unloading branch of five samples or more")
    end = float(x[top])
    knots = np.linspace(0.0, end, points)
    width = 0.75 * end / (points - 1)
    loading = branch_at(knots, x[: top + 1], F[: top + 1], width)
    below = end - min(_TRANSITIONS * transition_length_mm, 0.5 * end)
    down = x[top:] <= below + width
    unloading = branch_at(knots, x[top:][down], F[top:][down], width)
    last = int(np.searchsorted(knots, below, side="right")) - 1
    share = unloading[last] / loading[last] if loading[last] > 0.0 else 1.0
    unloading[last + 1 :] = np.maximum(loading[last + 1 :] * share, unloading[last])
    curves = Curves(
        stroke_mm=tuple(knots.tolist()),
        loading_kN=tuple(np.maximum(loading, 0.0).tolist()),
        unloading_kN=tuple(np.clip(np.minimum(unloading, loading), 0.0, None).tolist()),
        transition_length_mm=transition_length_mm,
        contact_ramp_mm=contact_ramp_mm,
    )
    measured = x[: top + 1] >= max(contact_ramp_mm, 0.0)
    rest = F[: top + 1][measured] - curves.loading(np.clip(x[: top + 1][measured], 0.0, end))
    return MeasuredCurves(
        curves,
        f"straight lines over ±{width:.2g} mm about each of {points} points (tricube weights), made "
        "monotone by isotonic regression, joined by monotone cubics (PCHIP); unloading curve extended by its "
        f"share of the loading curve over the last {end - below:.3g} mm",
        float(np.sqrt(np.mean(rest**2))),
    )


def branch_at(knots_mm: Floats, stroke_mm: Floats, force_kN: Floats, width_mm: float) -> Floats:
    """Return a branch's force [kN] at strokes: local straight lines, then the nearest monotone values.

    Parameters
    ----------
    knots_mm : array, shape (n,)
    stroke_mm, force_kN : array, shape (m,)
        Samples of one branch, or of many like it.
    width_mm : float
        Samples count down to nothing at this distance from a knot; where there are too few, at twice, four
        times … of it.

    Raises
    ------
    BadInput
        If there are fewer than five samples.
    """
    if stroke_mm.size < _LEAST_POINTS:
        raise BadInput("a branch of a loop has fewer than five samples")
    values = np.empty(knots_mm.size)
    for at, knot in enumerate(knots_mm.tolist()):
        away = np.abs(stroke_mm - knot)
        reach = width_mm
        while np.count_nonzero(away < reach) < _LEAST_POINTS:
            reach *= 2.0
        near = away < reach
        weight = (1.0 - (away[near] / reach) ** 3) ** 1.5
        columns = np.stack([np.ones(weight.size), stroke_mm[near] - knot], axis=1) * weight[:, None]
        values[at] = np.linalg.lstsq(columns, force_kN[near] * weight, rcond=None)[0][0]
    return np.asarray(isotonic_regression(values).x, dtype=np.float64)
