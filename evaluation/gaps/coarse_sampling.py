"""Cycles of few samples: bounds for what lies between them.

A preload that is taken up, a force that jumps where the stroke turns, a corner of the stroke lie anywhere
between two samples. How much of a figure hangs on that is shown by the record itself, read once with every
second sample and once with the others. Where a jump lies in one step, the two differ by as much as it can be
wrong by. What both have in common is the error of an interpolation, which grows with the step. Where the
samples show a smooth curve, it grows with the fourth power. So it is in a record that is written by event,
however many samples it has: a turning point lies up to an event beyond the last of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Cycle, CycleResult
from bufferstand.evaluation.numerics import noise_sigma
from bufferstand.evaluation.record import Record
from bufferstand.foundation.numbers import median

FEW_SAMPLES = 250
"""Cycles of fewer samples are looked at: in others a step is too short to matter."""
_SMALL, _NOISY = 0.11, 3.0 * float(np.sqrt(70.0))
"""Fourth differences are small up to this share of second ones, and three times what noise makes of them …"""
_SINE_SAMPLES = 19
"""… which is not to be told in cycles of fewer samples: (2π / 19)² is 0.11."""
_LEAST_STEPS, _EVEN = 8, 1.2
_TURNS_SAMPLES = 100
"""A cycle of so many shows its turning points: how blunt they may be between samples is in the u of each."""
_SAME_RANGE = 0.1
"""Ranges are the same that differ by no more than this share."""
SMOOTH_SHARE = 1.0 / 15.0
"""Between samples that show a smooth curve a spline's error goes with the fourth power of the step: e of a
step, 16 e of a step of two, of which the difference is seen."""


def halves_bound(even: float, odd: float, share: float) -> float:
    """Return the bound of a figure by its changes when it is read from every second sample, and the others.

    So much (``share``) of the larger one of what both have in common and half their difference.
    """
    common, apart = 0.5 * (even + odd), 0.5 * (even - odd)
    return share * (common if abs(common) >= abs(apart) else apart)


def is_resolved(record: Record, cycles: Sequence[Cycle]) -> bool:
    """Say whether samples show their curves: fourth differences are small beside second ones, but for noise.

    Of a sine of n samples a cycle they are (2π / n)² of these; at a jump or a corner they are larger.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        That are looked at.
    """
    start_s, end_s = min(cycle.start_s for cycle in cycles), max(cycle.end_s for cycle in cycles)
    inside = slice(*np.searchsorted(record.time_s, (start_s, end_s)).tolist())
    step = np.diff(record.time_s[inside])
    if step.size < _LEAST_STEPS or np.max(step) > _EVEN * np.min(step):
        return False
    if min(cycle.duration_s for cycle in cycles) < _SINE_SAMPLES * median(step):
        return False
    return all(
        float(np.max(np.abs(np.diff(values[inside], 4))))
        <= _SMALL * float(np.max(np.abs(np.diff(values[inside], 2)))) + _NOISY * noise_sigma(values)
        for values in (record.stroke_mm, record.force_kN)
    )


def no_less_than_usual(
    bounds: Mapping[int, Mapping[str, float]], range_mm: Mapping[int, float]
) -> dict[int, dict[str, float]]:
    """Return bounds of which none is less than the median of its figure among cycles of the same range.

    That both halves of a cycle's samples agree, and all of them do not, happens by chance.

    Parameters
    ----------
    bounds : mapping of int to mapping
        By cycle and figure.
    range_mm : mapping of int to float
        By cycle.
    """
    alike: dict[int, list[int]] = {}
    for index in bounds:
        alike.setdefault(round(float(np.log(range_mm[index])) / _SAME_RANGE), []).append(index)
    found = {}
    for cycles in alike.values():
        names = set.intersection(*(set(bounds[index]) for index in cycles))
        usual = {name: median([abs(bounds[index][name]) for index in cycles]) for name in names}
        for index in cycles:
            found[index] = {
                name: float(np.copysign(max(abs(bound), usual.get(name, 0.0)), bound))
                for name, bound in bounds[index].items()
            }
    return found


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


def half_of(record: Record, first: int, *, thinned: bool) -> Record:
    """Return the record with every second sample, from ``first`` on; all where it is not ``thinned``.

    Where the force was interpolated between readings of its own, every second one of these makes it.
    """
    if record.between is not None:
        record = replace(record, force_kN=record.force_kN + record.between.at(first, record.time_s))
    if not thinned:
        return record
    return without(record, np.arange(1 - first, record.time_s.size, 2))


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
