"""The mean loop of a run, for comparisons; small enough to be stored for each of ten thousand runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bufferstand.evaluation.loops import CutLoops
from bufferstand.evaluation.record import FloatArray, Record
from bufferstand.evaluation.results import CycleResult

TURN = 0.2
"""The turn of a loop is looked for within this share of its range below the top."""

POINTS = 400
"""Strokes at which both branches are read, evenly spaced: areas are right to 1 part in 10 000."""


@dataclass(frozen=True, eq=False)
class MeanLoop:
    """Mean of both branches over the cycles that represent a run.

    Attributes
    ----------
    cycles : tuple of int
    stroke_mm, loading_kN, unloading_kN : arrays, shape (M,)
        Over the range that all of those cycles cover, rising in stroke.
    temperature_C : float or None
        Mean temperature at the start of the cycles.
    temperature_accuracy_C : float or None
        Limit of the error of the specimen's sensors.
    means, expanded_uncertainties : mapping
        Means of the cycles' figures, and of their U, by name; only what is known.
    """

    cycles: tuple[int, ...]
    stroke_mm: FloatArray
    loading_kN: FloatArray
    unloading_kN: FloatArray
    temperature_C: float | None
    temperature_accuracy_C: float | None
    means: Mapping[str, float]
    expanded_uncertainties: Mapping[str, float]

    def cut(self, first_mm: float, last_mm: float) -> MeanLoop:
        """Return the loop between two strokes of its range, as if it had turned at the upper one.

        After a turn the force falls to the unloading curve within a few millimetres. A loop that reaches
        further has done so before it comes back to the cut; its own turn (unloading over loading force, by
        distance from its top) is moved to the cut, or the area would be too large by that corner.
        """
        inner = self.stroke_mm[(self.stroke_mm > first_mm) & (self.stroke_mm < last_mm)]
        stroke = np.concatenate(([first_mm], inner, [last_mm]))
        loading = np.interp(stroke, self.stroke_mm, self.loading_kN)
        unloading = np.interp(stroke, self.stroke_mm, self.unloading_kN)
        shift_mm = float(self.stroke_mm[-1]) - last_mm
        near = stroke >= last_mm - TURN * (last_mm - first_mm)
        if shift_mm > 0.0 and np.all(loading[near] > 0.0):
            share = self.unloading_kN / np.where(self.loading_kN > 0.0, self.loading_kN, np.inf)
            turned = loading * np.interp(stroke + shift_mm, self.stroke_mm, share)
            unloading = np.where(near, np.maximum(unloading, turned), unloading)
        return replace(self, stroke_mm=stroke, loading_kN=loading, unloading_kN=unloading)

    @property
    def end_force_kN(self) -> float:  # noqa: N802 - the unit keeps its capitals
        """Force of the loading branch at its end [kN]."""
        return float(self.loading_kN[-1])

    @property
    def stored_energy_J(self) -> float:  # noqa: N802
        """Area under the loading branch [J]."""
        return float(np.trapezoid(self.loading_kN, self.stroke_mm))

    @property
    def absorbed_energy_J(self) -> float:  # noqa: N802
        """Area between the branches [J]."""
        return float(np.trapezoid(self.loading_kN - self.unloading_kN, self.stroke_mm))


def mean_loop(
    record: Record, results: Sequence[CycleResult], used: Sequence[int], loops: CutLoops
) -> MeanLoop | None:
    """Return the mean loop over the cycles used, or over the complete ones where none is steady.

    None where no cycle is complete or they have no common range.

    Parameters
    ----------
    record : Record
    results : sequence of CycleResult
    used : sequence of int
        Numbers of the cycles that represent the run.
    loops : CutLoops
        Those of the complete cycles.
    """
    complete = [r for r in results if r.cycle.complete]
    wanted = set(used)
    chosen = [r for r in complete if r.cycle.index in wanted] or complete
    if not chosen:
        return None
    # Ten cycles say what all do, and keep long records cheap.
    chosen = [chosen[i] for i in np.unique(np.linspace(0, len(chosen) - 1, 10).round().astype(int))]
    first = max(max(r.cycle.stroke_min_mm, r.cycle.stroke_end_mm) for r in chosen)
    last = min(r.cycle.stroke_max_mm for r in chosen)
    if last <= first:
        return None
    stroke = np.linspace(first, last, POINTS)
    up, down = np.zeros(POINTS), np.zeros(POINTS)
    branches = loops.branches_of([result.cycle for result in chosen])
    for loading, unloading in branches:
        _, rising_mm, force_kN = loading
        up += _read(stroke, rising_mm, force_kN)
        down += _read(stroke, unloading[1, ::-1], unloading[2, ::-1])
    starts = [r.quantities.temperature_start_C for r in chosen]
    known = [value for value in starts if value is not None]
    accuracies = [s.accuracy_C for s in record.temperatures if s.role == "specimen"]
    stated = [value for value in accuracies if value is not None]
    return MeanLoop(
        cycles=tuple(r.cycle.index for r in chosen),
        stroke_mm=stroke,
        loading_kN=up / len(chosen),
        unloading_kN=down / len(chosen),
        temperature_C=float(np.mean(known)) if known else None,
        temperature_accuracy_C=max(stated) if stated and len(stated) == len(accuracies) else None,
        means=_means([r.quantities._asdict() for r in chosen]),
        expanded_uncertainties=_means([r.expanded_uncertainty for r in chosen]),
    )


def _means(figures: Sequence[Mapping[str, float | None]]) -> dict[str, float]:
    """Return the mean of every figure that all of them have."""
    result = {}
    for name in figures[0]:
        values = [own.get(name) for own in figures]
        known = [value for value in values if value is not None]
        if len(known) == len(values):
            result[name] = sum(known) / len(known)
    return result


def _read(at_mm: FloatArray, stroke_mm: FloatArray, force_kN: FloatArray) -> FloatArray:
    order = np.argsort(stroke_mm, kind="stable")  # noise may make a slow branch step back by a sample
    return np.asarray(np.interp(at_mm, stroke_mm[order], force_kN[order]), dtype=np.float64)
