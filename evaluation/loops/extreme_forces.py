"""Least and largest force of a cycle: those at its turning points, or one in between that is beyond them.

The largest of noisy readings overreaches, and a polynomial beside a corner rings. So a force inside a branch
counts only where no polynomial rings beyond the samples, and is read there anew, over as many samples as are
one curve.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist

import numpy as np

from bufferstand.evaluation.facts import ExtremeReading
from bufferstand.evaluation.loops.branch_ends import MOST_POINTS, Windows
from bufferstand.evaluation.loops.end_fits import MODELS, PEAK, Choice, choose, fit
from bufferstand.evaluation.loops.forces_at_ends import MOST_ASKED, EndForces
from bufferstand.evaluation.numerics import FloatArray, IndexArray, smoothed

FORCE_WINDOW = 0.01
"""Where an extreme is: maximum of a local parabola over this share of a branch's samples (at least 5)."""
_LEAST_WINDOW = 5
_NEAR_LARGEST = 3.0
"""Readings within so many standard deviations of the largest may be the largest because of their noise."""
_SURELY = 6.0
"""Beside a turning point a reading is beyond the force there by so many standard deviations."""
_SURELY_SHARE = 0.002
"""… and by this share of how far the forces at turning points lie apart: as far as a fit there may be off."""
_PARABOLA_GAIN = 1.5
"""Of a parabola's value in its middle: noise over the square root of its samples times this."""


@dataclass(frozen=True, eq=False)
class Inside:
    """Forces inside of branches, a row each.

    Attributes
    ----------
    force_kN : array, shape (B, P)
    count, group, first, cycle : arrays, shape (B,)
        Points of each row, samples of each point, the first sample, row of the cycle that it belongs to.
    """

    force_kN: FloatArray
    count: IndexArray
    group: IndexArray
    first: IndexArray
    cycle: IndexArray

    @cached_property
    def curves(self) -> list[tuple[IndexArray, int, FloatArray]]:
        """Rows of equal windows, half of these, and the values of a moving parabola [kN]."""
        window = _window(self.count)
        window[self.count < window] = 0
        found = []
        for size in np.unique(window[window > 0]).tolist():
            rows = np.flatnonzero(window == size)
            force = self.force_kN[rows, : int(np.max(self.count[rows]))]
            found.append((rows, size // 2, smoothed(force, self.count[rows], size, 2)))
        return found

    def rows(self, chosen: IndexArray) -> Inside:
        """Return some of them."""
        return Inside(
            self.force_kN[chosen],
            self.count[chosen],
            self.group[chosen],
            self.first[chosen],
            self.cycle[chosen],
        )


@dataclass(frozen=True, eq=False)
class _Inner:
    """Forces between turning points as they were read: ``value`` (B,) about a ``peak`` of each row."""

    part: Inside
    sign: float
    peak: FloatArray
    value: FloatArray
    gain: FloatArray
    choice: Choice
    when_s: FloatArray
    sigma_kN: float

    def reading(self, k: int) -> ExtremeReading:
        """Return how that of one row was read."""
        force = self.sign * self.part.force_kN[k, : self.part.count[k]]
        point_kN = self.sigma_kN / float(np.sqrt(self.part.group[k]))
        base = max(_LEAST_WINDOW, FORCE_WINDOW * int(self.part.count[k]))
        base_kN = point_kN * _PARABOLA_GAIN / float(np.sqrt(base))
        near = np.count_nonzero(force >= self.peak[k] - _NEAR_LARGEST * base_kN - point_kN)
        # The place was chosen by its noise, which the wider window has the less of.
        over_kN = overreach(max(1.0, near / (0.25 * base))) * base_kN
        over_kN *= min(1.0, base / int(self.choice.points[k]))
        gain = float(self.gain[k] / np.sqrt(self.part.group[k]))
        return ExtremeReading(-1, float(self.when_s[k]), gain, float(self.choice.doubt_kN[k]), over_kN)


@dataclass(frozen=True, eq=False)
class ForceExtremes:
    """Largest (or least) forces of cycles, shape (R,) [kN], and how each was read.

    ``place``: 0, 1, 2 for the lower turning point, the upper one and the last one, -1 for in between.
    """

    force_kN: FloatArray
    place: IndexArray
    inner: Mapping[int, tuple[_Inner, int]]

    def reading(self, row: int) -> ExtremeReading:
        """Return how that of one cycle was read."""
        place = int(self.place[row])
        if place >= 0:
            return ExtremeReading(place)
        inner, at = self.inner[row]
        return inner.reading(at)


def force_extremes(
    time_s: FloatArray,
    ends: Sequence[EndForces],
    parts: Sequence[Inside],
    sigma_kN: float,
    sign: float,
    most_asked: int = MOST_ASKED,
) -> ForceExtremes:
    """Return the largest force of each cycle, or with ``sign`` -1 the least.

    Parameters
    ----------
    time_s : array, shape (N,)
        Of the record.
    ends : sequence of EndForces
        At the lower turning point, the upper one and the last one of each cycle.
    parts : sequence of Inside
        What lies between them.
    sigma_kN : float
        Noise of a sample.
    sign : float
    most_asked : int
        Of more branches so many, evenly spread, are asked for window and terms.
    """
    at_ends = sign * np.stack([end.force_kN for end in ends])
    most, place = np.max(at_ends, axis=0), np.argmax(at_ends, axis=0)
    inner: dict[int, tuple[_Inner, int]] = {}
    beyond_kN = np.maximum(_SURELY * sigma_kN, _SURELY_SHARE * np.ptp(at_ends, axis=0))
    for part in parts:
        for rows, peak, at in _peaks(part, sign, most[part.cycle], beyond_kN[part.cycle]):
            beyond = np.flatnonzero(peak > most[part.cycle[rows]])
            if not beyond.size:
                continue
            own = part.rows(rows[beyond])
            found = _read(own, time_s, (at[beyond], peak[beyond]), sigma_kN, sign, most_asked)
            value = found.value
            for k in np.flatnonzero(value > most[own.cycle]).tolist():
                cycle = int(own.cycle[k])
                if value[k] > most[cycle]:
                    most[cycle], place[cycle], inner[cycle] = value[k], -1, (found, k)
    return ForceExtremes(sign * most, place, inner)


def _peaks(
    part: Inside, sign: float, at_ends: FloatArray, beyond_kN: FloatArray
) -> Iterator[tuple[IndexArray, FloatArray, IndexArray]]:
    """Yield rows of a part, the largest value of a moving parabola inside each, and where that is.

    Within half a window of a branch's ends only a point counts that is by ``beyond_kN`` (B,) further than the
    rest of the branch, and than ``at_ends`` (B,), the force at the turning points.
    """
    for rows, half, smooth_kN in part.curves:
        count = part.count[rows]
        force, curve = sign * part.force_kN[rows, : smooth_kN.shape[1]], sign * smooth_kN
        # The first and last half window are read off the end of a polynomial, which is no better than the
        # force at the turning point itself. Where samples are few a force that leads has its extreme there.
        order = np.arange(curve.shape[1])
        beside = (order < half) | ((order >= (count - half)[:, None]) & (order < count[:, None]))
        curve[beside | (order >= count[:, None])] = -np.inf
        rest = np.maximum(np.max(curve, axis=1), at_ends[rows])
        surely = beside & (force > (rest + beyond_kN[rows])[:, None])
        curve[surely] = force[surely]
        at = np.argmax(curve, axis=1)
        lines = np.arange(rows.size)
        about = np.clip(at[:, None] + np.arange(-half, half + 1), 0, (count - 1)[:, None])
        # Beside a corner a parabola rings beyond every sample.
        yield rows, np.minimum(curve[lines, at], np.max(force[lines[:, None], about], axis=1)), at


def _window(count: IndexArray) -> IndexArray:
    """Return over how many points the moving parabola of a branch of so many runs: an odd number."""
    return np.maximum(_LEAST_WINDOW, 2 * (0.5 * FORCE_WINDOW * count).astype(np.intp) + 1)


def _read(
    part: Inside,
    time_s: FloatArray,
    peaks: tuple[IndexArray, FloatArray],
    sigma_kN: float,
    sign: float,
    most_asked: int,
) -> _Inner:
    """Return the forces about places of rows, by the surest fit, and how they were read."""
    at, peak = peaks
    scale = min(MOST_POINTS, int(np.max(part.count)))
    asked = np.unique(np.linspace(0, at.size - 1, min(at.size, most_asked)).round().astype(np.intp))
    windows = _windows_about(part.rows(asked), at[asked], sign, scale, scale)
    choice = choose(windows, sigma_kN, 0.0, PEAK)
    if at.size > asked.size:
        choice = choice.rows(np.searchsorted(0.5 * (asked[1:] + asked[:-1]), np.arange(at.size)))
        windows = _windows_about(part, at, sign, scale, int(np.max(choice.points)))
    value, gain = _fitted(windows, choice, scale)
    half = _window(part.count) // 2
    beside = (at < half) | (at >= part.count - half)
    # A summit with points on one side only is a guess: the reading itself is the largest that is on record.
    value[beside] = np.minimum(value, peak)[beside]
    when_s = time_s[np.minimum(part.first + part.group * at + part.group // 2, time_s.size - 1)]
    return _Inner(part, sign, peak, value, gain, choice, when_s, sigma_kN)


def _windows_about(part: Inside, at: IndexArray, sign: float, scale: int, most: int) -> Windows:
    """Return the ``most`` points about places of rows, from the nearest one outwards to both sides.

    ``scale``: how many points away is 1.
    """
    steps = np.arange(1, scale + 1)
    away = np.concatenate(([0], np.stack((-steps, steps), axis=1).ravel()))
    place = at[:, None] + away[:most]
    there = (place >= 0) & (place < part.count[:, None])
    count = np.full(at.size, most)
    along = np.repeat(away[None, :most] / scale, at.size, axis=0)
    # What lies beyond the branch is no point: those further away to the other side move up.
    if (rows := np.flatnonzero(~there.all(axis=1))).size:
        every = at[rows, None] + away
        known = (every >= 0) & (every < part.count[rows, None])
        rank = np.cumsum(known, axis=1) - 1
        line, column = np.nonzero(known & (rank < most))
        to = rows[line], rank[line, column]
        count[rows] = np.minimum(rank[:, -1] + 1, most)
        there[rows] = np.arange(most) < count[rows, None]
        place[rows], along[rows] = 0, 0.0
        place[to], along[to] = every[line, column], away[column] / scale
    force = np.where(there, sign * np.take_along_axis(part.force_kN, place, axis=1), 0.0)
    terms = np.empty((4, *along.shape))
    terms[0], terms[1], terms[2] = there, along, 0.0
    np.multiply(along, along, out=terms[3])
    return Windows(force, terms, count, part.group, np.full(at.size, np.inf))


def _fitted(windows: Windows, choice: Choice, scale: int) -> tuple[FloatArray, FloatArray]:
    """Return the values that were chosen, and their gain of a point's noise.

    A parabola's summit counts, where it is no further away than the next point; ``scale`` of them are 1.
    """
    number = choice.points.size
    value, gain = np.zeros((2, number))
    for model, terms in enumerate(MODELS):
        rows = np.flatnonzero(choice.model == model)
        if not rows.size:
            continue
        own = windows if rows.size == number else windows.rows(rows)
        found = fit(own, choice.points[rows, None], terms)
        value[rows], gain[rows] = found.value[:, 0], found.gain[:, 0]
        if 3 in terms:
            slope, bend = found.slope[:, 0] / scale, found.bend[:, 0] / scale**2
            step = np.clip(slope / np.where(bend < 0.0, -2.0 * bend, np.inf), -1.0, 1.0)
            value[rows] += slope * step + bend * step**2
    return value, gain


def overreach(readings: float) -> float:
    """Return the mean of the largest of so many standard normal deviates (Blom's formula)."""
    return NormalDist().inv_cdf((readings - 0.375) / (readings + 0.25))
