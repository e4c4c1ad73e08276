"""The force at the ends of branches, each from its own branch.

Force hangs on stroke, and on how fast the stroke moves. Where a branch runs into a smooth turn both change
along its last part, so that the force is read as 1, time and stroke (a viscous or hysteretic ellipse is
linear in these two). Where it runs into a sharp turn or a rest, stroke and time are one: 1, stroke and its
square. The reading stands where the fitted turning point is, at no distance in time or stroke.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.record import FloatArray, Record
from evaluation.turn_fits import powers

IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]

END_SHARE = 0.02
"""Share of a branch's samples from which the force at its end is read."""
_LEAST_SAMPLES = 5
_MOST_SAMPLES = 400
_RESOLVED = 3.0
"""Where the stroke moves less than so many of its noise in the window, its noise would take its place."""
_DENSE = 12
_SHOWN = 3.0
"""A third term is known to be there when it is so many of its standard deviations."""
_NEXT = 1.75
"""A branch without a hole begins at most one and a half steps behind its turn."""
_HOLED = 0.5
"""A window with a step of more than this share of it has a hole: no polynomial is known there."""
_RIDGE = 1e-9
"""Where two terms are one (a sharp turn of an even stroke), each takes half; it costs 1e-9 of a value."""


@dataclass(frozen=True, eq=False)
class Ends:
    """Ends of branches, shape (E,): moment and stroke of the turning point, samples ``first`` … ``last``
    (excluded) of the branch, whether the branch begins there, and whether the stroke turns smoothly.
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    first: IndexArray
    last: IndexArray
    begins: BoolArray
    smooth: BoolArray


@dataclass(frozen=True, eq=False)
class EndForces:
    """Forces at ends of branches, shape (E,).

    Attributes
    ----------
    force_kN : array
        NaN where the branch has no sample.
    gain : array
        Standard deviation of ``force_kN`` for force noise of 1 kN a sample.
    slope_kN_per_mm : array
        By how much the force rises with the stroke there: what an error of the turning point makes of it.
    nearest_kN : array
        Force of the sample next to the end.
    far : array of bool
        That sample is farther away than the next ones are from each other: samples are missing there.
    """

    force_kN: FloatArray
    gain: FloatArray
    slope_kN_per_mm: FloatArray
    nearest_kN: FloatArray
    far: BoolArray

    def replaced(self, rows: IndexArray, force_kN: FloatArray, gain: FloatArray) -> EndForces:
        """Return these, some rows of which are others, read at rest: there no error of the stroke counts."""
        force, gains, slope = self.force_kN.copy(), self.gain.copy(), self.slope_kN_per_mm.copy()
        force[rows], gains[rows], slope[rows] = force_kN, gain, 0.0
        return EndForces(force, gains, slope, self.nearest_kN, self.far)

    def rows(self, chosen: slice) -> EndForces:
        """Return some of them."""
        return EndForces(
            self.force_kN[chosen],
            self.gain[chosen],
            self.slope_kN_per_mm[chosen],
            self.nearest_kN[chosen],
            self.far[chosen],
        )


def end_forces(record: Record, ends: Ends, sigma_mm: float) -> EndForces:
    """Return the force of each branch at its end, by least squares over its last 2 % (at least 5 samples).

    Parameters
    ----------
    record : Record
    ends : Ends
    sigma_mm : float
        Noise of the stroke.
    """
    size = ends.last - ends.first
    count = np.minimum(np.clip(END_SHARE * size, _LEAST_SAMPLES, _MOST_SAMPLES).astype(int), size)
    order = np.arange(int(np.max(count, initial=1)))
    first = np.where(ends.begins, ends.first, ends.last - count)
    at = np.clip(first[:, None] + order, 0, record.time_s.size - 1)
    used = order < count[:, None]
    force = np.where(used, record.force_kN[at], 0.0)
    time, _ = _scaled(record.time_s[at] - ends.time_s[:, None], used)
    stroke, reach = _scaled(record.stroke_mm[at] - ends.stroke_mm[:, None], used)
    dense = np.flatnonzero((count >= _DENSE) & (_widest_step(time, used) <= _HOLED))
    if dense.size:  # noise of the stroke would flatten the force over it
        stroke[dense] = _smooth_stroke(time[dense], stroke[dense], used[dense])
    resolved = (reach > _RESOLVED * sigma_mm)[:, None]
    along = np.where(ends.smooth[:, None] | ~resolved, time, stroke)
    terms = np.stack((used.astype(float), along, np.where(ends.smooth[:, None] & resolved, stroke, along**2)))
    terms[2, count < _LEAST_SAMPLES] = 0.0
    terms[1, count < _LEAST_SAMPLES - 2] = 0.0
    found, gain = _read(terms, force, count)
    lines = np.arange(count.size)
    near = force[lines, np.where(ends.begins, 0, np.maximum(count - 1, 0))]
    middle = np.einsum("ij->i", force) / np.maximum(count, 1)
    middle_mm = reach * np.einsum("ij->i", stroke) / np.maximum(count, 1)
    # No further from the nearest sample than all of them are from each other: a poor reading is none.
    span = np.max(np.where(used, force, -np.inf), axis=1) - np.min(np.where(used, force, np.inf), axis=1)
    there = np.where(count > 0, np.clip(found, near - span, near + span), np.nan)
    slope = (middle - there) / np.where(middle_mm == 0.0, np.inf, middle_mm)
    nearest = np.abs(time[lines, np.where(ends.begins, 0, np.maximum(count - 1, 0))])
    far = nearest * (count - 1) > _NEXT * (1.0 - nearest)  # the farthest one is at 1
    return EndForces(there, gain, slope, near, far)


def continuous(arrives: EndForces, leaves: EndForces) -> BoolArray:
    """Say where the force of two branches that meet is one, though it may change fast behind the turn.

    The reading at the begin of the second branch lies between its first sample and the end of the first
    branch, and nearer to the latter: what is left is the curve between two samples. A force that is another
    one behind the turn (dry friction) has its own reading close to its own samples instead. Where samples are
    missing behind the turn, nothing shows a jump.
    """
    apart = np.abs(arrives.force_kN - leaves.force_kN)
    return np.asarray((apart <= np.abs(leaves.force_kN - leaves.nearest_kN)) | leaves.far)


def _read(terms: FloatArray, force: FloatArray, count: IndexArray) -> tuple[FloatArray, FloatArray]:
    """Return what forces (E, W) are at the end, by their terms (3, E, W), and the gain of noise, shape (E,).

    The third term counts where the samples show it: it makes noise half as large again.
    """
    # Of three terms the inverse is written out: a library takes ten times as long for so small a matrix.
    m00, m01, m02, m11, m12, m22 = (
        np.einsum("ij,ij->i", terms[a], terms[b]) for a, b in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    )
    m11, m22 = (m + _RIDGE * count + (m == 0.0) for m in (m11, m22))
    m00 = m00 + (m00 == 0.0)
    right = np.stack([np.einsum("ij,ij->i", term, force) for term in terms])
    c00, c01, c02 = m11 * m22 - m12**2, m02 * m12 - m01 * m22, m01 * m12 - m02 * m11
    c12, c22 = m01 * m02 - m00 * m12, m00 * m11 - m01**2
    whole = m00 * c00 + m01 * c01 + m02 * c02
    whole = np.where(whole > 0.0, whole, np.inf)  # two terms are one: nothing is read, the samples bound it
    first = np.stack((c00, c01, c02)) / whole
    third = np.stack((c02, c12, c22)) / whole
    value, bend = np.einsum("ai,ai->i", first, right), np.einsum("ai,ai->i", third, right)
    tilt = (right[1] - m01 * value - m12 * bend) / m11
    away = force - value[:, None] * terms[0] - tilt[:, None] * terms[1] - bend[:, None] * terms[2]
    scatter = np.einsum("ij,ij->i", away, away) / np.maximum(count - 3, 1)
    shown = bend**2 > _SHOWN**2 * scatter * third[2]
    # Without the third term, by the formula for a matrix less one row and column.
    share = third[0] / np.where(third[2] > 0.0, third[2], np.inf)
    gain = first[0] - np.where(shown, 0.0, share * third[0])
    return np.where(shown, value, value - share * bend), np.sqrt(np.maximum(gain, 0.0))


def _smooth_stroke(time: FloatArray, stroke: FloatArray, used: BoolArray) -> FloatArray:
    """Return a polynomial of fourth degree through the strokes of each window, shape (E, W)."""
    terms = powers(2.0 * time + np.where(np.sum(time, axis=1) > 0.0, -1.0, 1.0)[:, None], 4) * used[..., None]
    turned = terms.transpose(0, 2, 1)
    coefficients = np.linalg.solve(turned @ terms, turned @ stroke[..., None])
    return np.asarray((terms @ coefficients)[..., 0])


def _widest_step(time: FloatArray, used: BoolArray) -> FloatArray:
    """Return the longest step of time in each window, as a share of its reach from the end; shape (E,).

    That from the end itself to the nearest sample counts.
    """
    both = used[:, 1:] & used[:, :-1]
    steps = np.max(np.abs(np.diff(time, axis=1)), axis=1, initial=0.0, where=both)
    return np.asarray(np.maximum(steps, np.min(np.abs(time), axis=1, initial=1.0, where=used)))


def _scaled(away: FloatArray, used: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return distances from the end in their largest one, and that one."""
    away = np.where(used, away, 0.0)
    reach = np.max(np.abs(away), axis=1, initial=0.0)
    return away / np.where(reach > 0.0, reach, 1.0)[:, None], reach
