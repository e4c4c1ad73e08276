"""Branches of many loops at once, cut exactly at the fitted turning points: rows, padded to one length.

A branch runs from one turning point to the next. Its rows are padded with its last point, which adds nothing
to any integral over the stroke.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import BoolArray, FloatArray, IndexArray, splines
from bufferstand.evaluation.record import Record

DENSE_SAMPLES = 200
"""A branch with fewer samples is interpolated (cubic spline over time, each branch by itself) …"""
_DENSE_MEANS = 45
"""… and one with fewer means over samples.

Only a stroke without corners has so few (evaluation.loading.condense).
"""
_DENSE_POINTS = 800
MOST_POINTS = 1000
"""A branch with more samples is averaged in groups: the noise of force times that of stroke adds up with
the number of samples, while the polygon of 2000 points is right to 2 parts in a million."""
_LEAST_STEP = 0.5
"""A sample nearer than this share of a step to a turning point is left out: that point stands for it."""
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Branches:
    """Time, stroke and force of branches, shape (R, P); ``count`` (R,) points of each row are its own.

    ``averaged``: samples that each point, but the ends, is the mean of.
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    force_kN: FloatArray
    count: IndexArray
    averaged: int = 1

    @property
    def used(self) -> BoolArray:
        """Which of the (R, P) are points and which padding."""
        return np.asarray(np.arange(self.time_s.shape[1]) < self.count[:, None])

    def areas(self) -> FloatArray:
        """Return ∫ F dx of each branch [J], shape (R,): of a curve through the points, not of the polygon.

        Of N points a cycle a polygon encloses 6.6 / N² too little (-0.26 % at 50), and means over as much as
        their distance once more half of that. Both are known from how the curve bends: a step h of it misses
        h³ / 12 (F′x″ - F″x′), a mean moves its point by h² / 24 of the second derivative. What is left is
        2e-5 at 50 points, 6e-7 at 120.
        """
        dx, df = np.diff(self.stroke_mm, axis=1), np.diff(self.force_kN, axis=1)
        area = np.einsum("ij,ij->i", self.force_kN[:, :-1], dx)
        area += 0.5 * np.einsum("ij,ij->i", df, dx)
        if dx.shape[1] < 4:
            return np.asarray(area)
        bends = np.einsum("ij,ij->i", df[:, :-1], dx[:, 1:]) - np.einsum("ij,ij->i", df[:, 1:], dx[:, :-1])
        moved = (1.0 - 1.0 / self.averaged**2) / 24.0
        bends *= 1.0 / 12.0 + moved
        bends += np.sum(self._end_bends(moved), axis=0)
        return np.asarray(area + np.where(self.count >= 5, bends, 0.0))

    def _end_bends(self, moved: float) -> FloatArray:
        """Return what :meth:`areas` misses at both ends, whose steps are of their own, shape (2, R)."""
        node = np.stack((np.ones_like(self.count), np.clip(self.count - 2, 1, self.time_s.shape[1] - 2)))
        places = node + np.array([-1, 0, 1])[:, None, None]
        lines = np.arange(self.count.size)
        (dt, dt_1), (dx, dx_1), (df, df_1) = (
            np.diff(column[lines, places], axis=0) for column in (self.time_s, self.stroke_mm, self.force_kN)
        )
        at_start = node == 1
        end, step = np.where(at_start, dt, dt_1), np.where(at_start, dt_1, dt)
        whole = 0.5 * end * step * (end + step)
        part = end**3 / 12.0 + step**3 / 24.0 + moved * step**2 * 0.5 * (end + step)
        weight = part / np.where(whole > 0.0, whole, np.inf) - 1.0 / 12.0 - moved
        return np.asarray(weight * (df * dx_1 - df_1 * dx))

    def rows(self, chosen: slice) -> Branches:
        """Return some of the branches, as wide as the longest of them."""
        count = self.count[chosen]
        width = slice(0, int(np.max(count, initial=1)))
        time, stroke, force = (a[chosen, width] for a in (self.time_s, self.stroke_mm, self.force_kN))
        return Branches(time, stroke, force, count, self.averaged)

    def row(self, row: int) -> FloatArray:
        """Return time, stroke and force of one branch, shape (3, M)."""
        own = slice(0, int(self.count[row]))
        return np.stack([a[row, own] for a in (self.time_s, self.stroke_mm, self.force_kN)])


@dataclass(frozen=True, eq=False)
class Stretches:
    """The samples strictly between two moments each: ``first`` … ``last`` (excluded), shape (R,)."""

    start_s: FloatArray
    end_s: FloatArray
    first: IndexArray
    last: IndexArray

    @classmethod
    def between(cls, time_s: FloatArray, start_s: FloatArray, end_s: FloatArray) -> Stretches:
        """Return the samples of a record that lie strictly between moments of it."""
        first = np.searchsorted(time_s, start_s, side="right")
        return cls(start_s, end_s, first, np.maximum(np.searchsorted(time_s, end_s, side="left"), first))

    def rows(self, chosen: IndexArray | slice) -> Stretches:
        """Return some of them."""
        return Stretches(self.start_s[chosen], self.end_s[chosen], self.first[chosen], self.last[chosen])

    def joined(self, others: Stretches) -> Stretches:
        """Return these and, behind them, others."""
        columns = ("start_s", "end_s", "first", "last")
        return Stretches(*(np.concatenate((getattr(self, own), getattr(others, own))) for own in columns))

    def trimmed(self, time_s: FloatArray) -> Stretches:
        """Return them without samples so near to an end that noise on both would bend a spline at will.

        A sample at the turning point itself may show the force behind a jump, too.
        """
        first, last = self.first.copy(), self.last.copy()
        size = last - first
        ends = np.minimum(first, time_s.size - 1), np.maximum(last - 1, 0)
        near_s = _LEAST_STEP * (time_s[ends[1]] - time_s[ends[0]]) / np.maximum(size - 1, 1)
        near_s = np.where(size > 2, near_s, _SAME * (self.end_s - self.start_s))
        while True:
            some = first < last
            drop = some & (time_s[np.minimum(first, time_s.size - 1)] - self.start_s < near_s)
            drop_last = some & ~drop & (self.end_s - time_s[np.maximum(last - 1, 0)] < near_s)
            if not (drop.any() or drop_last.any()):
                return Stretches(self.start_s, self.end_s, first, last)
            first, last = first + drop, last - drop_last


def closed(
    record: Record,
    inner: Stretches,
    first: tuple[FloatArray, FloatArray],
    last: tuple[FloatArray, FloatArray],
) -> Branches:
    """Return branches with their end points, dense enough to integrate.

    Parameters
    ----------
    record : Record
    inner : Stretches
        Samples of each, :meth:`Stretches.trimmed`.
    first, last : (array, array), shape (R,) each
        Stroke [mm] and force [kN] at the ends.
    """
    own = inner
    size = own.last - own.first
    group = np.maximum(1, -(-size // MOST_POINTS))
    inside = -(-size // group)
    count = inside + 2
    sparse = (count < (DENSE_SAMPLES if record.averaged == 1 else _DENSE_MEANS)) & (count >= 4)
    width = int(np.max(np.where(sparse, _DENSE_POINTS, count)))
    begin, end = (own.start_s, *first), (own.end_s, *last)
    columns = [np.empty((size.size, width)) for _ in range(3)]
    groups = np.unique(group)
    for each in groups.tolist():
        rows: slice | IndexArray = slice(None) if groups.size == 1 else np.flatnonzero(group == each)
        part = own.rows(rows)
        points = int(np.max(inside[rows]))
        at = part.first[:, None] + each * np.arange(points)
        signals = (record.time_s, record.stroke_mm, record.force_kN)
        for column, means in zip(columns, _means(signals, at, part.last, each), strict=True):
            column[rows, 1 : points + 1] = means
    order = np.arange(width)
    ragged = int(np.min(count)) - 1
    behind = order[ragged:] >= (count - 1)[:, None]
    for column, a, b in zip(columns, begin, end, strict=True):
        column[:, 0] = a
        column[:, ragged:] = np.where(behind, b[:, None], column[:, ragged:])
    if sparse.any():
        rows = np.flatnonzero(sparse)
        knots = [column[rows, : int(np.max(count[rows]))] for column in columns]
        fine = splines(knots[0], knots[1:], count[rows], _DENSE_POINTS)
        for column, values in zip(columns, fine, strict=True):
            column[rows, :_DENSE_POINTS] = values
            column[rows, _DENSE_POINTS:] = values[:, -1:]
        count = np.where(sparse, _DENSE_POINTS, count)
    return Branches(columns[0], columns[1], columns[2], count, record.averaged)


def _means(
    signals: Sequence[FloatArray], at: IndexArray, last: IndexArray, group: int
) -> Iterator[FloatArray]:
    """Yield means of signals over groups that begin at the given samples, none beyond ``last`` (excluded)."""
    highest = np.minimum(last, signals[0].size)[:, None] - 1
    if group == 1:
        nearest = np.minimum(at, highest)
        for values in signals:
            yield values.take(nearest)
        return
    size = np.clip(highest + 1 - at, 1, group)
    for values in signals:
        total = np.zeros(at.shape)
        for k in range(group):
            total += np.where(at + k <= highest, values[np.minimum(at + k, highest)], 0.0)
        yield total / size
