"""Where a stroke turns, from the samples about its crest: round or flat, noisy or not.

A servo valve crosses its overlap when the piston turns, so that crests are flat for up to 60 ms. A series of
a few harmonics has not the height of such a crest, and the greatest sample of a noisy one overreaches. So a
crest is fitted: a parabola up, a flat part that may be none, another parabola down,

    y = h − a min(t − t₁, 0)² − b max(t − t₂, 0)²,  t₁ ≤ t₂,

over windows of several heights; of those whose misfit is noise, the surest counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bufferstand.protocols.prediction import Sine

Floats = NDArray[np.float64]

LEVELS, SPARSE_LEVELS = (0.005, 0.01, 0.02, 0.05, 0.1), (0.2, 0.3)
"""Heights of the windows, as shares of the range: samples that are so much below the crest. Over the greater
ones a sine is no parabola: they are for where the others have too few samples."""
MOST_POINTS, LEAST_POINTS = 40, 7
"""Samples of a window are averaged in groups down to so many points; five unknowns need more than these."""
MISFIT, MISFIT_DEVIATIONS = 0.05, 2.0
"""A misfit is noise where it is more by no more than this share, and so many standard deviations."""
FORCE_SHARE = 0.05
"""The force at a turn is read from the samples so near to it (share of the range) that lead to it."""
LEAST_FORCE_SAMPLES = 6
SMOOTHED_SHARE = 0.02
"""The crest is looked for in means over so much of the samples, so that noise does not choose it."""
EDGE_SHARE = 0.02
"""A crest of which less than this height (share of the range) is on record on one side is not whole."""
_PLACES = 29
"""Corners that are tried, evenly from −0.8 to 0.8 of half the window."""


@dataclass(frozen=True)
class StrokeTurn:
    """A turn.

    Parameters
    ----------
    time_s : float
        When the stroke arrives.
    height : float
        Of the crest.
    u : float
        Its standard uncertainty, from the misfit.
    begin_s : float
        Where the window begins.
    """

    time_s: float
    height: float
    u: float
    begin_s: float


@dataclass(frozen=True)
class StrokeTurns:
    """Both turns of a period; the lower one is a crest of the values' opposites."""

    upper: StrokeTurn
    lower: StrokeTurn

    @classmethod
    def of(cls, time_s: Floats, values: Floats) -> StrokeTurns | None:
        """Return the turns of samples, shape (n,) each; None where one is not whole."""
        upper, lower = upper_crest(time_s, values), upper_crest(time_s, -values)
        return None if upper is None or lower is None else cls(upper, lower)

    @property
    def sine(self) -> Sine:
        """Mean and amplitude: half the sum and half the difference of the turns."""
        return Sine.between(-self.lower.height, self.upper.height)

    @property
    def u_mm(self) -> float:
        """Standard uncertainty of mean and amplitude alike [mm]."""
        return 0.5 * math.hypot(self.upper.u, self.lower.u)

    def forces(self, time_s: Floats, stroke: Floats, force: Floats) -> tuple[float, float]:
        """Return the forces at the lower and at the upper turn [kN]."""
        near_mm = FORCE_SHARE * 2.0 * self.sine.amplitude_mm
        lower_kN = -_arriving(time_s, -stroke, -force, self.lower, near_mm)
        return lower_kN, _arriving(time_s, stroke, force, self.upper, near_mm)


def noise_of(values: Floats) -> float:
    """Return the standard deviation of a channel's white noise, by its third differences.

    A motion of 50 samples a cycle has none to speak of, and the corners of its crests are few. Their variance
    is 1 + 9 + 9 + 1 times that of a sample.
    """
    return float(np.median(np.abs(np.diff(values, 3)))) / (0.6745 * math.sqrt(20.0))


def upper_crest(time_s: Floats, values: Floats) -> StrokeTurn | None:
    """Return the upper turn of a period; the lower one is that of ``-values``.

    Parameters
    ----------
    time_s, values : NDArray, shape (n,)
        Samples at even steps, about one period.

    Returns
    -------
    Crest or None
        None where the crest is not whole, or has too few samples.
    """
    if len(values) < 2 * LEAST_POINTS:
        return None
    sigma, spread = noise_of(values), float(np.ptp(values))
    smooth = _means(values, max(1, round(SMOOTHED_SHARE * len(values))))
    top = int(np.argmax(smooth))
    height = float(smooth[top])
    whole = _window(smooth, top, height - EDGE_SHARE * spread)
    if whole[0] == 0 or whole[1] == len(values):
        return None
    fits: list[tuple[StrokeTurn, float, int]] = []
    for level in (*LEVELS, *SPARSE_LEVELS):
        if level in SPARSE_LEVELS and fits:
            break
        first, last = _window(smooth, top, height - level * spread - sigma)
        if last - first >= LEAST_POINTS:
            fits += _fitted(time_s[first:last], values[first:last])
    if not fits:
        return None
    least = max(sigma, min(misfit for _, misfit, _ in fits))

    def is_noise(misfit: float, free: int) -> bool:
        return misfit <= least * (1.0 + MISFIT + MISFIT_DEVIATIONS / math.sqrt(2.0 * free))

    # The misfit of few points may be small by chance: no crest is surer than the noise allows.
    good = [
        replace(crest, u=crest.u * least / misfit) if misfit < least else crest
        for crest, misfit, free in fits
        if is_noise(misfit, free)
    ]
    return min(good, key=lambda one: one.u)


def _means(values: Floats, wide: int) -> Floats:
    """Return running means; beyond the ends, the end stands for what is not on record."""
    padded = np.pad(values, (wide // 2, wide - 1 - wide // 2), mode="edge")
    return np.convolve(padded, np.full(wide, 1.0 / wide), mode="valid")


def _window(smooth: Floats, top: int, level: float) -> tuple[int, int]:
    """Return first and last + 1 of the samples about the top that are above a level without a break."""
    below = np.flatnonzero(smooth < level)
    place = int(np.searchsorted(below, top))
    first = int(below[place - 1]) + 1 if place > 0 else 0
    return first, int(below[place]) if place < len(below) else len(smooth)


@dataclass(frozen=True)
class _Shapes:
    """Every pair of corners for a number of points, solved: shapes are (pairs, …)."""

    arrive: Floats
    solve: Floats
    """Heights, then bends up, then bends down, are this times the points, (3 pairs, points)."""
    span: Floats
    """Orthonormal rows of what each shape can be, (3 pairs, points)."""
    gain: Floats
    """Standard deviation of the height over that of a point, the corners unknown as well."""


@lru_cache(maxsize=MOST_POINTS)
def _shapes(points: int) -> _Shapes:
    z = np.linspace(-1.0, 1.0, points)
    places = np.linspace(-0.8, 0.8, _PLACES)
    arrive, leave = (places[index] for index in np.triu_indices(_PLACES))
    up, down = np.minimum(z - arrive[:, None], 0.0), np.maximum(z - leave[:, None], 0.0)
    # A pair that leaves fewer than two points on a side shows no bend there.
    seen = ((up < 0.0).sum(axis=1) >= 2) & ((down > 0.0).sum(axis=1) >= 2)
    arrive, up, down = arrive[seen], up[seen], down[seen]
    one = np.ones_like(up)
    matrix = np.stack((one, -(up**2), -(down**2)), axis=2)
    # Where the corners are changes the height's uncertainty; how a column is scaled does not.
    gain = np.linalg.norm(np.linalg.pinv(np.stack((one, up**2, down**2, up, down), axis=2))[:, 0], axis=1)
    solve, span = np.linalg.pinv(matrix).transpose(1, 0, 2), np.linalg.qr(matrix)[0].transpose(2, 0, 1)
    rows = (3 * len(arrive), points)
    return _Shapes(
        arrive, np.ascontiguousarray(solve).reshape(rows), np.ascontiguousarray(span).reshape(rows), gain
    )


def prepare() -> None:
    """Solve all shapes now: it takes a third of a second, for which no running motion should wait."""
    for points in range(LEAST_POINTS, MOST_POINTS + 1):
        _shapes(points)


def _fitted(time_s: Floats, values: Floats) -> list[tuple[StrokeTurn, float, int]]:
    """Return the crest of a window, the misfit of one sample and its freedoms; nothing where none fits."""
    group = -(-len(values) // MOST_POINTS)
    points = len(values) // group
    if points < LEAST_POINTS:
        return []
    used = slice((len(values) - points * group) // 2, (len(values) - points * group) // 2 + points * group)
    time, value = (one[used].reshape(points, group).mean(axis=1) for one in (time_s, values))
    about = float(value.mean())
    value = value - about
    shapes = _shapes(points)
    height, rise, fall = (shapes.solve @ value).reshape(3, -1)
    part = (shapes.span @ value).reshape(3, -1)
    missed = np.where((rise > 0.0) & (fall > 0.0), float(value @ value) - (part**2).sum(axis=0), np.inf)
    best = int(np.argmin(missed))
    if not math.isfinite(missed[best]):
        return []
    free = points - 5
    misfit = math.sqrt(max(1e-24, float(missed[best])) / free)
    middle, half = 0.5 * (time[0] + time[-1]), 0.5 * (time[-1] - time[0])
    crest = StrokeTurn(
        float(middle + half * shapes.arrive[best]),
        about + float(height[best]),
        misfit * float(shapes.gain[best]),
        float(time_s[0]),
    )
    return [(crest, misfit * math.sqrt(group), free)]


def _arriving(time_s: Floats, stroke: Floats, force: Floats, crest: StrokeTurn, near_mm: float) -> float:
    """Return the force with which a crest is reached: behind it the force of a specimen with friction falls.

    Near a crest the stroke is a parabola of time, and elastic and viscous forces are one with it.
    """
    before = time_s <= crest.time_s
    far = np.flatnonzero(before & (stroke < crest.height - near_mm))
    first = int(far[-1]) + 1 if len(far) else 0
    last = max(int(np.count_nonzero(before)), first + 1)
    if last - first < LEAST_FORCE_SAMPLES:
        return float(np.interp(crest.time_s, time_s, force))
    since = time_s[first:last] - crest.time_s
    return float(np.polynomial.polynomial.polyfit(since, force[first:last], 2)[0])
