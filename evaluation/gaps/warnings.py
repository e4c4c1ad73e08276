"""Warnings about holes of a run, and of the cycles that are evaluated with them."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.evaluation.facts import CycleResult
from bufferstand.evaluation.gaps.bounds import GapBounds
from bufferstand.evaluation.gaps.bridging import RecordGap
from bufferstand.evaluation.record import Record, describe

_NEGLIGIBLE = 1e-5
MOST_HOLES = 10
"""Holes that are named one by one in the warnings of a run; the rest are counted."""


def hole_warnings(record: Record, holes: Sequence[RecordGap]) -> list[str]:
    """Return what is said of the holes of a record, by what they are taken for."""
    kinds = (
        (
            "rest without samples (stroke and force are the same before and after)",
            [h for h in holes if h.rest],
        ),
        ("interpolated across", [h for h in holes if not (h.rest or h.wide)]),
        ("not on record, and too long to be interpolated", [h for h in holes if h.wide]),
    )
    warnings = [f"{what}: {_named([hole.text for hole in own])}" for what, own in kinds if own]
    harmless = [d for d in record.defects if not any(h.start_s <= d.start_s <= h.end_s for h in holes)]
    if harmless:
        warnings.append(f"of no effect on any figure: {describe(harmless, MOST_HOLES)}")
    return warnings


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


def _note(gaps: GapBounds, result: CycleResult) -> tuple[str, ...]:
    """Return what is bridged in a cycle that is evaluated, and what that may change; nothing beside one."""
    holes, limits = gaps.holes.get(result.cycle.index, ()), gaps.limits[result.cycle.index]
    if not holes:
        return ()
    energy = abs(limits["absorbed_energy_J"] / (result.quantities.absorbed_energy_J or float("inf")))
    stroke = max(abs(limits["stroke_min_mm"]), abs(limits["stroke_max_mm"])) / result.cycle.range_mm
    inside = [h for h in holes if h.end_s > result.cycle.start_s and h.start_s < result.cycle.end_s]
    if not inside and max(energy, stroke) < _NEGLIGIBLE:
        return ()
    named = inside or holes
    more = f" and {len(named) - 1} more" if len(named) > 1 else ""
    may = f"change the absorbed energy by {100.0 * energy:.2g} % and the stroke by {100.0 * stroke:.2g} %"
    return (f"interpolated across {named[0].text}{more}: that may {may}, and is part of U",)
