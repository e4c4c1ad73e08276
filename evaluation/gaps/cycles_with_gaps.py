"""The cycles of a record and their figures, with its gaps bridged, bounded or left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.cycles import find_with_harmonics
from bufferstand.evaluation.facts import Cycle, CycleResult, InertiaCorrection, MovingMass, TurningPoint
from bufferstand.evaluation.gaps.bounded_readings import BoundedReadings
from bufferstand.evaluation.gaps.bounds import GapBounds, gap_bounds
from bufferstand.evaluation.gaps.bridging import RecordGap, bridged
from bufferstand.evaluation.gaps.stroke_numbers import Numbering, numbering_of
from bufferstand.evaluation.gaps.warnings import (
    between_warnings,
    coarse_warnings,
    hole_notes,
    hole_warnings,
    with_gap_limits,
    with_minor_gaps,
)
from bufferstand.evaluation.loops import CutLoops, InertiaForce, correct_inertia
from bufferstand.evaluation.quantities import evaluate_cycles
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty import Propagations


@dataclass(frozen=True, eq=False)
class CyclesOfRecord:
    """What was found in a record: the record as it was evaluated, its cycles, their loops and figures."""

    record: Record
    results: list[CycleResult]
    loops: CutLoops
    inertia: InertiaCorrection
    added: InertiaForce | None
    holes: tuple[RecordGap, ...]
    gaps: GapBounds
    numbering: Numbering

    @cached_property
    def prepared(self) -> Propagations:
        """Its complete cycles, prepared for drawing."""
        return Propagations(self.record, [result.cycle for result in self.results], self.added)

    @property
    def reread(self) -> BoundedReadings:
        """Those of which something is not on record, prepared once more from less of it."""
        return BoundedReadings.of(self.gaps, self.prepared)

    @property
    def warnings(self) -> list[str]:
        """What is to be said of how it was recorded."""
        notes = self.record.notes
        holes = hole_warnings(self.record, self.holes)
        between = between_warnings(self.record, self.results, self.gaps)
        coarse = coarse_warnings(self.results, self.gaps)
        return [*notes, *holes, *between, *coarse, *self.numbering.warnings]

    @property
    def notes(self) -> list[str]:
        """Those of the warnings that ask nobody to do anything."""
        return hole_notes(self.record, self.holes)

    @property
    def slightly_bridged(self) -> list[CycleResult]:
        """Cycles in which what is bridged may change next to nothing, each with the warning of that alone."""
        return with_minor_gaps(self.results, self.gaps)


def found_in(
    record: Record,
    turns: NDArray[np.intp] | None,
    masses: tuple[MovingMass, MovingMass],
    interval_s: float,
    slips_s: Sequence[float] = (),
) -> CyclesOfRecord:
    """Find the cycles of a record and evaluate them.

    Parameters
    ----------
    record : Record
        At the resolution that its cycles need.
    turns : array of int or None
        Its reversals, where they are known.
    masses : (MovingMass, MovingMass)
        As the stand file and as the options state it.
    interval_s : float
        Longest time without a reading of the temperature.
    slips_s : sequence of float, optional
        When the stroke jumps, which is no motion [s].

    Raises
    ------
    BadInput
        If the moving mass is none.
    """
    bridge = bridged(record)
    cycles, first = find_with_harmonics(bridge.record, turns if bridge.record is record else None, slips_s)
    cycles = _with_clock(cycles, record.moment_error_s)
    record, inertia, added = correct_inertia(bridge.record, cycles, *masses)
    # With inertia, force and so its harmonics are others than those that the cycles were found with.
    loops = CutLoops(record, [cycle for cycle in cycles if cycle.complete])
    results = evaluate_cycles(record, cycles, first if added is None else None, loops, interval_s)
    gaps = gap_bounds(record, bridge.holes, results)
    if gaps.refused:
        cycles = gaps.without(cycles)
        loops = CutLoops(record, [cycle for cycle in cycles if cycle.complete])
        results = evaluate_cycles(record, cycles, None, loops, interval_s)
    return CyclesOfRecord(
        record,
        with_gap_limits(results, gaps),
        loops,
        inertia,
        added,
        bridge.holes,
        gaps,
        numbering_of(record, cycles, bridge.holes),
    )


def _with_clock(cycles: Sequence[Cycle], moment_error_s: float) -> tuple[Cycle, ...]:
    """Return cycles whose turning points are known no better than the samples' moments (rectangular)."""
    if moment_error_s == 0.0:
        return tuple(cycles)
    u_s = moment_error_s / float(np.sqrt(3.0))

    def turn(own: TurningPoint) -> TurningPoint:
        return own._replace(
            u_time_s=float(np.hypot(own.u_time_s, u_s)), u_leave_s=float(np.hypot(own.u_leave_s, u_s))
        )

    return tuple(
        cycle._replace(start=turn(cycle.start), top=turn(cycle.top), end=turn(cycle.end)) for cycle in cycles
    )
