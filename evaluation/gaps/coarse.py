"""Cycles of few samples: what lies between these may change as much as a hole does.

A preload that is taken up, a force that jumps where the stroke turns, a corner of the stroke lie anywhere
between two samples. How much of a figure hangs on that is shown by the record itself, read once with every
second sample and once with the others. Where a jump lies in one step, the two differ by as much as it can be
wrong by. What both have in common is the error of an interpolation, and grows with a power of the step, which
every third sample shows. So it is in a record that is written by event, however many samples it has: a
turning point lies up to an event beyond the last of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from evaluation.motion import Cycle
from evaluation.record import Record
from evaluation.results import CycleResult
from evaluation.reversals import noise_sigma

FEW_SAMPLES = 250
"""Cycles of fewer samples are looked at: in others a step is too short to matter."""
_TURNS_SAMPLES = 100
"""A cycle of so many shows its turning points: how blunt they may be between samples is in the u of each."""
_ORDERS = np.linspace(1.0, 4.0, 61)
"""Powers of the step that an error may go with: of a jump, up to that of a spline through a smooth curve."""


def halves_bound(even: float, odd: float, share: float) -> float:
    """Return the bound of a figure by its changes when it is read from every second sample, and the others.

    The larger one of ``share`` (:func:`share_of_step`) of what both have in common and half their difference.
    """
    common, apart = 0.5 * (even + odd) * share, 0.5 * (even - odd)
    return common if abs(common) >= abs(apart) else apart


def share_of_step(second: float, third: float) -> float:
    """Return the error at a step as a share of what doubling it changes: 1 / (2ᵖ - 1).

    If errors go with the p-th power of the step, steps of three change (3ᵖ - 1) / (2ᵖ - 1) times as much as
    steps of two. As steps get shorter p does not fall: corners and recoveries are resolved.

    Parameters
    ----------
    second, third : float
        Changes by steps of two and of three.
    """
    if second <= 0.0 or not np.isfinite(third):
        return 1.0
    ratio = (3.0**_ORDERS - 1.0) / (2.0**_ORDERS - 1.0)
    order = float(np.interp(third / second, ratio, _ORDERS))
    return float(1.0 / (2.0**order - 1.0))


def coarse_cycles(record: Record, results: Sequence[CycleResult]) -> dict[int, float]:
    """Return the complete cycles that have few samples, by number, and how far these are apart [s].

    Of a record that is written by event, or whose force was interpolated between readings of its own, all.

    Parameters
    ----------
    record : Record
    results : sequence of CycleResult
        Of that record.
    """
    if record.averaged > 1 and record.between is None:
        return {}
    whole = [result.cycle for result in results if result.cycle.complete]
    ends = np.array([(cycle.start_s, cycle.end_s) for cycle in whole]).reshape(-1, 2)
    first, last = np.searchsorted(record.time_s, ends.T)
    return {
        cycle.index: cycle.duration_s / max(1, count)
        for cycle, count in zip(whole, (last - first).tolist(), strict=True)
        if count < FEW_SAMPLES or record.by_event or record.between is not None
    }


def shows_turns(record: Record, cycle: Cycle, step_s: float) -> bool:
    """Say whether the u of a cycle's turning points holds what lies between samples ``step_s`` apart."""
    return not record.by_event and cycle.duration_s >= _TURNS_SAMPLES * step_s


def one_of(record: Record, several: int, first: int, *, thinned: bool) -> Record:
    """Return the record with one of ``several`` samples, from ``first`` on; all where it is not ``thinned``.

    Where the force was interpolated between readings of its own, one of so many of these makes it.
    """
    if record.between is not None:
        force_kN = record.force_kN + record.between.by_one_of(several, first, record.time_s)
        record = replace(record, force_kN=force_kN)
    if not thinned:
        return record
    samples = np.arange(record.time_s.size)
    return without(record, np.asarray(samples[samples % several != first], dtype=np.intp))


def is_few(record: Record, cycle: Cycle, step_s: float) -> bool:
    """Say whether a cycle has few samples, ``step_s`` apart, or those of a log by event."""
    return record.averaged == 1 and (record.by_event or cycle.duration_s < FEW_SAMPLES * step_s)


def without(record: Record, lost: NDArray[np.intp]) -> Record:
    """Return the record without some samples; its first and last one stay."""
    keep = np.ones(record.time_s.size, dtype=bool)
    keep[lost] = False
    keep[[0, -1]] = True
    kept = np.flatnonzero(keep)
    return replace(
        record,
        time_s=record.time_s[kept],
        stroke_mm=record.stroke_mm[kept],
        force_kN=record.force_kN[kept],
        speed_mm_per_s=None,
        wire_difference_mm=None,
        breaks=tuple(np.searchsorted(kept, record.breaks).tolist()),
    )


def energy_noise_J(record: Record, cycle: Cycle) -> float:  # noqa: N802 - the unit keeps its capital
    """Return what the noise of both channels makes of a cycle's energy, as one u [J].

    Of the polygon through its samples, Σ Fᵢ (xᵢ₊₁ - xᵢ₋₁) / 2.
    """
    inside = slice(*np.searchsorted(record.time_s, (cycle.start_s, cycle.end_s)).tolist())
    by_force, by_stroke = (
        noise_sigma(noisy) * float(np.linalg.norm(np.gradient(other[inside])))
        for noisy, other in (
            (record.force_kN, record.stroke_mm),
            (record.stroke_mm, record.force_kN),
        )
    )
    return float(np.hypot(by_force, by_stroke))
