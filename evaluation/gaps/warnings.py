"""Warnings about holes of a run, and of the cycles that are evaluated with them."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.evaluation.facts import CycleResult
from bufferstand.evaluation.gaps.bounds import GapBounds
from bufferstand.evaluation.gaps.bridging import RecordGap
from bufferstand.evaluation.record import Record, describe

_NEGLIGIBLE = 1e-5
_MINOR = 1e-4
"""What a hole may change by less than this share is far below any U: nobody needs to act on it."""
MOST_HOLES = 10
"""Holes that are named one by one in the warnings of a run; the rest are counted."""


def hole_warnings(record: Record, holes: Sequence[RecordGap]) -> list[str]:
    """Return what is said of the holes of a record, by what they are taken for."""
    rest, wide = [h for h in holes if h.rest], [h for h in holes if h.wide]
    warnings = []
    if rest:
        what = "rest without samples (stroke and force are the same before and after)"
        warnings.append(f"{what}: {_named([hole.text for hole in rest])}")
    warnings += _interpolated([h for h in holes if not (h.rest or h.wide)])
    if wide:
        what = "not on record, and too long to be interpolated"
        warnings.append(f"{what}: {_named([hole.text for hole in wide])}")
    return [*warnings, *_harmless(record, holes)]


def hole_notes(record: Record, holes: Sequence[RecordGap]) -> list[str]:
    """Return those of :func:`hole_warnings` that ask nobody to do anything.

    What has no effect on any figure, and the list of what was interpolated across: where that may change a
    figure, the cycle concerned says so itself.
    """
    bridged = _interpolated([hole for hole in holes if not (hole.rest or hole.wide)])
    return [*bridged, *_harmless(record, holes)]


def _interpolated(holes: Sequence[RecordGap]) -> list[str]:
    return [f"interpolated across: {_named([hole.text for hole in holes])}"] if holes else []


def _harmless(record: Record, holes: Sequence[RecordGap]) -> list[str]:
    harmless = [d for d in record.defects if not any(h.start_s <= d.start_s <= h.end_s for h in holes)]
    return [f"of no effect on any figure: {describe(harmless, MOST_HOLES)}"] if harmless else []


def _named(texts: Sequence[str]) -> str:
    more = len(texts) - MOST_HOLES
    return ", ".join(texts[:MOST_HOLES]) + (f" and {more} more" if more > 0 else "")


def with_gap_limits(results: Sequence[CycleResult], gaps: GapBounds) -> list[CycleResult]:
    """Return results with what holes may change in them, and a warning of each cycle that says so."""
    if not gaps.limits:
        return list(results)
    return [
        result._replace(
            gap_limits=gaps.limits[result.cycle.index],
            warnings=(*result.warnings, *_note(gaps, result)),
        )
        if result.cycle.complete and result.cycle.index in gaps.limits
        else result
        for result in results
    ]


def between_warnings(record: Record, results: Sequence[CycleResult], gaps: GapBounds) -> list[str]:
    """Return what the interpolation between readings of the force may change, over all cycles."""
    if record.between is None:
        return []
    shares = [
        abs(gaps.limits[r.cycle.index]["absorbed_energy_J"] / r.quantities.absorbed_energy_J)
        for r in results
        if r.cycle.complete and r.cycle.index in gaps.limits and r.quantities.absorbed_energy_J
    ]
    if not shares:
        return []
    readings = f"readings that are {record.between.step_s:.3g} s apart"
    most = f"the absorbed energy of a cycle by up to {100.0 * max(shares):.2g} %"
    return [f"the force is interpolated between {readings}: that may change {most}, and is part of U"]


def coarse_warnings(results: Sequence[CycleResult], gaps: GapBounds) -> list[str]:
    """Return what the steps between few samples may change, over all cycles that are evaluated."""
    if not gaps.halves:
        return []
    own = [r for r in results if r.cycle.complete and r.cycle.index in gaps.halves[0].cycles]
    shares = [
        abs(gaps.limits[r.cycle.index]["absorbed_energy_J"] / r.quantities.absorbed_energy_J)
        for r in own
        if r.quantities.absorbed_energy_J
    ]
    if not shares:
        return []
    most = f"the absorbed energy of a cycle by up to {100.0 * max(shares):.2g} %"
    return [f"cycles have few samples: what lies between them may change {most}, and is part of U"]


def with_minor_gaps(results: Sequence[CycleResult], gaps: GapBounds) -> list[CycleResult]:
    """Return the cycles in which what is bridged may change next to nothing, each with only this warning."""
    return [
        result._replace(warnings=_note(gaps, result))
        for result in results
        if result.cycle.complete and result.cycle.index in gaps.limits and max(_shares(gaps, result)) < _MINOR
    ]


def _shares(gaps: GapBounds, result: CycleResult) -> tuple[float, float]:
    """Return by which shares what is bridged may change absorbed energy and stroke."""
    limits = gaps.limits[result.cycle.index]
    energy = abs(limits["absorbed_energy_J"] / (result.quantities.absorbed_energy_J or float("inf")))
    stroke = max(abs(limits["stroke_min_mm"]), abs(limits["stroke_max_mm"])) / result.cycle.range_mm
    return energy, stroke


def _note(gaps: GapBounds, result: CycleResult) -> tuple[str, ...]:
    """Return what is bridged in a cycle that is evaluated, and what that may change; nothing beside one."""
    holes = gaps.holes.get(result.cycle.index, ())
    if not holes:
        return ()
    energy, stroke = _shares(gaps, result)
    inside = [h for h in holes if h.end_s > result.cycle.start_s and h.start_s < result.cycle.end_s]
    if not inside and max(energy, stroke) < _NEGLIGIBLE:
        return ()
    named = inside or holes
    more = f" and {len(named) - 1} more" if len(named) > 1 else ""
    may = f"change the absorbed energy by {100.0 * energy:.2g} % and the stroke by {100.0 * stroke:.2g} %"
    return (f"interpolated across {named[0].text}{more}: that may {may}, and is part of U",)
