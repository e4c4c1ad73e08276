"""Finds the slower one of stroke and force, and where it is read too seldom to follow the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.loading.resample import too_coarse
from bufferstand.evaluation.numerics import FloatArray, noise_sigma

STROKE_OFF, FORCE_OFF = 0.05, 0.25
"""Between readings of the other channel, stroke and force may leave the straight line by this share of their
range: 7 readings a cycle of a sine, and 3. (A force may jump where a stroke turns, a stroke cannot.)"""
_NOISES = 8.0
_SLOWER = 1.2


class ChannelReadings(NamedTuple):
    """Readings of a channel at their instants; shape (N,) both."""

    time_s: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class Rates:
    """The slower one of stroke and force (``""``: both are alike), its usual step, and what the other may do.

    ``limit`` is in the unit of the faster one (:func:`bufferstand.evaluation.loading.resample.too_coarse`).
    """

    slow: Literal["", "stroke", "force"]
    step_s: float
    limit: float

    @classmethod
    def of(
        cls, stroke_step_s: float, force_step_s: float, stroke_mm: FloatArray, force_kN: FloatArray
    ) -> Rates:
        """Compare two channels by their usual steps; ``stroke_mm`` and ``force_kN`` are readings of them."""
        if force_step_s > _SLOWER * stroke_step_s:
            return cls("force", force_step_s, _limit(STROKE_OFF, stroke_mm))
        if stroke_step_s > _SLOWER * force_step_s:
            return cls("stroke", stroke_step_s, _limit(FORCE_OFF, force_kN))
        return cls("", stroke_step_s, np.inf)

    @property
    def remedy(self) -> str:
        """What a user may do about it."""
        return f"record or export the {self.slow} at a higher rate"

    def too_coarse(self, stroke: ChannelReadings, force: ChannelReadings) -> NDArray[np.bool_] | None:
        """Say in which intervals of the slower channel the other does more than it shows."""
        if not self.slow:
            return None
        slow, fast = (force, stroke) if self.slow == "force" else (stroke, force)
        return too_coarse(slow.time_s, fast.time_s, fast.value, self.limit)


def _limit(share: float, values: FloatArray) -> float:
    if not values.size:
        return np.inf
    return max(share * float(np.ptp(values)), _NOISES * noise_sigma(values))


@dataclass
class IntervalCounts:
    """Intervals of the slower channel that were looked at, and those that are too long."""

    intervals: int = 0
    coarse: int = 0
    first_s: float = np.nan

    def look(self, slow_s: FloatArray, coarse: NDArray[np.bool_]) -> None:
        """Count the intervals between instants, shape (N,), by whether each is too long, shape (N - 1,)."""
        if not self.coarse and coarse.any():
            self.first_s = float(slow_s[np.argmax(coarse)])
        self.intervals += coarse.size
        self.coarse += int(np.count_nonzero(coarse))

    def text(self, rates: Rates) -> str:
        """Return what was seen, in words."""
        other = "stroke" if rates.slow == "force" else "force"
        return (
            f"{rates.slow} is read every {rates.step_s:.3g} s only, and in {self.coarse} of {self.intervals} "
            f"intervals, the first at {self.first_s:.6g} s, the {other} moves more than that can show"
        )


def within(slow_s: FloatArray, coarse: NDArray[np.bool_], time_s: FloatArray) -> NDArray[np.bool_]:
    """Say which instants lie in intervals that are too long, shape (M,)."""
    place = np.searchsorted(slow_s, time_s, side="right") - 1
    inside = (place >= 0) & (place < coarse.size)
    found = np.zeros(time_s.size, dtype=bool)
    found[inside] = coarse[place[inside]]
    return found
