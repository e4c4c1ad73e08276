"""Bounds for what a hole may change, found by making it larger.

What lies in a hole is interpolated, and an interpolation's error grows with the hole: in proportion where
the hole hides a corner, with its third power or more where the curve is smooth. So each hole of a record is
widened by half its length to both sides, with samples that are known, and the record is evaluated once more:
what a figure changes by bounds what the hole itself can have changed. Where that is too much, and the run has
cycles like this one that lack nothing, the same hole is opened in them: what it changes there is the bound.

Between the readings of a force that was brought to the stroke's instants, it is the same: the record is
evaluated once more with what every second reading gives (:mod:`bufferstand.evaluation.loading.resample`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.catalogue import OF_THERMOMETER, QUANTITIES
from bufferstand.evaluation.cycles import find_with_harmonics
from bufferstand.evaluation.facts import Cycle, CycleResult, TurningPoint
from bufferstand.evaluation.gaps.bridging import RecordGap
from bufferstand.evaluation.gaps.coarse_sampling import (
    SMOOTH_SHARE,
    coarse_cycles,
    energy_noise_J,
    half_of,
    halves_bound,
    is_few,
    is_resolved,
    no_less_than_usual,
    shows_turns,
    without,
)
from bufferstand.evaluation.gaps.like_cycles import choose_donors, opened
from bufferstand.evaluation.quantities import evaluate_cycles
from bufferstand.evaluation.record import Record

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
_LEFT_OUT = frozenset(OF_THERMOMETER.names)


@dataclass(frozen=True, eq=False)
class Reduced:
    """A record with fewer samples, and the same cycles in it, by number."""

    record: Record
    cycles: Mapping[int, Cycle]


@dataclass(frozen=True, eq=False)
class GapBounds:
    """What is not on record of a run's cycles may change.

    Attributes
    ----------
    limits : mapping of int to mapping
        By cycle: the bound of each figure by name, with the sign of the change.
    refused : mapping of int to str
        Cycles that the bounds are too large for, and why.
    holes : mapping of int to tuple of Hole
        What is bridged in each cycle.
    widened : Reduced or None
        The record with its holes widened.
    halves : tuple of Reduced
        Every second sample of it, and the others; none where all cycles have enough.
    share : float
        So much of what these change counts.
    """

    limits: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    refused: Mapping[int, str] = field(default_factory=dict)
    holes: Mapping[int, tuple[RecordGap, ...]] = field(default_factory=dict)
    widened: Reduced | None = None
    halves: tuple[Reduced, ...] = ()
    share: float = 1.0

    def without(self, cycles: Sequence[Cycle]) -> tuple[Cycle, ...]:
        """Return the cycles, those that the bounds are too large for no longer complete."""
        return tuple(
            cycle._replace(complete=False, steady=False, bounded=False, why=(self.refused[cycle.index],))
            if cycle.index in self.refused
            else cycle
            for cycle in cycles
        )


def gap_bounds(record: Record, holes: Sequence[RecordGap], results: Sequence[CycleResult]) -> GapBounds:
    """Return what bridged holes, and steps between few samples, may change in the figures of complete cycles.

    Parameters
    ----------
    record : Record
        Bridged (:func:`bufferstand.evaluation.gaps.bridging.bridged`).
    holes : sequence of Hole
    results : sequence of CycleResult
        Of that record.

    Returns
    -------
    GapBounds
        Empty where nothing is bridged or interpolated in a complete cycle.
    """
    by_holes = _hole_bounds(record, [hole for hole in holes if not (hole.rest or hole.wide)], results)
    coarse = coarse_cycles(record, results)
    for index in by_holes.refused:
        coarse.pop(index, None)
    return _with_coarse(record, results, coarse, by_holes) if coarse else by_holes


def _with_coarse(
    record: Record, results: Sequence[CycleResult], coarse: Mapping[int, float], by_holes: GapBounds
) -> GapBounds:
    """Return the bounds with what lies between the samples of cycles that have few, ``coarse`` [s] apart."""
    looked_at = [result for result in results if result.cycle.index in coarse]
    thinned = any(is_few(record, result.cycle, coarse[result.cycle.index]) for result in looked_at)
    pair = _Halves.of(record, thinned=thinned)
    smooth = not record.by_event and is_resolved(record, [result.cycle for result in looked_at])
    share = SMOOTH_SHARE if smooth else 1.0
    limits, refused = dict(by_holes.limits), dict(by_holes.refused)
    same: tuple[dict[int, Cycle], dict[int, Cycle]] = ({}, {})
    found: dict[int, dict[str, float]] = {}
    for result in looked_at:
        index, others = result.cycle.index, pair.same(result.cycle)
        if others is None:
            refused[index] = _between_what(record, coarse[index], "hide a turning point")
            continue
        for cycles, other in zip(same, others, strict=True):
            cycles[index] = other.cycle._replace(index=index)
        found[index] = _halved_limits(result, others, share)
        if shows_turns(record, result.cycle, coarse[index]):
            found[index] |= {**_by_turns(0.0, 0.0), "frequency_Hz": 0.0}
    found = no_less_than_usual(found, {r.cycle.index: r.cycle.range_mm for r in looked_at})
    for result in (result for result in looked_at if result.cycle.index in found):
        index = result.cycle.index
        limits[index] = _both(limits.get(index, {}), found[index])
        noise_J = _noise_J(record, result.cycle, coarse[index], smooth=smooth)
        if why := _too_much(result, limits[index], noise_J):
            refused[index] = _between_what(record, coarse[index], why)
    halves = tuple(Reduced(half.record, cycles) for half, cycles in zip(pair.parts, same, strict=True))
    return replace(by_holes, limits=limits, refused=refused, halves=halves, share=share)


def _hole_bounds(record: Record, narrow: Sequence[RecordGap], results: Sequence[CycleResult]) -> GapBounds:
    """Return what bridged holes may change."""
    own = _holes_of(narrow, results) if narrow else {}
    if not own:
        return GapBounds()
    short = without(record, _beside(record, narrow))
    others = _Evaluated.of(short)
    limits, refused, same = {}, {}, {}
    for result in results:
        index = result.cycle.index
        if index not in own:
            continue
        other = others.same(result.cycle)
        if other is None:
            refused[index] = _refused(own[index], "hide a turning point")
            continue
        same[index] = other.cycle._replace(index=index)
        limits[index] = _limits(result, other)
        if why := _too_much(result, limits[index], 0.0):
            refused[index] = _refused(own[index], why)
    for index, better in _by_donors(record, results, own, refused).items():
        limits[index] = better
        del refused[index]
    return GapBounds(limits, refused, own, Reduced(short, same))


def _both(one: Mapping[str, float], other: Mapping[str, float]) -> dict[str, float]:
    """Return bounds by two causes that have nothing in common: root of squares, sign of the larger one."""
    both = dict(other)
    for name, bound in one.items():
        second = other.get(name, 0.0)
        larger = bound if abs(bound) >= abs(second) else second
        both[name] = float(np.copysign(np.hypot(bound, second), larger))
    return both


def _halved_limits(
    result: CycleResult, halves: tuple[CycleResult, CycleResult], share: float
) -> dict[str, float]:
    """Return the bounds of a cycle's figures by what half of its samples make of them."""
    even, odd = halves
    one, two = _changes(result, even), _changes(result, odd)
    limits = {name: halves_bound(one[name], two[name], share) for name in one.keys() & two}
    a, b, c = result.cycle, even.cycle, odd.cycle
    low = halves_bound(b.stroke_min_mm - a.stroke_min_mm, c.stroke_min_mm - a.stroke_min_mm, share)
    high = halves_bound(b.stroke_max_mm - a.stroke_max_mm, c.stroke_max_mm - a.stroke_max_mm, share)
    return limits | _by_turns(
        _explained(low, a.start, b.start, c.start), _explained(high, a.top, b.top, c.top)
    )


def _by_donors(
    record: Record,
    results: Sequence[CycleResult],
    own: Mapping[int, tuple[RecordGap, ...]],
    refused: Mapping[int, str],
) -> dict[int, dict[str, float]]:
    """Return the bounds of refused cycles that the same holes in like cycles show to be small enough."""
    wanted = [r for r in results if r.cycle.index in refused and r.cycle.steady]
    donors = choose_donors(wanted, results, own) if wanted else {}
    if not donors:
        return {}
    of = {result.cycle.index: result for result in results}
    lost = [opened(record, of[at].cycle, own[at], cycles) for at, cycles in donors.items()]
    others = _Evaluated.of(without(record, np.concatenate(lost)))
    found = {}
    for index, cycles in donors.items():
        seen = [(of[cycle.index], others.same(cycle)) for cycle in cycles]
        changes = [_limits(one, other) for one, other in seen if other is not None]
        if len(changes) < len(seen):
            continue
        limits = {
            name: max((change.get(name, 0.0) for change in changes), key=abs)
            for name, value in of[index].quantities._asdict().items()
            if value is not None and name not in _LEFT_OUT
        }
        if not _too_much(of[index], limits, 0.0):
            found[index] = limits
    return found


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """The cycles of a record from which samples were taken."""

    record: Record
    results: Sequence[CycleResult]
    middles: NDArray[np.float64]

    @classmethod
    def of(cls, record: Record) -> _Evaluated:
        cycles, first = find_with_harmonics(record)
        results = evaluate_cycles(record, cycles, first)
        return cls(record, results, np.array([0.5 * (r.cycle.start_s + r.cycle.end_s) for r in results]))

    def same(self, cycle: Cycle) -> CycleResult | None:
        """Return the complete one that lies where a cycle of the whole record does."""
        if not self.middles.size:
            return None
        middle = 0.5 * (cycle.start_s + cycle.end_s)
        at = int(np.argmin(np.abs(self.middles - middle)))
        near = abs(self.middles[at] - middle) < _SAME_CYCLE * cycle.duration_s
        return self.results[at] if near and self.results[at].cycle.complete else None


@dataclass(frozen=True, eq=False)
class _Halves:
    """The cycles of a record in each half of its samples."""

    parts: tuple[_Evaluated, _Evaluated]

    @classmethod
    def of(cls, record: Record, *, thinned: bool) -> _Halves:
        even, odd = (_Evaluated.of(half_of(record, first, thinned=thinned)) for first in (0, 1))
        return cls((even, odd))

    def same(self, cycle: Cycle) -> tuple[CycleResult, CycleResult] | None:
        """Return the cycle as both halves have it; None where one does not have it."""
        even, odd = (part.same(cycle) for part in self.parts)
        return None if even is None or odd is None else (even, odd)


def _refused(holes: Sequence[RecordGap], why: str) -> str:
    more = f" and {len(holes) - 1} more" if len(holes) > 1 else ""
    return f"what is not on record of it may {why}: {holes[0].text}{more}"


def _between_what(record: Record, step_s: float, why: str) -> str:
    """Return why a cycle is not evaluated whose samples, or readings of the force, are too few."""
    between = f"its samples, {step_s:.3g} s apart,"
    if record.between is not None and record.between.step_s > step_s:
        between = f"the readings of the force, {record.between.step_s:.3g} s apart,"
    return f"what lies between {between} may {why}: record or export it at a higher rate"


def _holes_of(holes: Sequence[RecordGap], results: Sequence[CycleResult]) -> dict[int, tuple[RecordGap, ...]]:
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


def _beside(record: Record, holes: Sequence[RecordGap]) -> NDArray[np.intp]:
    """Return the samples beside holes, as many as make each twice as long."""
    starts = np.array([hole.start_s for hole in holes])
    ends = np.array([hole.end_s for hole in holes])
    more_s = WIDER * (ends - starts)
    first = np.searchsorted(record.time_s, starts - more_s, side="right")
    before = np.searchsorted(record.time_s, starts)
    after = np.searchsorted(record.time_s, ends)
    last = np.searchsorted(record.time_s, ends + more_s)
    sides = zip(
        np.concatenate((np.minimum(first, before), after)).tolist(),
        np.concatenate((before + 1, np.maximum(last, after + 1))).tolist(),
        strict=True,
    )
    return np.concatenate([np.arange(a, b) for a, b in sides])


def _limits(result: CycleResult, other: CycleResult) -> dict[str, float]:
    """Return the bounds of a cycle's figures: their changes, but for what noise explains of a stroke's."""
    limits = {name: SURE * change for name, change in _changes(result, other).items()}
    a, b = result.cycle, other.cycle
    low = SURE * _explained(b.stroke_min_mm - a.stroke_min_mm, a.start, b.start)
    high = SURE * _explained(b.stroke_max_mm - a.stroke_max_mm, a.top, b.top)
    return limits | _by_turns(low, high)


def _changes(result: CycleResult, other: CycleResult) -> dict[str, float]:
    """Return by how much the figures of a cycle are others in another record."""
    both = zip(QUANTITIES.names, result.quantities, other.quantities, strict=True)
    return {
        name: changed - value
        for name, value, changed in both
        if name not in _LEFT_OUT and value is not None and changed is not None
    }


def _explained(by_mm: float, *fits: TurningPoint) -> float:
    """Return the change of a turning point less what is in its uncertainty: noise, and how blunt it is."""
    explained = max(_NOISE * fit.u_stroke_mm + fit.blunt_mm for fit in fits)
    return float(np.sign(by_mm)) * max(0.0, abs(by_mm) - explained)


def _by_turns(low_mm: float, high_mm: float) -> dict[str, float]:
    """Return the bounds of the figures that turning points make, by those of the turning points."""
    return {
        "stroke_min_mm": low_mm,
        "stroke_max_mm": high_mm,
        "prestress_mm": 0.5 * (low_mm + high_mm),
        "amplitude_mm": 0.5 * (high_mm - low_mm),
    }


def _noise_J(record: Record, cycle: Cycle, step_s: float, *, smooth: bool) -> float:  # noqa: N802 - the unit
    """Return what noise explains of a change of W_a. Where samples are few, corners look like noise."""
    noise_J = energy_noise_J(record, cycle) if smooth or shows_turns(record, cycle, step_s) else 0.0
    if record.between is not None:
        noise_J = float(np.hypot(noise_J, record.between.noise_J(cycle.range_mm, cycle.duration_s)))
    return SURE * _NOISE * noise_J


def _too_much(result: CycleResult, limits: Mapping[str, float], noise_J: float) -> str:
    """Return why a cycle is not evaluated, or nothing."""
    energy_J = result.quantities.absorbed_energy_J
    if energy_J is None:
        return ""
    change_J = max(0.0, abs(limits.get("absorbed_energy_J", np.inf)) - noise_J)
    energy = change_J / abs(energy_J) if energy_J else np.inf
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
