"""Cycles of a run as facts: turning points, cycles, and the loop of force over stroke of one cycle.

A cycle runs from a lower turning point over the upper one to the next lower turning point. A rest at a lower
turning point belongs to none: the cycle starts when the stroke leaves it and ends when the stroke arrives.
That a stand stands while it reverses is no rest, but part of its cycles
(:mod:`bufferstand.evaluation.cycles.reversal_dwells`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray

TurnMethod = Literal["polynomial", "lines", "plateau", "reversal", "edge", "cut"]


class TurningPoint(NamedTuple):
    """A fitted reversal of the stroke.

    Attributes
    ----------
    time_s, leave_s : float
        When the stroke arrives and leaves; equal unless it dwells.
    stroke_mm, leave_mm : float
        Fitted stroke at the arrival and at leaving; they differ when the specimen creeps while it dwells.
    kind : "lower" or "upper"
    index : int
        Sample nearest to the arrival.
    method : str
        ``polynomial`` (smooth), ``lines`` (triangular), ``plateau`` (dwell), ``reversal`` (a dwell so short
        that it is what the stand needs to reverse), ``edge`` (the record begins or ends at the turn) or
        ``cut`` (it begins after or ends before the turn).
    u_stroke_mm : float
        Standard uncertainty of the fit, from its residuals.
    u_time_s, u_leave_s : float
        Those of the moments of arriving and leaving; one error where the two are one moment.
    moment_samples : float
        From so many samples the moment is known where it was not read with the stroke, but by its flanks;
        else 0.
    blunt_mm : float
        By how much the stroke may turn before ``stroke_mm``, where samples do not show how sharp it turns: a
        stand that rounds its turns does so at all of them.
    """

    time_s: float
    leave_s: float
    stroke_mm: float
    leave_mm: float
    kind: Literal["lower", "upper"]
    index: int  # type: ignore[assignment] # nobody looks for values in a turning point
    method: TurnMethod
    u_stroke_mm: float = 0.0
    u_time_s: float = 0.0
    u_leave_s: float = 0.0
    blunt_mm: float = 0.0
    moment_samples: float = 0.0

    @property
    def dwell_s(self) -> float:
        """Time spent at the turning point [s]."""
        return self.leave_s - self.time_s


class Cycle(NamedTuple):
    """One cycle: lower turning point ``start``, upper ``top``, lower ``end``; ``why`` says what it is not.

    Not ``bounded``: what is not on record of it could change it by more than is allowed.
    """

    index: int  # type: ignore[assignment] # nor in a cycle
    start: TurningPoint
    top: TurningPoint
    end: TurningPoint
    complete: bool
    steady: bool
    stroke_distortion: float | None = None
    why: tuple[str, ...] = ()
    bounded: bool = True

    @property
    def start_s(self) -> float:
        """When the stroke leaves the lower turning point [s]."""
        return self.start.leave_s

    @property
    def end_s(self) -> float:
        """When the stroke is back at the lower turning point [s]."""
        return self.end.time_s

    @property
    def duration_s(self) -> float:
        """Length of the cycle without dwells at its lower ends [s]."""
        return self.end_s - self.start_s

    @property
    def stroke_min_mm(self) -> float:
        """Stroke of the lower turning point at which the cycle starts [mm]."""
        return self.start.leave_mm

    @property
    def stroke_max_mm(self) -> float:
        """Stroke of the upper turning point [mm]: the greater one where it creeps while it dwells."""
        return max(self.top.stroke_mm, self.top.leave_mm)

    @property
    def stroke_end_mm(self) -> float:
        """Stroke of the lower turning point at which the cycle ends [mm]."""
        return self.end.stroke_mm

    @property
    def range_mm(self) -> float:
        """Stroke from the lower to the upper turning point [mm]."""
        return self.stroke_max_mm - self.stroke_min_mm


@dataclass(frozen=True, eq=False)
class TurnColumns:
    """Turning points as columns, shape (R,), named as in :class:`TurningPoint`: thousands at once."""

    time_s: FloatArray
    leave_s: FloatArray
    stroke_mm: FloatArray
    leave_mm: FloatArray
    u_stroke_mm: FloatArray
    method: NDArray[np.str_]

    @classmethod
    def of(cls, turns: Sequence[TurningPoint]) -> TurnColumns:
        """Return the columns of some turning points."""
        every = TurningPoint._make(zip(*turns, strict=True) if turns else [()] * len(TurningPoint._fields))
        names = ("time_s", "leave_s", "stroke_mm", "leave_mm", "u_stroke_mm")
        numbers = {name: np.fromiter(getattr(every, name), np.float64, len(turns)) for name in names}
        return cls(**numbers, method=np.array(every.method, dtype=np.str_))

    def rows(self, chosen: slice) -> TurnColumns:
        """Return some of them."""
        return TurnColumns(
            self.time_s[chosen],
            self.leave_s[chosen],
            self.stroke_mm[chosen],
            self.leave_mm[chosen],
            self.u_stroke_mm[chosen],
            self.method[chosen],
        )


class CycleColumns(NamedTuple):
    """The turning points of cycles as columns."""

    start: TurnColumns
    top: TurnColumns
    end: TurnColumns

    @classmethod
    def of(cls, cycles: Sequence[Cycle]) -> CycleColumns:
        """Return those of some cycles."""
        return cls(
            TurnColumns.of([cycle.start for cycle in cycles]),
            TurnColumns.of([cycle.top for cycle in cycles]),
            TurnColumns.of([cycle.end for cycle in cycles]),
        )

    def rows(self, chosen: slice) -> CycleColumns:
        """Return some of them."""
        return CycleColumns(*(turns.rows(chosen) for turns in self))

    @property
    def stroke_min_mm(self) -> FloatArray:
        """Stroke of the lower turning points at which the cycles start [mm]."""
        return self.start.leave_mm

    @property
    def stroke_max_mm(self) -> FloatArray:
        """Stroke of the upper turning points [mm]: the greater one where it creeps while it dwells."""
        return np.maximum(self.top.stroke_mm, self.top.leave_mm)

    @property
    def duration_s(self) -> FloatArray:
        """Length of the cycles without dwells at their lower ends [s]."""
        return self.end.time_s - self.start.leave_s


class EndReading(NamedTuple):
    """How the force at an end of a branch was read (:class:`bufferstand.evaluation.loops.EndForces`)."""

    gain: float = 1.0
    slope_kN_per_mm: float = 0.0
    doubt_kN: float = 0.0


class ExtremeReading(NamedTuple):
    """How the least or largest force of a cycle was read
    (:class:`bufferstand.evaluation.loops.ForceExtremes`).

    Attributes
    ----------
    place : int
        0, 1, 2: at the lower turning point, the upper one, the last one; -1: in between.
    time_s, gain, doubt_kN, overreach_kN : float
        In between: when, its gain of a sample's noise, its doubt, and by how much it overreaches.
    """

    place: int
    time_s: float = 0.0
    gain: float = 0.0
    doubt_kN: float = 0.0
    overreach_kN: float = 0.0


@dataclass(frozen=True, eq=False)
class Loop:
    """Force over stroke of one cycle, cut at the fitted turning points, both ends included.

    ``time_s``, ``stroke_mm``, ``force_kN`` have shape (M,). Loading is ``[: top + 1]``; a dwell at the top is
    ``[top : unload + 1]``, as is a jump of the force; unloading is ``[unload :]``. ``averaged``: samples
    that a point is the mean of. ``ends``: how the forces at both ends of the loading branch and at the end of
    the unloading one were read, ``extremes``: how the least and the largest force were.
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    force_kN: FloatArray
    top: int
    unload: int
    averaged: int = 1
    ends: tuple[EndReading, EndReading, EndReading] = (EndReading(), EndReading(), EndReading())
    extremes: tuple[ExtremeReading, ExtremeReading] = (ExtremeReading(0), ExtremeReading(1))

    @property
    def loading(self) -> slice:
        """Samples of the loading branch."""
        return slice(0, self.top + 1)

    @property
    def rising(self) -> slice:
        """Samples up to the largest stroke: the loading branch, and a dwell during which the stroke rises."""
        creeps = self.stroke_mm[self.unload] > self.stroke_mm[self.top]
        return slice(0, (self.unload if creeps else self.top) + 1)

    @property
    def unloading(self) -> slice:
        """Samples of the unloading branch."""
        return slice(self.unload, self.time_s.size)
