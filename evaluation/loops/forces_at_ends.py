"""The force at the ends of branches, each from its own branch.

Force hangs on stroke, and on how fast the stroke moves. Where a branch runs into a smooth turn both change
along its last part, so that the force is read as 1, stroke, speed and stroke squared (a viscous or
hysteretic ellipse is linear in stroke and speed). Where it runs into a sharp turn the speed is one up to the
end: 1, stroke and its square. A rest is read as 1, time and its square. The reading stands where the fitted
turning point is, at no distance in stroke or time and at no speed.

How many of these terms, and over how many samples: among the fits whose residual the noise explains, the one
with the least uncertainty counts. How far the others lie from it, beyond what noise makes of them, is its
doubt.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np

from bufferstand.evaluation.loops.branch_ends import MOST_POINTS, BranchEnds, Windows, end_windows
from bufferstand.evaluation.loops.end_fits import MODELS, Choice, choose, fit
from bufferstand.evaluation.numerics import BoolArray, FloatArray, IndexArray
from bufferstand.evaluation.record import Record

MOST_ASKED = 24
"""So many readings show which window and terms suit those beside them."""
_ROWS = 512
"""Ends that are read together: what is made of them stays in the processor's cache."""
_NEXT = 1.75
"""A branch without a hole begins at most one and a half steps behind its turn."""


@dataclass(frozen=True, eq=False)
class EndForces:
    """Forces at ends of branches, shape (E,).

    Attributes
    ----------
    force_kN : array
        NaN where the branch has no sample.
    gain : array
        Standard deviation of ``force_kN`` for force noise of 1 kN a sample.
    doubt_kN : array
        Standard uncertainty of ``force_kN`` by the choice of window and terms, beyond noise.
    slope_kN_per_mm : array
        By how much the force rises with the stroke there: what an error of the turning point makes of it.
    nearest_kN : array
        Force of the sample next to the end.
    far : array of bool
        That sample is farther away than the next ones are from each other: samples are missing there.
    """

    force_kN: FloatArray
    gain: FloatArray
    doubt_kN: FloatArray
    slope_kN_per_mm: FloatArray
    nearest_kN: FloatArray
    far: BoolArray

    def replaced(self, rows: IndexArray, other: EndForces) -> EndForces:
        """Return these, some rows of which are others, ``other`` in that order."""
        place = np.arange(self.force_kN.size)
        place[rows] = self.force_kN.size + np.arange(rows.size)
        return self.joined((self, other)).rows(place)

    @classmethod
    def joined(cls, parts: Sequence[EndForces]) -> EndForces:
        """Return several one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(*(np.concatenate([getattr(part, own.name) for part in parts]) for own in fields(cls)))

    def rows(self, chosen: slice | IndexArray | BoolArray) -> EndForces:
        """Return some of them."""
        return EndForces(
            self.force_kN[chosen],
            self.gain[chosen],
            self.doubt_kN[chosen],
            self.slope_kN_per_mm[chosen],
            self.nearest_kN[chosen],
            self.far[chosen],
        )

    def at_sample(self, force_kN: float) -> EndForces:
        """Return the same ends, at which one sample is the force."""
        flat = np.zeros_like(self.force_kN)
        return EndForces(flat + force_kN, flat + 1.0, flat, flat, flat + force_kN, self.far)


def end_forces(
    record: Record,
    groups: Sequence[tuple[BranchEnds, int]],
    sigma_kN: float,
    sigma_mm: float,
    *,
    at_rest: bool = False,
) -> list[EndForces]:
    """Return the force of each branch at its end, by least squares over its last samples.

    Parameters
    ----------
    record : Record
    groups : sequence of (Ends, int)
        Ends, and of how many of them at most, evenly spread, window and terms are asked: others take those
        of the nearest one. What one group asks for does not touch another one: that they are read together
        spares time.
    sigma_kN, sigma_mm : float
        Noise of force and stroke.
    at_rest : bool
        The branches are rests: their force is read over time, and no error of the stroke counts.

    Returns
    -------
    list of EndForces
        One for each group.
    """
    sizes = [group.time_s.size for group, _ in groups]
    starts = np.concatenate(([0], np.cumsum(sizes)))
    ends = BranchEnds.joined([group for group, _ in groups])
    samples = [_spread(size, most) for size, (_, most) in zip(sizes, groups, strict=True)]
    asked = np.concatenate([rows + start for rows, start in zip(samples, starts.tolist(), strict=False)])
    windows = end_windows(record, ends.rows(asked), sigma_mm, at_rest=at_rest)
    choice = choose(windows, sigma_kN, sigma_mm)
    if ends.time_s.size > asked.size:
        nearest, most, before = [], np.full(ends.time_s.size, MOST_POINTS), 0
        for size, rows, start in zip(sizes, samples, starts.tolist(), strict=False):
            own = slice(before, before + rows.size)
            nearest.append(before + np.searchsorted(0.5 * (rows[1:] + rows[:-1]), np.arange(size)))
            if size > rows.size:
                most[start : start + size] = np.max(choice.points[own])
            before = own.stop
        choice = choice.rows(np.concatenate(nearest))
        parts = []
        for start in range(0, ends.time_s.size, _ROWS):
            rows = np.arange(start, min(start + _ROWS, ends.time_s.size))
            windows = end_windows(record, ends.rows(rows), sigma_mm, at_rest=at_rest, most=most[rows])
            parts.append(_read(record, ends.rows(rows), windows, choice.rows(rows), at_rest=at_rest))
        found = EndForces.joined(parts)
    else:
        found = _read(record, ends, windows, choice, at_rest=at_rest)
    return [found.rows(slice(first, last)) for first, last in pairwise(starts.tolist())]


def _spread(size: int, most: int) -> IndexArray:
    """Return so many of ``size`` places at most, evenly spread."""
    if size <= most:
        return np.arange(size)
    return np.unique(np.linspace(0, size - 1, most).round().astype(np.intp))


def _read(record: Record, ends: BranchEnds, windows: Windows, choice: Choice, *, at_rest: bool) -> EndForces:
    """Return the forces by the fits that were chosen."""
    number = ends.time_s.size
    points = np.minimum(choice.points, windows.count)
    value, gain = np.zeros((2, number))
    for model, terms in enumerate(MODELS):
        rows = np.flatnonzero(choice.model == model)
        if rows.size:
            own = windows if rows.size == number else windows.rows(rows)
            found = fit(own, points[rows, None], terms)
            value[rows], gain[rows] = found.value[:, 0], found.gain[:, 0]
    used = np.arange(windows.force_kN.shape[1]) < points[:, None]
    near = windows.force_kN[:, 0]
    # No further from the nearest sample than all of them are from each other: a poor reading is none.
    away_kN = np.where(used, windows.force_kN - near[:, None], 0.0)
    span = np.ptp(away_kN, axis=1)
    there = np.where(points > 0, np.clip(value, near - span, near + span), np.nan)
    total = np.maximum(points, 1)
    middle = np.einsum("ij->i", np.where(used, windows.force_kN, 0.0)) / total
    away = np.einsum("ij->i", np.where(used, windows.terms[1], 0.0)) / total
    away_mm = np.where(away == 0.0, 1.0, away) * np.where(away == 0.0, np.inf, windows.reach_mm)
    slope = np.nan_to_num((middle - there) / away_mm)
    at = np.where(ends.begins, ends.first, ends.last - 1)
    at = np.clip(at, 0, record.time_s.size - 1)
    gap_s = np.abs(record.time_s[at] - ends.time_s)
    size = ends.last - ends.first
    wide = np.minimum(np.maximum(size - 1, 0), 4)
    other = np.clip(np.where(ends.begins, at + wide, at - wide), 0, record.time_s.size - 1)
    steps_s = np.abs(record.time_s[other] - record.time_s[at]) / np.maximum(wide, 1)
    far = gap_s > _NEXT * steps_s
    forces = EndForces(there, gain / np.sqrt(windows.group), choice.doubt_kN, slope, record.force_kN[at], far)
    return _within_rest(forces, windows) if at_rest else forces


def _within_rest(found: EndForces, windows: Windows) -> EndForces:
    """Return forces of rests halfway to their points where they lie beyond all of these.

    A stand eases into a rest: whether the force goes on as it does in the rest up to the moment of arriving,
    or has turned before, no sample shows.
    """
    used = windows.terms[0] > 0.0
    least = np.min(np.where(used, windows.force_kN, np.inf), axis=1)
    most = np.max(np.where(used, windows.force_kN, -np.inf), axis=1)
    beyond = 0.5 * (found.force_kN - np.clip(found.force_kN, least, most))
    doubt = np.hypot(found.doubt_kN, beyond)
    return replace(found, force_kN=found.force_kN - beyond, doubt_kN=doubt)


def continuous(arrives: EndForces, leaves: EndForces) -> BoolArray:
    """Say where the force of two branches that meet is one, though it may change fast behind the turn.

    The reading at the begin of the second branch lies between its first sample and the end of the first
    branch, and nearer to the latter: what is left is the curve between two samples. A force that is another
    one behind the turn (dry friction) has its own reading close to its own samples instead. Where samples are
    missing behind the turn, nothing shows a jump.
    """
    apart = np.abs(arrives.force_kN - leaves.force_kN)
    return np.asarray((apart <= np.abs(leaves.force_kN - leaves.nearest_kN)) | leaves.far)
