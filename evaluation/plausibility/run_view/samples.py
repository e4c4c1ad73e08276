"""A channel as it was recorded, and what a few passes over all its samples tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import WHITE, FloatArray, Sampling, sampling_of
from bufferstand.evaluation.plausibility.run_view.lone_samples import least_apart, lone_rows
from bufferstand.evaluation.record import step_limits
from bufferstand.foundation.numbers import median, quantile, sorted_quantile

UNITS: Mapping[str, str] = {"force": "kN", "stroke": "mm", "temperature": "°C", "speed": "mm/s"}
_CHUNK = 32_768
"""Samples that are looked at together: what is made of them stays in the processor's cache."""
_FEWEST = 8
_CODES = (9999.0, 9999.9, 99999.0, 99999.9, 999999.0, 999999.9)
_FAR_BEYOND, _NO_READING = 1e6, 1e9
_ABOVE_OTHERS = 10.0
"""A code of a possible size (9999, 1e6) is so many times what is usual, and what is next below."""
_LEAST_CODE_STEP = 5000.0
_LOOKED_AT = 20_000
_STRETCHES, _STRETCH = 16, 1024
_JUMP, _BENT = 0.7, 1.2
"""Where a lone sample of some size is, a step of 0.7 of it is, and a second difference of 1.2 times it."""
_NOISY = 2.0
_COMPARED = 4096
_ROUNDING = 1e-9
"""Values that differ by less than this share of the span differ by rounding."""
_LEAST_DIFFERENT = 40
_NORMAL_LOWER_FIFTH = 0.2533471
"""A fifth of all normal deviates lie within 0.2533 standard deviations."""


@dataclass(frozen=True, eq=False)
class Scan:
    """What a pass over all samples of a channel tells, chunk by chunk, shape (C,) each.

    Attributes
    ----------
    first : array of int
        First row of each chunk; its last step leads to the first row of the next.
    same : array of int
        How many samples equal the one before.
    step : array
        Largest step between neighbouring samples (absolute), in the channel's unit.
    """

    first: NDArray[np.intp]
    same: NDArray[np.intp]
    step: FloatArray


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
    def left(self) -> dict[int, FloatArray]:
        """What steps over so many samples leave, once asked for
        (:mod:`bufferstand.evaluation.plausibility.jumps.sample_steps`)."""
        return {}

    @cached_property
    def unevenness(self) -> float:
        """How many times the shortest time between two samples the longest one is."""
        if self.time_s.size < 2:
            return 1.0
        shortest_s, longest_s = step_limits(self.time_s)
        return longest_s / shortest_s if shortest_s > 0.0 else float("inf")

    @cached_property
    def codes(self) -> NDArray[np.intp]:
        """Rows that hold a code in the place of a reading
        (:mod:`bufferstand.evaluation.plausibility.invalid_samples.error_codes`)."""
        scan = self.scan
        if self.value.size < _FEWEST:
            return np.zeros(0, dtype=np.intp)
        far = (scan.step > _LEAST_CODE_STEP) | (np.abs(self.value[scan.first]) > _LEAST_CODE_STEP)
        if not np.any(far):
            return np.zeros(0, dtype=np.intp)
        size = np.abs(self.value)
        usual = median(size[:: -(-size.size // _LOOKED_AT)])
        sure = size >= _NO_READING
        maybe = (np.isin(size, _CODES) | (size >= _FAR_BEYOND)) & (size > _ABOVE_OTHERS * usual)
        return np.flatnonzero(sure | (maybe & _apart(size, maybe)))

    @cached_property
    def usual_span(self) -> float:
        """What all but the least and the greatest hundredth of the samples span."""
        return self.share(0.99) - self.share(0.01)

    def share(self, of_them: float) -> float:
        """Return what a share of its samples stay below, by a look at some of them."""
        return sorted_quantile(self._sorted, of_them)

    @cached_property
    def _sorted(self) -> FloatArray:
        """Some of its samples, rising."""
        return np.sort(self.value[:: -(-self.value.size // _LOOKED_AT)])

    @cached_property
    def resolution(self) -> float:
        """The least difference between two values on record, in a look at some of them; 0: all are alike."""
        every = -(-self.value.size // _COMPARED)
        apart = np.diff(np.sort(self.value[::every]))
        apart = apart[apart > _ROUNDING * self.usual_span]
        return float(np.min(apart)) if apart.size else 0.0

    @cached_property
    def noise(self) -> float:
        """Standard deviation of white noise, by samples that differ from the one before; 0: none is seen.

        Noise makes third and fifth differences of one size; the motion, where samples are few, does not.
        """
        spreads = []
        ends = np.cumsum([part.size for part in self._changing])
        changes = np.diff(np.concatenate(self._changing))
        for order, more in ((3, 2), (5, 2)):
            changes = np.diff(changes, more)
            if changes.size < _LEAST_DIFFERENT:
                return 0.0
            within = np.ones(changes.size, dtype=bool)
            # A difference does not reach from one stretch to the next.
            across = ends[:-1, None] - np.arange(1, order + 1)
            within[np.minimum(np.maximum(across, 0), changes.size - 1)] = False
            sizes = np.abs(changes[within])
            if sizes.size < _LEAST_DIFFERENT:
                return 0.0
            gain = float(np.sqrt(comb(2 * order, order)))
            spreads.append(quantile(sizes, 0.2) / _NORMAL_LOWER_FIFTH / gain)
        return spreads[1] if spreads[1] > WHITE * spreads[0] else 0.0

    @cached_property
    def sigma(self) -> float:
        """Standard deviation of its noise and of a converter's rounding."""
        return max(self.sampling.sigma, self.noise)

    @cached_property
    def usual_step(self) -> float:
        """Median change from sample to sample, of those that are not 0."""
        steps = self._steps
        return median(steps) if steps.size else 0.0

    @cached_property
    def fast_step(self) -> float:
        """What 98 % of the changes from sample to sample stay below."""
        steps = self._steps
        return quantile(steps, 0.98) if steps.size else 0.0

    @cached_property
    def _changing(self) -> list[FloatArray]:
        """Some stretches of it, without samples that repeat the one before."""
        stretches = [self.value[first : first + _STRETCH] for first in self._spread()]
        moves = [part[1:] != part[:-1] for part in stretches]
        return [
            part if move.all() else part[np.append(True, move)]
            for part, move in zip(stretches, moves, strict=True)
        ]

    @cached_property
    def _steps(self) -> FloatArray:
        return np.asarray(np.abs(np.concatenate([np.diff(part) for part in self._changing])))

    @cached_property
    def lone(self) -> NDArray[np.intp]:
        """Rows of samples that their neighbours on both sides deny
        (:mod:`bufferstand.evaluation.plausibility.run_view.lone_samples`)."""
        if self.value.size < _FEWEST:
            return np.zeros(0, dtype=np.intp)
        # With noise or steps of a converter a lone sample is further off: the largest step often tells.
        if float(np.max(self.scan.step)) <= _JUMP * least_apart(self.quantity, 0.0, 0.0, self.usual_span):
            return np.zeros(0, dtype=np.intp)
        least = least_apart(self.quantity, self.sigma, self.sampling.step, self.usual_span)
        jumps = self.scan.first[self.scan.step > _JUMP * least].tolist()
        parts = [slice(first, first + _CHUNK) for first in jumps if self._bend(first) > _BENT * least]
        return lone_rows(self.time_s, self.value, least, parts)

    @cached_property
    def ends(self) -> tuple[float, float]:
        """The least and the greatest sample, without lone ones."""
        if not self.lone.size:
            return float(np.min(self.value)), float(np.max(self.value))
        others = np.delete(self.value, self.lone)
        return float(np.min(others)), float(np.max(others))

    @property
    def span(self) -> float:
        """Greatest less least sample, without lone ones."""
        return self.ends[1] - self.ends[0]

    @property
    def is_noisy(self) -> bool:
        """Whether noise moves it by more than its resolution: then no two neighbours are alike for long."""
        return self.noise > _NOISY * self.resolution > 0.0

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

    def _bend(self, first: int) -> float:
        """Return the largest second difference in a chunk, and two rows about it."""
        part = self.value[max(0, first - 2) : first + _CHUNK + 2]
        bend = np.diff(part, 2)
        return max(float(np.max(bend, initial=0.0)), -float(np.min(bend, initial=0.0)))

    def _spread(self) -> list[int]:
        if self.value.size <= _STRETCHES * _STRETCH:
            return list(range(0, self.value.size, _STRETCH))
        return [int(at) for at in np.linspace(0, self.value.size - _STRETCH, _STRETCHES)]

    def at(self, time_s: FloatArray) -> FloatArray:
        """Return the channel at some moments, by straight lines between its samples."""
        return np.asarray(np.interp(time_s, self.time_s, self.value), dtype=np.float64)

    def moved(self, start_s: float, end_s: float) -> float:
        """Return by how much the channel moves from one moment to another: greatest less least."""
        values = self.within(start_s, end_s)
        return float(np.max(values) - np.min(values))

    def within(self, start_s: float, end_s: float) -> FloatArray:
        """Return its values from one moment to another, interpolated at both."""
        ends = self.at(np.array([start_s, end_s]))
        return np.concatenate((ends[:1], self.value[self.rows(start_s, end_s)], ends[1:]))

    def rows(self, start_s: float, end_s: float) -> slice:
        """Return the rows from one moment to another, both included."""
        first = int(np.searchsorted(self.time_s, start_s))
        return slice(first, int(np.searchsorted(self.time_s, end_s, side="right")))


def _scanned(value: FloatArray) -> Scan:
    firsts = np.arange(0, max(value.size - 1, 1), _CHUNK)
    same, largest = np.zeros(firsts.size, dtype=np.intp), np.zeros(firsts.size)
    room = np.empty(min(_CHUNK, value.size))  # made once: fresh memory would cost more than the differences
    for row, first in enumerate(firsts.tolist()):
        part = value[first : first + _CHUNK + 1]
        if part.size < 2:
            continue
        step = np.subtract(part[1:], part[:-1], out=room[: part.size - 1])
        largest[row] = max(float(step.max()), -float(step.min()))
        same[row] = np.count_nonzero(part[1:] == part[:-1])
    return Scan(firsts, same, largest)


def _apart(size: FloatArray, maybe: NDArray[np.bool_]) -> bool:
    """Say whether all that may be codes are far above all others."""
    if not maybe.any() or maybe.all():
        return False
    return float(np.min(size[maybe])) > 3.0 * float(np.max(size[~maybe]))
