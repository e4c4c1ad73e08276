"""Moments of lower turns by like flanks: where the stroke crosses one level on its way down and up.

In a periodic motion the time between any two like points is the period. The crossings of a level where the
stroke is fastest are known best. They do not depend on how long a stand needs to reverse, nor on noise,
which may put the lowest sample anywhere along a flat turn. So the moment of a lower turn is the middle
between the crossings on both sides of it, with one level for all turns of a motion. To this is added the
median of the times by which the fitted turns are later than these middles. The fits then say where the turns
are, and the flanks how much time lies between them.

The level is the one about which the motion goes: a stroke whose amplitude grows or falls crosses it at the
same moments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.facts import TurningPoint
from bufferstand.evaluation.numerics import (
    BoolArray,
    FloatArray,
    IndexArray,
    WindowPoints,
    derivative,
    points_of,
    powers,
    solved,
    value_at,
)
from bufferstand.evaluation.record import Record
from bufferstand.foundation.numbers import median

_HALF_WIDTH = 0.25
"""Flanks are fitted within ± this share of the stroke about the level …"""
_ALIKE = 0.02
"""Flanks are alike that go between the same strokes, within this share of them."""
_INSIDE = 0.05
"""… which keeps this share of each stroke beside the turn away from its ends."""
_LEAST_NOISE = 6.0
"""That half-width is at least so many standard deviations of noise."""
_DEGREE, _LEAST_SAMPLES = 3, 8
_WORTH = 4.0 / 9.0
"""The middle of a parabola or cubic over n samples has the variance 9 σ² / 4 n."""
_LEAST_IN_ROW = 6
"""From so many turns in a row on their third differences tell how they scatter."""
_OF_THIRD_DIFFERENCE = 20.0
"""Σ c² of its weights 1, -3, 3, -1."""
_NORMAL_MEDIAN_SQUARE = 0.4549364
"""Half of all squares of normal deviates are below 0.455."""
_TOLD, _HALF_ALIKE = 4.0, 0.005
"""Half times of two turns differ by more than so many of their u, and by this share of them, or are one."""
_MOST_GROUPS = 16
"""Motions about so many levels are distinguished."""
_NEWTON_STEPS = 6


@dataclass(frozen=True, eq=False)
class LikeFlanks:
    """Lower turns by their flanks, shape (R,): which turns, the middle of the crossings, half the time
    between them, standard uncertainty of the middle [s], and of how many samples that is a mean; and the
    level and half-width of what was fitted [mm].
    """

    place: IndexArray
    middle_s: FloatArray
    half_s: FloatArray
    u_s: FloatArray
    samples: FloatArray
    level_mm: float
    half_width_mm: float


@dataclass(frozen=True, eq=False)
class Crossings:
    """Where flanks cross a level, shape (R,): moment, its standard uncertainty [s], and of how many samples.

    NaN where a flank is not on record, or too few of its samples are.
    """

    time_s: FloatArray
    u_s: FloatArray
    samples: FloatArray

    def rows(self, chosen: BoolArray | slice) -> Crossings:
        """Return some of the flanks."""
        return Crossings(self.time_s[chosen], self.u_s[chosen], self.samples[chosen])


def like_flanks(
    record: Record, turns: Sequence[TurningPoint], places: Sequence[int], sigma_mm: float
) -> list[LikeFlanks]:
    """Return lower turns by their flanks, those of one motion together.

    Parameters
    ----------
    record : Record
        Only its time, stroke and breaks are used; no flank is read across a break.
    turns : sequence of TurningPoint
        Lower and upper ones in turn.
    places : sequence of int
        Which of them are to be read: lower ones between two upper ones.
    sigma_mm : float
        Noise of the stroke.

    Returns
    -------
    list of LikeFlanks
        Turns whose flanks do not tell are in none.
    """
    left = np.array(places, dtype=np.intp)
    stroke = np.array([(turn.stroke_mm, turn.leave_mm) for turn in turns]).reshape(-1, 2)
    found = []
    for _ in range(_MOST_GROUPS):
        if not left.size:
            break
        tops = np.stack((stroke[left - 1, 1], stroke[left + 1, 0]))
        low = 0.5 * (stroke[left, 0] + stroke[left, 1])
        middle, height = 0.5 * low + 0.25 * np.sum(tops, axis=0), np.min(tops, axis=0) - low
        room = _INSIDE * (tops - low)
        # The middle of all may be that of no motion: then that of the first one.
        for of in (slice(None), slice(1)):
            level, half_width = median(middle[of]), _HALF_WIDTH * median(height[of])
            suits = level - half_width >= low + np.max(room, axis=0)
            suits &= np.all(level + half_width <= tops - room, axis=0)
            if suits.any():
                break
        else:
            suits[0] = True
            half_width = 0.0
        if half_width > _LEAST_NOISE * sigma_mm:
            found.append(_read(record, turns, left[suits], (level, half_width), sigma_mm))
        left = left[~suits]
    return [one for one in found if one.place.size]


def _read(
    record: Record,
    turns: Sequence[TurningPoint],
    places: IndexArray,
    window_mm: tuple[float, float],
    sigma_mm: float,
) -> LikeFlanks:
    """Return the turns of one motion by their flanks within a window of the stroke (level, half-width).

    Where a motion begins or ends, one flank of a turn is like those of the motion and the other is not: the
    moment is that of the one, by the half time of the next turn with both in that motion. Where neither is,
    as while an amplitude is still built up, the flanks say nothing of when it turns, and it is in none; nor
    is one between two motions of the same stroke (:func:`_between_motions`).
    """
    moments = np.array(
        [(turns[i - 1].leave_s, *_both(turns[i]), turns[i + 1].time_s) for i in places.tolist()]
    )
    begin_s, end_s = moments[:, ::2].T.ravel(), moments[:, 1::2].T.ravel()
    either = crossings(record, begin_s, end_s, window_mm, sigma_mm)
    down, up = (either.rows(slice(*side)) for side in ((None, places.size), (places.size, None)))
    good = np.isfinite(down.time_s) & np.isfinite(up.time_s)
    like = np.stack([_like(turns, places, side) for side in (-1, 1)])
    both = like[0] & like[1] & good
    good &= (like[0] | like[1]) & both.any()
    places, like, both, down, up = places[good], like[:, good], both[good], down.rows(good), up.rows(good)
    middle_s, half_s = 0.5 * (down.time_s + up.time_s), 0.5 * (up.time_s - down.time_s)
    u_s = 0.5 * np.hypot(down.u_s, up.u_s)
    samples = _WORTH * np.minimum(down.samples, up.samples)
    scatter_s = _scatter_s(places[both], middle_s[both])
    # What the turns scatter by has in it how the noise hangs together.
    samples[scatter_s > u_s] = 1.0
    u_s = np.maximum(u_s, scatter_s)
    if both.any():
        one = np.flatnonzero(like[0] ^ like[1])
        nearest = _of_same_motion(both, like[0])
        sign = np.where(like[0], 1.0, -1.0)
        crossed_s, own_u_s = (
            np.where(like[0], a, b) for a, b in ((down.time_s, up.time_s), (down.u_s, up.u_s))
        )
        middle_s[one] = (crossed_s + sign * half_s[nearest])[one]
        u_s[one] = np.hypot(np.maximum(own_u_s, scatter_s), u_s[nearest])[one]
        half_s[one] = half_s[nearest][one]
    own = ~_between_motions(places, half_s, u_s)
    return LikeFlanks(places[own], middle_s[own], half_s[own], u_s[own], samples[own], *window_mm)


def _between_motions(places: IndexArray, half_s: FloatArray, u_s: FloatArray) -> BoolArray:
    """Say which turns lie between two frequencies, or a motion and a rest at the level: one flank is slower.

    The middle between unlike flanks is not when the stroke turns. From crossing to crossing it takes another
    time there than at the turn before and at the one behind; within a motion, at one of them the same.
    """
    if places.size < 2:
        return np.zeros(places.size, dtype=bool)
    in_row = np.diff(places) == 2
    most_s = np.maximum(
        _TOLD * np.hypot(u_s[1:], u_s[:-1]), _HALF_ALIKE * np.minimum(half_s[1:], half_s[:-1])
    )
    alike = in_row & (np.abs(np.diff(half_s)) <= most_s)
    has_neighbour, has_like_one = (
        np.append(False, pairs) | np.append(pairs, False) for pairs in (in_row, alike)
    )
    return np.asarray(has_neighbour & ~has_like_one)


def _of_same_motion(both: BoolArray, before: BoolArray) -> IndexArray:
    """Return the row of the nearest turn with both flanks, of each turn: on the side of its own like flank.

    What lies on the other side of it is another motion.
    """
    rows = np.arange(both.size)
    last = np.maximum.accumulate(np.where(both, rows, -1))
    coming = np.minimum.accumulate(np.where(both, rows, both.size)[::-1])[::-1]
    found = np.where((before & (last >= 0)) | (coming == both.size), last, coming)
    return np.asarray(found)


def _like(turns: Sequence[TurningPoint], places: IndexArray, side: int) -> BoolArray:
    """Say of which turns the flank before (-1) or behind (1) goes between the strokes of that of a cycle ago,
    or of the cycle to come.
    """
    first = np.array([turn.stroke_mm for turn in turns])
    low, top = first[places], first[places + side]
    found = np.zeros(places.size, dtype=bool)
    for away in (-2, 2):
        other = places + away
        there = (np.minimum(other, other + side) >= 0) & (np.maximum(other, other + side) < first.size)
        at = np.where(there, other, places)
        apart = np.maximum(np.abs(first[at] - low), np.abs(first[at + side] - top))
        found |= there & (apart <= _ALIKE * (top - low))
    return found


def _scatter_s(places: IndexArray, middle_s: FloatArray) -> float:
    """Return how the middles of turns scatter about a motion whose period changes evenly [s]; 0 of too few.

    Noise that is slower than a flank moves its crossing, and nothing within the flank shows it. Where one
    step of a campaign goes over into the next the period jumps: most turns count, not all.
    """
    in_row = places[3:] - places[:-3] == 6
    if np.count_nonzero(in_row) < _LEAST_IN_ROW - 3:
        return 0.0
    third = np.diff(middle_s, 3)[in_row]
    return float(np.sqrt(np.median(third**2) / _NORMAL_MEDIAN_SQUARE / _OF_THIRD_DIFFERENCE))


def _both(turn: TurningPoint) -> tuple[float, float]:
    """Return where the flanks of a turn end and begin: a dwell is split in its middle."""
    middle_s = 0.5 * (turn.time_s + turn.leave_s)
    return middle_s, middle_s


def crossings(
    record: Record,
    begin_s: FloatArray,
    end_s: FloatArray,
    window_mm: tuple[float, float],
    sigma_mm: float,
) -> Crossings:
    """Return where flanks cross a level.

    Parameters
    ----------
    record : Record
    begin_s, end_s : arrays, shape (R,)
        Turns between which each flank lies.
    window_mm : (float, float)
        The level, and within how much of it the flanks are fitted.
    sigma_mm : float
        Noise of the stroke.
    """
    level, half_width = window_mm
    first, last = (np.searchsorted(record.time_s, at_s) for at_s in (begin_s, end_s))
    spans = _spans(record, first, last, level, half_width)
    size = spans[1] - spans[0]
    breaks = np.array(record.breaks, dtype=np.intp)
    whole = np.searchsorted(breaks, spans[0], side="right") == np.searchsorted(breaks, spans[1] - 1, "right")
    rows = np.flatnonzero(whole & (size >= _LEAST_SAMPLES))
    found = np.full((3, first.size), np.nan)
    if rows.size:
        ones = np.ones(rows.size)
        points = points_of(record.time_s, record.stroke_mm - level, ones, spans[0][rows], spans[1][rows])
        found[:2, rows] = _zeros(points, sigma_mm)
        found[2] = size
    return Crossings(*found)


def _spans(
    record: Record, first: IndexArray, last: IndexArray, level: float, half_width: float
) -> tuple[IndexArray, IndexArray]:
    """Return the samples of flanks (first, last excluded) between the ends of the window; 0 where none are.

    Where noise crosses an end of it several times, the middle of these counts.
    """
    begin, end = max(0, int(np.min(first)) - 1), int(np.max(last)) + 1
    stroke = record.stroke_mm[begin:end]
    ends = []
    for at_mm in (level - half_width, level + half_width):
        above = stroke > at_mm
        changes = begin + 1 + np.flatnonzero(above[1:] != above[:-1])
        low, high = np.searchsorted(changes, first), np.searchsorted(changes, last)
        crossed = high > low
        own = np.full(first.size, -1, dtype=np.intp)
        own[crossed] = (changes[low[crossed]] + changes[high[crossed] - 1]) // 2
        ends.append(own)
    known = (ends[0] >= 0) & (ends[1] >= 0)
    lowest, highest = np.minimum(*ends), np.maximum(*ends)
    return np.where(known, lowest, 0), np.where(known, highest, 0)


def _zeros(points: WindowPoints, sigma_mm: float) -> FloatArray:
    """Return where polynomials through points are 0 and the u of that [s], shape (2, R)."""
    last = np.take_along_axis(points.time_s, points.count[:, None] - 1, axis=1)[:, 0]
    middle, half = 0.5 * (points.time_s[:, 0] + last), 0.5 * (last - points.time_s[:, 0])
    z = np.where(points.used, (points.time_s - middle[:, None]) / half[:, None], 0.0)
    value = np.where(points.used, points.value, 0.0)
    coefficients, inverse, _, errors = solved(z, value, points.used, _DEGREE)
    slopes = derivative(coefficients)
    at = np.zeros(middle.size)
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(_NEWTON_STEPS):
            at = at - value_at(coefficients, at) / value_at(slopes, at)
        slope = value_at(slopes, at)
        row = powers(at, _DEGREE)
        gain = np.sqrt(np.maximum(np.einsum("ri,rij,rj->r", row, inverse, row), 0.0))
        spare = points.count - _DEGREE - 1
        scatter = np.maximum(np.sqrt(errors / np.maximum(spare, 1)), sigma_mm / np.sqrt(points.group))
        found = np.stack((middle + half * at, half * scatter * gain / np.abs(slope)))
    lost = ~(np.abs(at) <= 1.0) | (spare < 1) | ~np.isfinite(found).all(axis=0)
    found[:, lost] = np.nan
    return np.asarray(found)
