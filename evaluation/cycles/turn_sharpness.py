"""How sharp a turn is that two flanks were fitted to: what its own samples near the tip say.

Flanks that meet in a tip fit a turn that a stand rounds over some milliseconds nearly as well: few samples of
a wide window are near the tip, and what they miss hides in the residual of all. So these few are asked. A
turn that is rounded over ±T (a parabola between flanks of mean steepness v) stays v T / 2 below the tip, and
(1 - |t| / T)² of that at a distance t. What the samples show of this shape is set against what it would be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import BoolArray, FloatArray

LONGEST_S = 0.1
"""No stand that moves at all needs more than twice so long to turn; longer is a dwell or a smooth motion."""
_STEPS = np.array([0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0])
"""Half-widths of a rounding that are tried, in steps of the samples."""
_NEAR = 17
_MOST_GROUP = 64
_SURE = 3.5
"""Standard deviations by which a turn that is none is told; some ten half-widths are tried."""
_MAY_BE = 2.0


@dataclass(frozen=True, eq=False)
class Tips:
    """Tips of flanks, shape (R,): moment, height (turned upwards by ``sign``), steepness of both flanks
    [mm/s], half their curvature [mm/s²], noise of a sample, and the height's standard uncertainty [mm].
    """

    time_s: FloatArray
    value: FloatArray
    sign: FloatArray
    rise: FloatArray
    fall: FloatArray
    bend: FloatArray
    sigma: FloatArray
    u: FloatArray


def sharpness(
    time_s: FloatArray, stroke_mm: FloatArray, tips: Tips
) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Say which turns are rounded for sure, and by how much the tip of each is too high, at least and most.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
        The record.
    tips : Tips

    Returns
    -------
    (array of bool, array, array)
        Shape (R,) each, the latter in mm. Turns of one kind (``sign``) are made by one stand: where together
        they are rounded for sure, all of them are.
    """
    points = _near_tips(time_s, stroke_mm, tips)
    half_s = _STEPS * points.step_s[:, None]
    weight = np.maximum(0.0, 1.0 - np.abs(points.away_s)[:, None, :] / half_s[:, :, None]) ** 2
    power = np.einsum("rkp,rkp->rk", weight, weight)
    seen = power > 0.0
    lacks = np.einsum("rkp,rp->rk", weight, points.missing_mm) / np.where(seen, power, 1.0)
    curved = tips.bend[:, None] * half_s**2
    u = np.where(seen, points.sigma_mm[:, None] / np.sqrt(np.where(seen, power, 1.0)), np.inf)
    # The sample nearest to the tip is on neither flank: what it misses them by has their uncertainty, too.
    # They are as long as their uncertainty says, 2 (σ / u)² samples; of what lies beyond they say nothing.
    u_tip = np.where(np.isfinite(tips.u) & (tips.u > 0.0), tips.u, points.sigma_mm)[:, None]
    nearest = np.where(seen, np.max(weight, axis=2) / np.where(seen, power, 1.0), 0.0)
    apart = np.hypot(u, nearest * u_tip)
    seen &= 2.0 * (points.sigma_mm[:, None] / np.maximum(u_tip, 1e-300)) ** 2 >= _STEPS
    with np.errstate(invalid="ignore"):
        share = np.where(seen, (lacks - curved) / np.where(apart > 0.0, apart, np.inf), 0.0)
    rounded = np.any(share > _SURE, axis=1)
    for kind in (-1.0, 1.0):
        alike = tips.sign == kind
        if np.count_nonzero(alike) > 1:
            together = np.sum(share[alike], axis=0) / np.sqrt(np.count_nonzero(alike))
            rounded |= alike & bool(np.any(together > _SURE))
    steep = 0.25 * (tips.rise + tips.fall)
    expected = steep[:, None] * half_s
    doubt = _MAY_BE * u + curved
    short = half_s <= LONGEST_S
    may_be = (expected <= np.maximum(lacks, 0.0) + doubt) & short
    most = np.max(np.where(may_be, expected, 0.0), axis=1)
    must_be = may_be & (expected >= lacks - doubt)
    least = np.min(np.where(must_be, expected, np.inf), axis=1)
    # Between two samples nothing is seen at all: it may be as blunt as they are.
    over = tips.value - points.highest_mm - _MAY_BE * points.sigma_mm
    most = np.maximum(most, np.clip(over, 0.0, LONGEST_S * steep))
    return rounded, np.where(np.isfinite(least), np.minimum(least, most), 0.0), most


@dataclass(frozen=True, eq=False)
class _Near:
    """Points about tips, shape (R, P): how far away, and by how much they miss the flanks; of each row (R,)
    the step between them, their noise, and the highest.
    """

    away_s: FloatArray
    missing_mm: FloatArray
    step_s: FloatArray
    sigma_mm: FloatArray
    highest_mm: FloatArray


def _near_tips(time_s: FloatArray, stroke_mm: FloatArray, tips: Tips) -> _Near:
    """Return what lies near tips: samples, or means of so many that the widest rounding that noise hides
    is not wider than they reach.
    """
    middle = np.searchsorted(time_s, tips.time_s)
    ends = np.clip(middle[:, None] + np.array([-2, 2]), 0, time_s.size - 1)
    step_s = np.diff(time_s[ends], axis=1)[:, 0] / np.maximum(np.diff(ends, axis=1)[:, 0], 1)
    # v T / 6 = 2 σ / √(2 T / step): so wide a rounding is told from none.
    steep = 0.5 * (tips.rise + tips.fall)
    told_s = (12.0 * tips.sigma * np.sqrt(0.5 * step_s) / np.where(steep > 0.0, steep, np.inf)) ** (2.0 / 3.0)
    wanted = np.median(2.0 * np.minimum(told_s, LONGEST_S) / step_s) / _STEPS[-1]
    group = int(np.clip(np.ceil(wanted), 1, _MOST_GROUP))
    order = np.arange(-_NEAR * group, (_NEAR + 1) * group)
    near = middle[:, None] + order
    there = (near >= 0) & (near < time_s.size)
    near = np.clip(near, 0, time_s.size - 1)
    away_s = time_s[near] - tips.time_s[:, None]
    value = stroke_mm[near] * tips.sign[:, None]
    flank = np.where(away_s < 0.0, tips.rise[:, None], tips.fall[:, None]) * np.abs(away_s)
    missing = np.where(there, tips.value[:, None] - flank - value, 0.0)
    away_s = np.where(there, away_s, np.inf)
    highest = np.max(np.where(there, value, -np.inf), axis=1)
    shape = (middle.size, 2 * _NEAR + 1, group)
    return _Near(
        away_s.reshape(shape).mean(axis=2),
        missing.reshape(shape).mean(axis=2),
        group * step_s,
        tips.sigma / np.sqrt(group),
        highest,
    )
