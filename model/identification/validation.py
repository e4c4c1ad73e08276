"""How well a fitted model agrees with the measurement: cycle by cycle, and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.identification.drive import Drive
from bufferstand.model.identification.fitting import Solution
from bufferstand.model.identification.problem import Experiment
from bufferstand.model.identification.response import Answer

Floats = NDArray[np.float64]
Places = NDArray[np.intp]

_LEAST_NODES = 6
_CLOSED = 0.05
"""A cycle is closed if its ends agree within this share of its range; ramps in and out are none."""


@dataclass(frozen=True)
class CycleCheck:
    """One cycle as measured and as predicted, over the same strokes.

    Attributes
    ----------
    run : str
    start_s : float
    stroke_mm : tuple of float
        Least and largest stroke.
    damping, predicted_damping : float
        Absorbed by stored energy.
    peak_force_kN, predicted_peak_force_kN : float
    rms_kN, worst_kN : float
        Root mean square and largest difference of the forces.
    temperature_C : float
        By the model, at the cycle's end.
    """

    run: str
    start_s: float
    stroke_mm: tuple[float, float]
    damping: float
    predicted_damping: float
    peak_force_kN: float
    predicted_peak_force_kN: float
    rms_kN: float
    worst_kN: float
    temperature_C: float


def cycles_of(drive: Drive) -> list[Places]:
    """Return the measured nodes (places in ``drive.node``) of each cycle: a loading, an unloading."""
    half = drive.half[drive.node]
    starts = np.flatnonzero(np.diff(half, prepend=-1))
    groups = np.split(np.arange(half.size), starts[1:]) if half.size else []
    stroke = drive.stroke_mm[drive.node]
    moving = [g for g in groups if g.size >= 3 and np.ptp(stroke[g]) > 1.0]
    rising = [bool(stroke[g[-1]] > stroke[g[0]]) for g in moving]
    pairs = [
        np.concatenate([moving[i], moving[i + 1]])
        for i in range(len(moving) - 1)
        if rising[i] and not rising[i + 1] and half[moving[i + 1][0]] == half[moving[i][0]] + 1
    ]
    return [pair for pair in pairs if _closes(stroke[pair])]


def _closes(stroke: Floats) -> bool:
    """Say whether a cycle ends where it began; nodes are coarser there than the turns themselves."""
    return bool(abs(stroke[-1] - stroke[0]) < max(_CLOSED * np.ptp(stroke), 1.0))


def check_cycles(experiment: Experiment, given: Answer) -> list[CycleCheck]:
    """Return each cycle whose forces all count, measured and predicted over the same nodes."""
    drive = experiment.drive
    found = []
    for cycle in cycles_of(drive):
        nodes = cycle[experiment.used[cycle]]
        if nodes.size < max(_LEAST_NODES, 0.8 * cycle.size):
            continue
        at = drive.node[nodes]
        x, measured, predicted = drive.stroke_mm[at], drive.force_kN[nodes], given.force_kN[at]
        rest = predicted - measured
        found.append(
            CycleCheck(
                run=drive.name_at(float(drive.time_s[at[0]])),
                start_s=float(drive.time_s[at[0]]),
                stroke_mm=(float(x.min()), float(x.max())),
                damping=_damping(x, measured),
                predicted_damping=_damping(x, predicted),
                peak_force_kN=float(measured.max()),
                predicted_peak_force_kN=float(predicted.max()),
                rms_kN=float(np.sqrt(np.mean(rest**2))),
                worst_kN=float(np.max(np.abs(rest))),
                temperature_C=float(given.temperature_C[at[-1]]),
            )
        )
    return found


def _damping(x: Floats, force: Floats) -> float:
    work = 0.5 * (force[1:] + force[:-1]) * np.diff(x)
    stored = float(np.sum(work[work > 0.0]))
    return float(np.sum(work)) / stored if stored > 0.0 else 0.0


def quality(solution: Solution, checks: Sequence[CycleCheck]) -> list[str]:
    """Return what a reader must know about how well the model follows, if anything."""
    notes = []
    if solution.correlation > 1.5:
        notes.append(
            f"the residuals run along together (variances widened {solution.correlation:.3g}-fold): "
            "the model misses something systematic, and the intervals are as honest as that allows"
        )
    if checks:
        span = max(check.peak_force_kN for check in checks)
        worst = max(checks, key=_rms)
        if worst.rms_kN > 0.01 * span:
            notes.append(
                f"the worst cycle ({worst.run or 'run'} at {worst.start_s:.1f} s) is missed by "
                f"{worst.rms_kN:.3g} kN rms, more than 1 % of the range"
            )
    return notes


def _rms(check: CycleCheck) -> float:
    return check.rms_kN
