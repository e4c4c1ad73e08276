"""The input of the detectors: each channel as it was recorded, and the cycles found in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bufferstand.evaluation.facts import CycleResult, DrawWires, RunFacts
from bufferstand.evaluation.numerics import FloatArray, IndexArray
from bufferstand.evaluation.plausibility.run_view.channels import Channels
from bufferstand.evaluation.plausibility.run_view.error_codes import ErrorCodes
from bufferstand.evaluation.plausibility.run_view.samples import Samples
from bufferstand.evaluation.record import Record
from bufferstand.foundation.numbers import median

LONGER = 2.5
"""A step that lasts so many times longer than those beside it is a pause of the logger, or a hole."""
_ABOUT = 4
"""So many steps on either side are those about one."""


@dataclass(frozen=True, eq=False)
class RunView:
    """A run as detectors see it.

    Attributes
    ----------
    samples : Record
        Every sample as it was recorded and cleaned, before anything is averaged or bridged. (A very long run
        came averaged already: ``samples.averaged``.)
    record : Record
        What its cycles were found in.
    results : sequence of CycleResult
    facts : RunFacts
    wires : DrawWires or None
        How its draw wires agree, where there are two.
    given : Channels, optional
        Those of ``samples``, where they were looked at before.
    coded : tuple of Coded
        Codes in the place of readings that ``samples`` are without.
    clipped : mapping of str to set of int
        Cycles in which force or stroke is known to be clipped: the ends of their loops are not on record.
    frozen_s : tuple of (float, float)
        When the stroke is known to be frozen [s].
    stood : set of int
        Cycles in which the force is known to be frozen: their loops are none.
    turned : bool
        The force is that of the record with the other sign (:meth:`with_force_turned`).
    """

    samples: Record
    record: Record
    results: Sequence[CycleResult]
    facts: RunFacts
    wires: DrawWires | None = None
    given: Channels | None = None
    coded: tuple[ErrorCodes, ...] = ()
    clipped: Mapping[str, frozenset[int]] = field(default_factory=dict)
    frozen_s: tuple[tuple[float, float], ...] = ()
    stood: frozenset[int] = frozenset()
    turned: bool = False

    def without_repeats(self, held: Iterable[str]) -> RunView:
        """Return the run as it is with each value of these channels once."""
        return replace(self, given=Channels(self.samples, frozenset(held), self.seen.spikes))

    def without_spikes(self, spikes: Mapping[str, IndexArray]) -> RunView:
        """Return the run as it is without these rows of channels, which are no readings."""
        return replace(self, given=replace(self.seen, spikes=spikes))

    def with_force_turned(self) -> RunView:
        """Return the run as it is with the other sign of the force."""
        samples = _turned(self.samples)
        return replace(self, samples=samples, record=_turned(self.record), given=None, turned=True)

    @property
    def sign(self) -> float:
        """What makes a force of it that of the record: -1.0 where it is turned."""
        return -1.0 if self.turned else 1.0

    @cached_property
    def seen(self) -> Channels:
        """Force and strokes as recorded."""
        return self.given or Channels(self.samples)

    @property
    def force(self) -> Samples:
        """The force as recorded."""
        return self.seen.force

    @property
    def strokes(self) -> tuple[Samples, ...]:
        """The stroke as recorded; of several draw wires each one, if they are there, else their mean."""
        return self.seen.strokes

    @property
    def stroke(self) -> Samples:
        """The stroke as it is evaluated: the mean of draw wires where there are several."""
        return self.seen.stroke

    @property
    def channels(self) -> tuple[Samples, ...]:
        """Force and strokes."""
        return self.seen.all

    def other(self, channel: Samples) -> Samples:
        """Return what a channel is compared with: the stroke of a force, the force of a stroke."""
        return self.seen.other(channel)

    def touched(self, start_s: float, end_s: float) -> tuple[int, ...]:
        """Return the numbers of the cycles that a stretch of time touches, with the dwells at their ends."""
        return self.touched_by(np.array([start_s]), np.array([end_s]))

    def touched_by(self, starts_s: FloatArray, ends_s: FloatArray) -> tuple[int, ...]:
        """Return the numbers of the cycles that some stretches of time touch, shape (K,) each."""
        begins, leaves = self._bounds
        first = np.searchsorted(leaves, starts_s)
        last = np.searchsorted(begins, ends_s, side="right")
        change = np.zeros(begins.size + 1, dtype=np.intp)
        some = last > first
        np.add.at(change, first[some], 1)
        np.add.at(change, last[some], -1)
        return tuple(self.results[row].cycle.index for row in np.flatnonzero(np.cumsum(change)[:-1]).tolist())

    @cached_property
    def breaks_s(self) -> tuple[float, ...]:
        """Moments of the last sample before each interruption of the record [s].

        In a record that is written by event a step in which more changed than an event is one, too. Where it
        lasts no longer than those about it, a signal may have jumped in it: it is not among these.
        """
        time_s = self.samples.time_s
        before = np.array(self.samples.breaks, dtype=np.intp) - 1
        if self.samples.by_event and before.size:
            step_s = np.diff(time_s)
            about = [median(step_s[max(0, at - _ABOUT) : at + _ABOUT + 1]) for at in before.tolist()]
            before = before[step_s[before] > LONGER * np.array(about)]
        return tuple(time_s[before].tolist())

    @property
    def out(self) -> frozenset[str]:
        """Draw wires that are not used, because they stand still."""
        return frozenset(one.wire for one in self.wires.out) if self.wires else frozenset()

    @cached_property
    def figures(self) -> FloatArray:
        """Figures of the cycles that have them, shape (C, 11).

        Number, start [s], end [s], least and greatest force [kN], absorbed energy [J], rest before it [s],
        lower end and range of the stroke [mm], largest speed of loading [mm/s], highest temperature [°C]; NaN
        where one of the last two is not known.
        """
        rows = [
            (
                cycle.index,
                cycle.start.leave_s,
                cycle.end.time_s,
                own.force_min_kN,
                own.force_max_kN,
                own.absorbed_energy_J,
                cycle.start.leave_s - cycle.start.time_s,
                cycle.stroke_min_mm,
                cycle.range_mm,
                own.speed_loading_max_mm_per_s,
                own.temperature_max_C,
            )
            for cycle, own in ((result.cycle, result.quantities) for result in self.results)
            if cycle.complete
        ]
        table = np.array(rows, dtype=np.float64).reshape(-1, 11)
        if self.turned:
            table[:, 3:6] = -table[:, [4, 3, 5]]
        return np.asarray(table[np.isfinite(np.sum(table[:, 3:6], axis=1))])

    @cached_property
    def whole_figures(self) -> FloatArray:
        """Those figures of the cycles that are not clipped, shape (C, 11)."""
        cut = [*frozenset().union(*self.clipped.values())]
        return self.figures[~np.isin(self.figures[:, 0], cut)] if cut else self.figures

    @property
    def all_cycles(self) -> tuple[int, ...]:
        """Numbers of all cycles."""
        return tuple(result.cycle.index for result in self.results)

    @cached_property
    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        """When each cycle begins and ends, with the dwells at its ends [s]."""
        begins = np.array([result.cycle.start.time_s for result in self.results], dtype=np.float64)
        leaves = np.array([result.cycle.end.leave_s for result in self.results], dtype=np.float64)
        return begins, leaves


def _turned(record: Record) -> Record:
    as_recorded = {
        name: (time_s, -value if name == "force" else value)
        for name, (time_s, value) in record.as_recorded.items()
    }
    return replace(record, force_kN=-record.force_kN, as_recorded=as_recorded)
