"""What is read off loops: energies, slopes, speeds, harmonics; and the windows that they are read in.

Loops are read many at once; one by itself is a stack of one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.cycles import spectra
from bufferstand.evaluation.facts import Cycle, Loop
from bufferstand.evaluation.loops import Branches, LoopStack
from bufferstand.evaluation.numerics import BoolArray, ComplexArray, FloatArray, moving_slopes, polynomials
from bufferstand.evaluation.record import Record

TANGENT_WINDOW = 0.15
"""Tangent stiffness: cubic fit of force over stroke within ± this share of the range about the mean."""
SPEED_WINDOW = 0.05
"""Speeds: slope of a local parabola over this share of a branch's samples (at least 5)."""
LEAST_WINDOW = 5
"""Samples that a parabola or cubic is fitted to at least."""
_FEWEST_SLOPE = 4


@dataclass(frozen=True, eq=False)
class TurnFigures:
    """What the turning points of cycles say, shape (C,) each; all that a cycle which is not complete has."""

    low_mm: FloatArray
    high_mm: FloatArray
    span_mm: FloatArray
    mean_mm: FloatArray


@dataclass(frozen=True, eq=False)
class LoopFigures(TurnFigures):
    """What is read off a stack of loops, each once however many quantities rest on it; shape (C,).

    Attributes
    ----------
    stack : LoopStack
    first : array
        K* = K′ + i K″ [kN/mm].
    """

    stack: LoopStack
    first: ComplexArray

    @classmethod
    def of(cls, stack: LoopStack, first: ComplexArray) -> LoopFigures:
        """Return the figures of a stack, turning points as they were fitted."""
        low, high = stack.turns.stroke_min_mm, stack.turns.stroke_max_mm
        return cls(low, high, high - low, 0.5 * (low + high), stack, first)

    @cached_property
    def stored_J(self) -> FloatArray:  # noqa: N802 - the unit keeps its capital
        """Area under the loading branch [J]."""
        return self.stack.stored_energy_J()

    @cached_property
    def absorbed_J(self) -> FloatArray:  # noqa: N802
        """Signed area of the loop [J]."""
        return self.stack.absorbed_energy_J()

    @cached_property
    def forces_kN(self) -> tuple[FloatArray, FloatArray]:  # noqa: N802
        """Least and largest force [kN]."""
        lowest, highest = (extreme.force_kN for extreme in self.stack.extremes)
        return lowest, highest

    @cached_property
    def speeds_mm_per_s(self) -> tuple[FloatArray, FloatArray]:
        """Largest speed of loading and unloading [mm/s]; NaN below five samples."""
        loading, unloading = np.split(branch_speeds_mm_per_s(self.stack.branches), 2)
        return loading, unloading

    @cached_property
    def tangent_kN_per_mm(self) -> FloatArray:  # noqa: N802
        """Slope of the loading branch at the mean stroke [kN/mm]; NaN where too few samples are near."""
        return local_slopes(self.stack.loading, self.mean_mm, TANGENT_WINDOW * self.span_mm)

    @cached_property
    def rise_kN(self) -> FloatArray:  # noqa: N802
        """Force at the end of the loading branch less that at its start [kN]."""
        return self.stack.ends[1].force_kN - self.stack.ends[0].force_kN

    @cached_property
    def distortion(self) -> FloatArray:
        """Harmonics 2 to 10 of the stroke over the first; NaN where a cycle has too few samples."""
        return np.array([cycle.stroke_distortion for cycle in self.stack.cycles], dtype=np.float64)


def stored_energy_J(loop: Loop) -> float:  # noqa: N802 - the unit keeps its capital
    """Return the area from the lower turning point to the largest stroke [J = kN·mm] (EN 15551: W_s)."""
    dwell = slice(loop.top, loop.rising.stop)
    return _area_J(loop, loop.loading) + float(np.trapezoid(loop.force_kN[dwell], loop.stroke_mm[dwell]))


def absorbed_energy_J(loop: Loop) -> float:  # noqa: N802
    """Return the signed area of the loop [J] (W_a); a loop that does not close is closed by a chord."""
    force, stroke = loop.force_kN, loop.stroke_mm
    chord = 0.5 * (force[-1] + force[0]) * (stroke[0] - stroke[-1])
    dwell = slice(loop.top, loop.unload + 1)
    rest = float(np.trapezoid(force[dwell], stroke[dwell]))
    return _area_J(loop, loop.loading) + rest + _area_J(loop, loop.unloading) + float(chord)


def _area_J(loop: Loop, part: slice) -> float:  # noqa: N802
    time_s, stroke_mm, force_kN = (a[None, part] for a in (loop.time_s, loop.stroke_mm, loop.force_kN))
    count = np.array([time_s.size])
    return float(Branches(time_s, stroke_mm, force_kN, count, loop.averaged).areas()[0])


def _by_window(count: NDArray[np.intp], share: float) -> list[tuple[int, slice | NDArray[np.intp]]]:
    """Return the windows of a share of a branch's points and the rows they are for; 0: too few points."""
    window = np.maximum(LEAST_WINDOW, 2 * (0.5 * share * count).astype(int) + 1)
    window[count < window] = 0
    sizes = np.unique(window).tolist()
    if len(sizes) == 1:
        return [(sizes[0], slice(None))]
    return [(size, np.flatnonzero(window == size)) for size in sizes]


def branch_speeds_mm_per_s(branch: Branches) -> FloatArray:
    """Return the largest absolute speed of branches from their smoothed derivative; NaN below 5 points."""
    speed = np.full(branch.count.size, np.nan)
    for window, rows in _by_window(branch.count, SPEED_WINDOW):
        if not window:
            continue
        count = branch.count[rows]
        lines = np.arange(count.size)
        time = branch.time_s[rows]
        step = (time[lines, count - 1] - time[:, 0]) / (count - 1)
        even = _on_even_times(time, branch.stroke_mm[rows], count, step)
        slope = moving_slopes(even, count, window)
        speed[rows] = np.maximum(np.max(slope, axis=1), -np.min(slope, axis=1)) / step
    return speed


def _on_even_times(
    time_s: FloatArray, value: FloatArray, count: NDArray[np.intp], step_s: FloatArray
) -> FloatArray:
    """Return each row on as many even moments, by straight lines; its last value behind them."""
    place = time_s - time_s[:, :1]
    place /= step_s[:, None]
    order = np.arange(time_s.shape[1])
    ragged = int(np.min(count))
    behind = order[ragged:] >= count[:, None]
    place[:, ragged:] = np.where(behind, order[ragged:], place[:, ragged:])
    # Where samples are even, the moment number k lies within a step of point k: no search is needed.
    off = place - order
    if max(np.max(off), -np.min(off)) < 1.0:
        return _beside(place, value, off)
    rows = 2.0 * order.size * np.arange(time_s.shape[0])[:, None]
    moments = np.minimum(order, (count - 1)[:, None])
    even = np.interp((moments + rows).ravel(), (place + rows).ravel(), value.ravel())
    return np.asarray(even.reshape(value.shape), dtype=np.float64)


def _beside(place: FloatArray, value: FloatArray, off: FloatArray) -> FloatArray:
    """Return values at moments 0, 1, 2 … of rows whose point k lies less than 1 from moment k."""
    slope = np.diff(value, axis=1)
    slope /= np.diff(place, axis=1)
    even = value.copy()
    moved = np.minimum(off[:, :-1], 0.0)
    moved *= slope
    even[:, :-1] -= moved
    np.maximum(off[:, 1:], 0.0, out=moved)
    moved *= slope
    even[:, 1:] -= moved
    return even


def _window(inside: BoolArray) -> slice:
    """Return the columns that hold all of what is inside."""
    columns = np.flatnonzero(inside.any(axis=0))
    return slice(int(columns[0]), int(columns[-1]) + 1) if columns.size else slice(0, 1)


def local_slopes(branch: Branches, stroke_mm: FloatArray, half_width_mm: FloatArray) -> FloatArray:
    """Return the slope of branches at a stroke each [kN/mm], shape (R,).

    A cubic of force over stroke within ± ``half_width_mm`` (cut at the branch's ends) is read at
    ``stroke_mm``; NaN when the branch does not reach it or too few points lie in the window.
    """
    lines = np.arange(branch.count.size)
    ends = branch.stroke_mm[:, 0], branch.stroke_mm[lines, branch.count - 1]
    reached = (ends[0] <= stroke_mm) & (stroke_mm <= ends[1])
    inside = branch.stroke_mm >= (stroke_mm - half_width_mm)[:, None]
    inside &= branch.stroke_mm <= (stroke_mm + half_width_mm)[:, None]
    inside &= branch.used
    part = _window(inside)
    z = (branch.stroke_mm[:, part] - stroke_mm[:, None]) / half_width_mm[:, None]
    fits = reached & (np.count_nonzero(inside[:, part], axis=1) >= 5)
    found = polynomials(z, branch.force_kN[:, part], inside[:, part] & fits[:, None], 3)
    return np.where(fits, found[:, 1] / half_width_mm, np.nan)


def slopes_between(branch: Branches, first_mm: FloatArray, last_mm: FloatArray) -> FloatArray:
    """Return the slope of lines through branches between two strokes; NaN where there is too little."""
    inside = (branch.stroke_mm >= first_mm[:, None]) & (branch.stroke_mm <= last_mm[:, None])
    inside &= branch.used
    part = _window(inside)
    own, stroke, width = inside[:, part], branch.stroke_mm[:, part], last_mm - first_mm
    reach = np.max(np.where(own, stroke, -np.inf), axis=1) - np.min(np.where(own, stroke, np.inf), axis=1)
    fits = (np.count_nonzero(own, axis=1) >= _FEWEST_SLOPE) & (reach >= 0.5 * width)
    z = (stroke - first_mm[:, None]) / np.where(width > 0.0, width, 1.0)[:, None]
    found = polynomials(z, branch.force_kN[:, part], own & fits[:, None], 1)
    return np.where(fits, found[:, 1] / np.where(width > 0.0, width, 1.0), np.nan)


def first_harmonic(record: Record, cycle: Cycle) -> complex:
    """Return K* = K′ + i K″ of one cycle [kN/mm], the ratio of the first harmonics of force and stroke."""
    return complex(spectra(record, [cycle]).first_harmonic()[0])
