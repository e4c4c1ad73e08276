"""The curves beyond the runs: from the largest recorded stroke to the specimen's full stroke.

By their own shape, F_l goes on as the power F_l(x_e) (x / x_e)ⁿ of the stroke, with n = d ln F_l / d ln x at
the last recorded stroke x_e. A spring that stiffens ever more (F_l convex), but whose relative stiffness
k_l / F_l does not grow any more (ln F_l concave), lies between its tangent and the exponential of the same
force and slope; for n >= 1 so does the power. These two are the stated bounds, widened by as much as n may be
wrong. Springs of elastomer, rubber and rings are such springs; one that runs onto an inner stop is not, and
no run that ends before it can tell.

F_u keeps its share of F_l.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.curves import Curves
from bufferstand.model.identified_range import Continuation

Floats = NDArray[np.float64]

LEAST_MM = 0.1
"""Runs that end nearer to the full stroke than this have reached it."""
_STEP_MM = 2.0
_WINDOW_SHARE = 0.6
"""n comes from the knots above this share of the last recorded stroke, four at least."""
_LEAST_KNOTS = 4
_LEAST_DEVIATION = 1e-4
"""Of a knot's ln F_l: no figure of a force is better."""
_COVERAGE = 2.0


@dataclass(frozen=True)
class Continued:
    """Curves to the full stroke.

    Attributes
    ----------
    curves : Curves
    kind : Continuation
        What the part beyond the runs rests on.
    loading_at_end_kN : tuple of float
        Bounds of F_l at the end.
    """

    curves: Curves
    kind: Continuation
    loading_at_end_kN: tuple[float, float]


def continued(
    curves: Curves,
    deviation_kN: Floats,
    full_stroke_mm: float,
    points: Sequence[tuple[float, float]] = (),
    margin: float = 1.15,
) -> Continued | None:
    """Return curves that go on to the full stroke; None if they reach it by themselves.

    Parameters
    ----------
    curves : Curves
        As identified, with the length rule for the transition.
    deviation_kN : array, shape (n,)
        Standard deviation of F_l at each of their strokes.
    full_stroke_mm : float
    points : sequence of (float, float)
        Stroke [mm] and force [kN] of the maker's loading curve; those beyond the last recorded stroke count.
    margin : float
        Factor by which the maker's curve and the spring may differ, either way.

    Raises
    ------
    BadInput
        If a point of the maker lies below the measured end of the loading curve.
    """
    end = curves.end_mm
    if full_stroke_mm - end < LEAST_MM:
        return None
    beyond = [point for point in points if end + LEAST_MM <= point[0] <= full_stroke_mm]
    for stroke, force in beyond:
        if force <= curves.loading_kN[-1]:
            raise BadInput(
                f"the maker's {force:g} kN at {stroke:g} mm lie below the {curves.loading_kN[-1]:.4g} kN "
                f"measured at {end:.1f} mm",
                place="catalogue.points",
                remedy="correct the points, or leave them out: then the curve goes on by its own shape",
            )
    exponent, half = _exponent(curves, deviation_kN)
    anchors = [(end, curves.loading_kN[-1]), *beyond]
    start, force = anchors[-1]
    rest = full_stroke_mm - start
    last = (
        np.linspace(start, full_stroke_mm, max(1, round(rest / _STEP_MM)) + 1)[1:]
        if rest > 0.0
        else np.empty(0)
    )
    strokes = np.concatenate([[x for x, _ in beyond], last])
    loading = np.concatenate([[F for _, F in beyond], force * _growth(last / start, exponent)])
    if beyond:
        low, high = max(loading[-1] / margin, curves.loading_kN[-1]), loading[-1] * margin
    else:
        low, high = _bounds(force, full_stroke_mm / end, exponent, half)
    share = curves.unloading_kN[-1] / curves.loading_kN[-1]
    return Continued(
        replace(
            curves,
            stroke_mm=(*curves.stroke_mm, *strokes.tolist()),
            loading_kN=(*curves.loading_kN, *loading.tolist()),
            unloading_kN=(*curves.unloading_kN, *(share * loading).tolist()),
        ),
        "catalogue" if beyond else "own-shape",
        (float(low), float(high)),
    )


def _exponent(curves: Curves, deviation_kN: Floats) -> tuple[float, float]:
    """Return n = d ln F_l / d ln x at the last stroke, and by how much it may be wrong.

    From two parabolas through the last knots: ln F_l over ln x, exact for powers, and over x, exact for
    exponentials. n is their mean; it may be wrong by half their difference plus twice its standard
    uncertainty.
    """
    x, F = np.array(curves.stroke_mm), np.array(curves.loading_kN)
    first = min(int(np.searchsorted(x, _WINDOW_SHARE * x[-1])), x.size - _LEAST_KNOTS)
    window = np.arange(max(first, 1), x.size)
    ratio, y = x[window] / x[-1], np.log(F[window])
    deviation = np.maximum(deviation_kN[window] / F[window], _LEAST_DEVIATION)
    (by_log, u_log), (by_stroke, u_stroke) = (
        _end_slope(u, y, deviation) for u in (np.log(ratio), ratio - 1.0)
    )
    half = 0.5 * abs(by_log - by_stroke) + _COVERAGE * max(u_log, u_stroke)
    return max(0.5 * (by_log + by_stroke), 0.0), half


def _end_slope(u: Floats, y: Floats, deviation: Floats) -> tuple[float, float]:
    """Return the slope at u = 0 of the weighted parabola y(u), and its standard deviation.

    A line where there are few points. Where it misses them by more than their deviations say, the slope's
    deviation grows by as much.
    """
    degree = 2 if u.size >= _LEAST_KNOTS else 1
    columns = np.vander(u, degree + 1, increasing=True) / deviation[:, None]
    found, *_ = np.linalg.lstsq(columns, y / deviation, rcond=None)
    missed = y / deviation - columns @ found
    spread = max(1.0, float(missed @ missed) / max(u.size - degree - 1, 1))
    return float(found[1]), float(np.sqrt(spread * np.linalg.pinv(columns.T @ columns)[1, 1]))


def _growth(ratio: Floats, exponent: float) -> Floats:
    """Return F_l(x) / F_l(x_e) for x / x_e: the power, or the tangent where that is above (n < 1)."""
    return np.asarray(np.maximum(ratio**exponent, 1.0 + exponent * (ratio - 1.0)), dtype=np.float64)


def _bounds(force_kN: float, ratio: float, exponent: float, half: float) -> tuple[float, float]:
    """Return the least and the largest F_l at the full stroke: tangent (or power), and exponential."""
    flat, steep = max(exponent - half, 0.0), exponent + half
    low = min(ratio**flat, 1.0 + flat * (ratio - 1.0))
    return force_kN * low, force_kN * float(np.exp(steep * (ratio - 1.0)))
