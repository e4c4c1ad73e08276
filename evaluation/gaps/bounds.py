"""What a hole may change: found by making it larger.

What lies in a hole is interpolated, and an interpolation's error grows with the hole: in proportion where
the hole hides a corner, with its third power or more where the curve is smooth. So each hole of a record is
widened by half its length to both sides, with samples that are known, and the record is evaluated once more:
what a figure changes by bounds what the hole itself can have changed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from evaluation.cycles import find_with_harmonics
from evaluation.gaps.bridge import Hole
from evaluation.motion import Cycle, TurningPoint
from evaluation.quantities import evaluate_cycles
from evaluation.record import Record
from evaluation.results import CycleResult

WIDER = 0.5
"""A hole is widened by this share of its length to either side, at least by one sample."""
SURE = 1.5
"""Times the change is the bound: a corner in the middle of a hole changes by as much as it may have."""
MOST_ENERGY, MOST_STROKE = 5e-3, 1e-3
"""A cycle is evaluated while the bound is no more than this share of W_a, and of the stroke's range."""
_NOISE = 2.0
"""What so many standard uncertainties of a turning point explain is in its uncertainty already."""
_BESIDE = 0.5
"""The fit of a turning point reaches so far beyond it, as a share of the cycle's length."""
_SAME_CYCLE = 0.25
_LEFT_OUT = frozenset(("temperature_start_C", "temperature_max_C"))


@dataclass(frozen=True, eq=False)
class GapBounds:
    """What the holes of a record may change.

    Attributes
    ----------
    limits : mapping of int to mapping
        By cycle: the bound of each figure by name, with the sign of the change.
    refused : mapping of int to str
        Cycles that the bounds are too large for, and why.
    holes : mapping of int to tuple of Hole
        What is bridged in each cycle.
    widened : Record or None, cycles : mapping of int to Cycle
        The record with its holes widened, and the same cycles in it.
    """

    limits: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    refused: Mapping[int, str] = field(default_factory=dict)
    holes: Mapping[int, tuple[Hole, ...]] = field(default_factory=dict)
    widened: Record | None = None
    cycles: Mapping[int, Cycle] = field(default_factory=dict)

    def without(self, cycles: Sequence[Cycle]) -> tuple[Cycle, ...]:
        """Return the cycles, those that the bounds are too large for no longer complete."""
        return tuple(
            cycle._replace(complete=False, steady=False, bounded=False, why=(self.refused[cycle.index],))
            if cycle.index in self.refused
            else cycle
            for cycle in cycles
        )


def gap_bounds(record: Record, holes: Sequence[Hole], results: Sequence[CycleResult]) -> GapBounds:
    """Return what bridged holes may change in the figures of complete cycles.

    Parameters
    ----------
    record : Record
        Bridged (:func:`evaluation.gaps.bridge.bridged`).
    holes : sequence of Hole
    results : sequence of CycleResult
        Of that record.

    Returns
    -------
    GapBounds
        Empty where nothing is bridged in a complete cycle.
    """
    narrow = [hole for hole in holes if not (hole.rest or hole.wide)]
    own = _holes_of(narrow, results)
    if not own:
        return GapBounds()
    short = _widened(record, narrow)
    cycles, first = find_with_harmonics(short)
    others = evaluate_cycles(short, cycles, first)
    middles = np.array([0.5 * (other.cycle.start_s + other.cycle.end_s) for other in others])
    limits, refused, same = {}, {}, {}
    for result in results:
        index = result.cycle.index
        if index not in own:
            continue
        other = _same_cycle(result.cycle, others, middles)
        if other is None:
            refused[index] = _refused(own[index], "hide a turning point")
            continue
        same[index] = other.cycle._replace(index=index)
        limits[index] = _limits(result, other)
        if why := _too_much(result, limits[index]):
            refused[index] = _refused(own[index], why)
    return GapBounds(limits, refused, own, short, same)


def _refused(holes: Sequence[Hole], why: str) -> str:
    more = f" and {len(holes) - 1} more" if len(holes) > 1 else ""
    return f"what is not on record of it may {why}: {holes[0].text}{more}"


def _holes_of(holes: Sequence[Hole], results: Sequence[CycleResult]) -> dict[int, tuple[Hole, ...]]:
    """Return the holes in or near each complete cycle that has some."""
    starts = np.array([hole.start_s for hole in holes])
    ends = np.array([hole.end_s for hole in holes])
    own = {}
    for result in results:
        cycle = result.cycle
        if not cycle.complete:
            continue
        beside_s = _BESIDE * cycle.duration_s
        first = int(np.searchsorted(ends, cycle.start.time_s - beside_s, side="right"))
        last = int(np.searchsorted(starts, cycle.end.leave_s + beside_s))
        if first < last:
            own[cycle.index] = tuple(holes[first:last])
    return own


def _widened(record: Record, holes: Sequence[Hole]) -> Record:
    """Return the record without the samples beside its holes; its first and last sample stay."""
    keep = np.ones(record.time_s.size, dtype=bool)
    starts = np.array([hole.start_s for hole in holes])
    ends = np.array([hole.end_s for hole in holes])
    more_s = WIDER * (ends - starts)
    first = np.searchsorted(record.time_s, starts - more_s, side="right")
    before = np.searchsorted(record.time_s, starts)
    after = np.searchsorted(record.time_s, ends)
    last = np.searchsorted(record.time_s, ends + more_s)
    for a, b, c, d in zip(
        np.minimum(first, before).tolist(),
        before.tolist(),
        after.tolist(),
        np.maximum(last, after + 1).tolist(),
        strict=True,
    ):
        keep[a : b + 1] = keep[c:d] = False
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


def _same_cycle(
    cycle: Cycle, others: Sequence[CycleResult], middles: NDArray[np.float64]
) -> CycleResult | None:
    """Return the complete one of other cycles that lies where a cycle does."""
    if not middles.size:
        return None
    at = int(np.argmin(np.abs(middles - 0.5 * (cycle.start_s + cycle.end_s))))
    near = abs(middles[at] - 0.5 * (cycle.start_s + cycle.end_s)) < _SAME_CYCLE * cycle.duration_s
    return others[at] if near and others[at].cycle.complete else None


def _limits(result: CycleResult, other: CycleResult) -> dict[str, float]:
    """Return the bounds of a cycle's figures: their changes, but for what noise explains of a stroke's."""
    one, two = result.quantities._asdict(), other.quantities._asdict()
    limits = {
        name: SURE * (two[name] - value)
        for name, value in one.items()
        if name not in _LEFT_OUT and value is not None and two[name] is not None
    }
    a, b = result.cycle, other.cycle
    turns = {
        "stroke_min_mm": _moved_mm(a.start, b.start, b.stroke_min_mm - a.stroke_min_mm),
        "stroke_max_mm": _moved_mm(a.top, b.top, b.stroke_max_mm - a.stroke_max_mm),
    }
    low, high = turns.values()
    return limits | turns | {"prestress_mm": 0.5 * (low + high), "amplitude_mm": 0.5 * (high - low)}


def _moved_mm(one: TurningPoint, other: TurningPoint, by_mm: float) -> float:
    """Return the bound of a turning point by its change, less what the noise of the fits explains."""
    explained = _NOISE * max(one.u_stroke_mm, other.u_stroke_mm)
    return float(np.sign(by_mm)) * SURE * max(0.0, abs(by_mm) - explained)


def _too_much(result: CycleResult, limits: Mapping[str, float]) -> str:
    """Return why a cycle is not evaluated, or nothing."""
    energy_J = result.quantities.absorbed_energy_J
    if energy_J is None:
        return ""
    energy = abs(limits.get("absorbed_energy_J", np.inf)) / abs(energy_J) if energy_J else np.inf
    range_mm = result.cycle.range_mm
    end_mm = limits["stroke_min_mm"], limits["stroke_max_mm"]
    stroke = max(map(abs, end_mm)) / range_mm
    parts = []
    if energy > MOST_ENERGY:
        parts.append(
            f"change its absorbed energy by {100.0 * energy:.2g} % (more than {100.0 * MOST_ENERGY:g} %)"
        )
    if stroke > MOST_STROKE:
        parts.append(f"change its stroke by {100.0 * stroke:.2g} % (more than {100.0 * MOST_STROKE:g} %)")
    return " and ".join(parts)
