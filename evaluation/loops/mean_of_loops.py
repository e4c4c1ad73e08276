"""The mean loop of a run, for comparisons; small enough to be stored for each of ten thousand runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bufferstand.evaluation.facts import CycleResult, MeanLoop
from bufferstand.evaluation.loops.cut import CutLoops
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Record

POINTS = 400
"""Strokes at which both branches are read, evenly spaced: areas are right to 1 part in 10 000."""


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
