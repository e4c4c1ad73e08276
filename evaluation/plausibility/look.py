"""What detectors see of a run: each channel as it was recorded, and the cycles that were found in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from evaluation.plausibility.lone import least_apart, lone_rows
from evaluation.record import FloatArray, Record
from evaluation.results import CycleResult, RunFacts
from evaluation.reversals import Sampling, sampling_of
from evaluation.wires import DrawWires

UNITS: Mapping[str, str] = {"force": "kN", "stroke": "mm", "temperature": "°C", "speed": "mm/s"}
_CHUNK = 32_768
"""Samples that are looked at together: what is made of them stays in the processor's cache."""
_LOOKED_AT = 20_000
_STRETCHES, _STRETCH = 16, 1024
_BENT = 0.6
"""A second difference of two lone samples is their own size, of one it is twice that."""
_NOISY = 2.0


@dataclass(frozen=True, eq=False)
class Scan:
    """What a pass over all samples of a channel tells, chunk by chunk, shape (C,) each.

    Chunk i is of the rows from ``first[i]`` on, and sees two rows of the next.

    Attributes
    ----------
    first : array of int
    same : array of int
        How many samples equal the one before.
    bend : array
        Largest second difference of neighbouring samples (absolute), in the channel's unit.
    """

    first: NDArray[np.intp]
    same: NDArray[np.intp]
    bend: FloatArray
    least: float
    greatest: float


@dataclass(frozen=True, eq=False)
class Samples:
    """A channel as recorded, on its own instants: ``time_s`` (N,), rising, and ``value`` (N,), all numbers.

    ``name`` is ``force``, ``stroke``, ``stroke_1`` or ``stroke_2``.
    """

    name: str
    time_s: FloatArray
    value: FloatArray

    @property
    def quantity(self) -> str:
        """``force`` or ``stroke``."""
        return self.name.split("_", maxsplit=1)[0]

    @property
    def unit(self) -> str:
        """The unit of its values."""
        return UNITS[self.quantity]

    @cached_property
    def sampling(self) -> Sampling:
        """Noise, converter's step and held samples."""
        return sampling_of(self.value)

    @cached_property
    def scan(self) -> Scan:
        """What one pass over all samples tells."""
        return _scanned(self.value)

    @cached_property
    def usual_span(self) -> float:
        """What all but the least and the greatest hundredth of the samples span."""
        every = -(-self.value.size // _LOOKED_AT)
        low, high = np.quantile(self.value[::every], (0.01, 0.99))
        return float(high - low)

    @cached_property
    def resolution(self) -> float:
        """The least change from sample to sample (2 % of those that are not 0 are less); 0: none changes."""
        stretches = [self.value[first : first + _STRETCH] for first in self._spread()]
        steps = np.abs(np.concatenate([np.diff(stretch) for stretch in stretches]))
        steps = steps[steps > 0.0]
        return float(np.quantile(steps, 0.02)) if steps.size else 0.0

    @cached_property
    def lone(self) -> NDArray[np.intp]:
        """Rows of samples that their neighbours on both sides deny (:mod:`evaluation.plausibility.lone`)."""
        least = least_apart(self.quantity, self.sampling.sigma, self.sampling.step, self.usual_span)
        suspect = self.scan.first[self.scan.bend > _BENT * least]
        parts = [slice(first, first + _CHUNK) for first in suspect.tolist()]
        return lone_rows(self.time_s, self.value, least, parts)

    @cached_property
    def ends(self) -> tuple[float, float]:
        """The least and the greatest sample, without lone ones."""
        if not self.lone.size:
            return self.scan.least, self.scan.greatest
        others = np.delete(self.value, self.lone)
        return float(np.min(others)), float(np.max(others))

    @property
    def span(self) -> float:
        """Greatest less least sample, without lone ones."""
        return self.ends[1] - self.ends[0]

    @property
    def is_noisy(self) -> bool:
        """Whether noise moves it by more than its resolution: then no two neighbours are alike for long."""
        return self.sampling.sigma > _NOISY * self.resolution > 0.0

    def flat(self, least: int) -> NDArray[np.intp]:
        """Return the stretches in which at least so many samples are the same to the last digit.

        Returns
        -------
        array of int, shape (K, 2)
            First and last row of each.
        """
        alike = []
        for first, same in zip(self.scan.first.tolist(), self.scan.same.tolist(), strict=True):
            if same:
                part = self.value[first : first + _CHUNK + 1]
                alike.append(np.flatnonzero(part[1:] == part[:-1]) + first)
        if not alike:
            return np.zeros((0, 2), dtype=np.intp)
        rows = np.concatenate(alike)
        cuts = np.flatnonzero(np.diff(rows) > 1)
        begins, ends = rows[np.append(0, cuts + 1)], rows[np.append(cuts, rows.size - 1)] + 1
        long = ends - begins + 1 >= least
        return np.stack((begins[long], ends[long]), axis=1)

    def _spread(self) -> list[int]:
        if self.value.size <= _STRETCHES * _STRETCH:
            return list(range(0, self.value.size, _STRETCH))
        return [int(at) for at in np.linspace(0, self.value.size - _STRETCH, _STRETCHES)]

    def at(self, time_s: FloatArray) -> FloatArray:
        """Return the channel at some moments, by straight lines between its samples."""
        return np.asarray(np.interp(time_s, self.time_s, self.value), dtype=np.float64)

    def rows(self, start_s: float, end_s: float) -> slice:
        """Return the rows from one moment to another, both included."""
        first = int(np.searchsorted(self.time_s, start_s))
        return slice(first, int(np.searchsorted(self.time_s, end_s, side="right")))


@dataclass(frozen=True, eq=False)
class Look:
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
    """

    samples: Record
    record: Record
    results: Sequence[CycleResult]
    facts: RunFacts
    wires: DrawWires | None = None

    @cached_property
    def force(self) -> Samples:
        """The force as recorded."""
        return self._own("force", self.samples.force_kN)

    @cached_property
    def strokes(self) -> tuple[Samples, ...]:
        """The stroke as recorded; of two draw wires each one, if they are there, else their mean."""
        wires = [name for name in ("stroke_1", "stroke_2") if name in self.samples.as_recorded]
        return tuple(self._own(name, self.samples.stroke_mm) for name in wires or ("stroke",))

    @cached_property
    def stroke(self) -> Samples:
        """The stroke as it is evaluated: the mean of draw wires where there are two."""
        if len(self.strokes) == 1:
            return self.strokes[0]
        return Samples("stroke", self.samples.time_s, self.samples.stroke_mm)

    @property
    def channels(self) -> tuple[Samples, ...]:
        """Force and strokes."""
        return (self.force, *self.strokes)

    def other(self, channel: Samples) -> Samples:
        """Return what a channel is held against: the stroke of a force, the force of a stroke."""
        return self.stroke if channel.quantity == "force" else self.force

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
        """Moments of the last sample before each interruption of the record [s]."""
        before = np.array(self.samples.breaks, dtype=np.intp) - 1
        return tuple(self.samples.time_s[before].tolist())

    @property
    def out(self) -> frozenset[str]:
        """Draw wires that are not used, because they stand still."""
        return frozenset(one.wire for one in self.wires.out) if self.wires else frozenset()

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

    def _own(self, name: str, otherwise: FloatArray) -> Samples:
        if name in self.samples.as_recorded:
            return Samples(name, *self.samples.as_recorded[name])
        return Samples(name, self.samples.time_s, otherwise)


def _scanned(value: FloatArray) -> Scan:
    firsts = np.arange(0, max(value.size, 1), _CHUNK)
    same, bend = np.zeros(firsts.size, dtype=np.intp), np.zeros(firsts.size)
    least, greatest = np.inf, -np.inf
    for row, first in enumerate(firsts.tolist()):
        part = value[first : first + _CHUNK + 2]
        if not part.size:
            continue
        least, greatest = min(least, float(np.min(part))), max(greatest, float(np.max(part)))
        step = np.diff(part)
        same[row] = step.size - np.count_nonzero(step)
        if step.size > 1:
            second = np.diff(step)
            bend[row] = max(float(np.max(second)), -float(np.min(second)))
    return Scan(firsts, same, bend, least, greatest)
