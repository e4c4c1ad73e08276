"""The last samples of branches as points, with what the force may depend on: stroke, speed or time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from bufferstand.evaluation.numerics import BoolArray, FloatArray, IndexArray
from bufferstand.evaluation.record import Record

MOST_POINTS = 40
"""Samples of a window are averaged in groups down to this many points."""
_SHARE = 0.08
"""Share of a branch's samples that a window reaches over at most …"""
_LEAST_SAMPLES = 20
"""… or so many samples, where that is more …"""
_MOST_SHARE = 0.4
"""… but no larger share than this (at least five samples)."""
_MOST_SAMPLES = 800
_LEAST = 5
_RESOLVED = 3.0
"""Where the stroke moves less than so many of its noise in a window, its noise would take its place."""
_EXPLAINED = 1.3
"""A polynomial through strokes counts where it leaves no more than so much of the noise."""
_RIDGE = 1e-12
"""What keeps the system of a window of few points solvable: its sums are about 1."""
_HOLED = 0.5
"""A window with a step of more than this share of it has a hole: no polynomial is known there."""


@dataclass(frozen=True, eq=False)
class BranchEnds:
    """Ends of branches, shape (E,): moment and stroke of the turning point, samples ``first`` … ``last``
    (excluded) of the branch, whether the branch begins there, and whether the stroke turns smoothly.
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    first: IndexArray
    last: IndexArray
    begins: BoolArray
    smooth: BoolArray

    @classmethod
    def joined(cls, groups: Sequence[BranchEnds]) -> BranchEnds:
        """Return several groups one after the other."""
        if len(groups) == 1:
            return groups[0]
        columns = [[getattr(group, own.name) for group in groups] for own in fields(cls)]
        return cls(*map(np.concatenate, columns))

    def rows(self, chosen: IndexArray) -> BranchEnds:
        """Return some of them."""
        return BranchEnds(
            self.time_s[chosen],
            self.stroke_mm[chosen],
            self.first[chosen],
            self.last[chosen],
            self.begins[chosen],
            self.smooth[chosen],
        )


@dataclass(frozen=True, eq=False)
class Windows:
    """Points of windows, a row each, counted from the end into the branch.

    Attributes
    ----------
    force_kN : array, shape (E, P)
    terms : array, shape (4, E, P)
        1, stroke from the turning point (or time, where the stroke rests or hides in its noise), speed, and
        the second one squared; scaled to about 1, 0 for padding.
    count, group : arrays, shape (E,)
        Points of each row, samples of each point.
    reach_mm : array, shape (E,)
        What 1 of the second term is [mm]; infinite where it is time.
    """

    force_kN: FloatArray
    terms: FloatArray
    count: IndexArray
    group: IndexArray
    reach_mm: FloatArray

    def rows(self, chosen: IndexArray | BoolArray) -> Windows:
        """Return some of them."""
        return Windows(
            self.force_kN[chosen],
            self.terms[:, chosen],
            self.count[chosen],
            self.group[chosen],
            self.reach_mm[chosen],
        )


def end_windows(
    record: Record,
    ends: BranchEnds,
    sigma_mm: float,
    *,
    at_rest: bool,
    most: int | IndexArray = MOST_POINTS,
) -> Windows:
    """Return the windows at ends of branches.

    Parameters
    ----------
    record : Record
    ends : Ends
    sigma_mm : float
        Noise of the stroke.
    at_rest : bool
        The branches are rests, any part of which may be read.
    most : int, or array of int, shape (E,)
        Points of a window at most.
    """
    size = ends.last - ends.first
    share = 1.0 if at_rest else _SHARE
    wanted = np.clip(share * size, _LEAST_SAMPLES, _MOST_SAMPLES)
    wanted = np.minimum(wanted, np.maximum(_LEAST, (1.0 if at_rest else _MOST_SHARE) * size))
    wanted = np.minimum(wanted.astype(np.intp), size)
    group = np.maximum(1, -(-wanted // MOST_POINTS))
    count = np.minimum(wanted // group, most)
    shape = (size.size, max(1, int(np.max(count, initial=0))))
    groups = np.unique(group)
    if groups.size == 1:
        time, stroke, force = _means(record, ends, int(groups[0]), shape[1])
    else:
        time, stroke, force = np.zeros((3, *shape))
        for each in groups.tolist():
            rows = np.flatnonzero(group == each)
            points = int(np.max(count[rows]))
            for column, means in zip(
                (time, stroke, force), _means(record, ends.rows(rows), each, points), strict=True
            ):
                column[rows, :points] = means
    used = np.arange(shape[1]) < count[:, None]
    away_s = np.where(used, time - ends.time_s[:, None], 0.0)
    away_mm = np.where(used, stroke - ends.stroke_mm[:, None], 0.0)
    speed = np.zeros(shape)
    smooth = ends.smooth & (not at_rest)
    if smooth.any():
        turns = slice(None) if smooth.all() else smooth
        noise_mm = sigma_mm / np.sqrt(group[turns])
        away_mm[turns], speed[turns] = _moving(
            away_s[turns], away_mm[turns], used[turns], count[turns], noise_mm
        )
    reach_mm = np.max(np.abs(away_mm), axis=1)
    timed = (reach_mm <= _RESOLVED * sigma_mm / np.sqrt(group)) | at_rest
    speed[timed] = 0.0
    along = _scaled(np.where(timed[:, None], away_s, away_mm))
    terms = np.empty((4, *shape))
    terms[0], terms[1], terms[2] = used, along, _scaled(speed)
    np.multiply(along, along, out=terms[3])
    return Windows(
        np.where(used, force, 0.0), terms, count, group, np.where(timed | (reach_mm == 0.0), np.inf, reach_mm)
    )


def _means(record: Record, ends: BranchEnds, each: int, points: int) -> list[FloatArray]:
    """Return time, stroke and force from the ends inwards, means of so many samples, (E, ``points``)."""
    own = np.arange(points * each)
    first, last = ends.first[:, None], ends.last[:, None]
    if ends.begins.all():
        at = first + own
    elif ends.begins.any():
        at = np.where(ends.begins[:, None], first + own, last - 1 - own)
    else:
        at = last - 1 - own
    np.minimum(np.maximum(at, 0, out=at), record.time_s.size - 1, out=at)
    columns = [values[at] for values in (record.time_s, record.stroke_mm, record.force_kN)]
    if each == 1:
        return columns
    return [column.reshape(len(column), -1, each).mean(axis=2) for column in columns]


def _scaled(values: FloatArray) -> FloatArray:
    """Return each row in its largest value."""
    reach = np.max(np.abs(values), axis=1, initial=0.0)
    return values / np.where(reach > 0.0, reach, 1.0)[:, None]


def _moving(
    away_s: FloatArray, away_mm: FloatArray, used: BoolArray, count: IndexArray, noise_mm: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return stroke from a smooth turn [mm] and speed [mm/s], without their noise where that is known.

    A polynomial from the turning point on, where the speed is 0, knows both, if its misfit is no more than
    the noise. Else the stroke is as recorded, and the speed of three points' parabola.
    """
    reach_s = np.max(np.abs(away_s), axis=1)
    per_s = 1.0 / np.where(reach_s > 0.0, reach_s, 1.0)
    z = away_s * per_s[:, None]
    square = z * z
    found = _risen(z, square, away_mm)
    error = np.where(used, away_mm - square * (found[0] + z * (found[1] + z * found[2])), 0.0)
    misfit = np.sqrt(np.einsum("ij,ij->i", error, error) / np.maximum(count - 3, 1))
    speed = per_s[:, None] * z * (2.0 * found[0] + z * (3.0 * found[1] + z * (4.0 * found[2])))
    known = (misfit <= _EXPLAINED * noise_mm) & (count > 4) & (_widest_step(z, used) <= _HOLED)
    rough = np.flatnonzero(~known)
    if rough.size:
        speed[rough] = _slopes(away_s[rough], away_mm[rough], count[rough])
    return np.where(known[:, None] & used, away_mm - error, away_mm), np.where(used, speed, 0.0)


def _risen(z: FloatArray, square: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the factors of z², z³ and z⁴ that fit the values of each row best, shape (E, 1) each.

    By elimination in columns: the library takes longer for so many small systems.
    """
    powers = square, square * z, square * square
    four, five, six = (np.einsum("ij,ij->i", square, power) for power in powers)
    seven, eight = (np.einsum("ij,ij->i", powers[2], power) for power in powers[1:])
    one, two, three = (np.einsum("ij,ij->i", value, power) for power in powers)
    first = four + _RIDGE
    share, other = five / first, six / first
    second, mixed = six + _RIDGE - share * five, seven - share * six
    two, three = two - share * one, three - other * one
    last = mixed / second
    c = (three - last * two) / (eight + _RIDGE - other * six - last * mixed)
    b = (two - mixed * c) / second
    a = (one - five * b - six * c) / first
    return a[:, None], b[:, None], c[:, None]


def _widest_step(time: FloatArray, used: BoolArray) -> FloatArray:
    """Return the longest step of time in each window, as a share of its reach from the end; shape (E,).

    That from the end itself to the nearest sample counts.
    """
    away, step = np.abs(time), np.diff(time, axis=1)
    np.abs(step, out=step)
    if not used.all():  # what is used comes first
        away[~used] = 1.0
        step[~used[:, 1:]] = 0.0
    return np.asarray(np.maximum(step.max(axis=1, initial=0.0), away.min(axis=1, initial=1.0)))


def _slopes(away_s: FloatArray, away_mm: FloatArray, count: IndexArray) -> FloatArray:
    """Return the slope at each point by the parabola through it and its neighbours, the turn among them."""
    rows = away_s.shape[0]
    time = np.concatenate((np.zeros((rows, 1)), away_s, np.zeros((rows, 1))), axis=1)
    value = np.concatenate((np.zeros((rows, 1)), away_mm, np.zeros((rows, 1))), axis=1)
    step = np.diff(time, axis=1)
    slope = np.diff(value, axis=1) / np.where(step == 0.0, np.inf, step)
    before, after = step[:, :-1], step[:, 1:]
    whole = before + after
    middle = (after * slope[:, :-1] + before * slope[:, 1:]) / np.where(whole == 0.0, np.inf, whole)
    lines = np.arange(rows)
    last = np.maximum(count - 1, 0)  # beyond it nothing is known: by the step before alone
    middle[lines, last] = slope[lines, last]
    return np.asarray(middle)
