"""The neighbourhood of one reversal of the stroke, turned so that the extreme is a maximum."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray, IndexArray

TurnKind = Literal["lower", "upper"]
ONE_SIDED = 0.01
"""A turn this close to the record's end (share of the stroke on its other side) is seen from one side."""


class Reversal(NamedTuple):
    """A coarse reversal that is to be fitted.

    Attributes
    ----------
    index : int
        Sample of the coarse extreme.
    limits : (int, int)
        First and last sample that may be used: the neighbouring reversals, or a break of the record.
    kind : "lower" or "upper"
    at_end : (bool, bool)
        Whether the record (or an unbroken stretch of it) begins and ends at the limits.
    """

    index: int  # type: ignore[assignment] # nobody looks for values in a reversal
    limits: tuple[int, int]
    kind: TurnKind
    at_end: tuple[bool, bool] = (True, True)


@dataclass(frozen=True, eq=False)
class Reversals:
    """Many of them: ``index`` (R,), ``limits`` (R, 2), ``upper`` (R,) and ``at_end`` (R, 2)."""

    index: IndexArray
    limits: IndexArray
    upper: NDArray[np.bool_]
    at_end: NDArray[np.bool_]

    def row(self, row: int) -> Reversal:
        """Return one of them."""
        first, last = self.limits[row].tolist()
        begins, ends = self.at_end[row].tolist()
        kind: TurnKind = "upper" if self.upper[row] else "lower"
        return Reversal(int(self.index[row]), (first, last), kind, (begins, ends))


@dataclass(frozen=True, eq=False)
class TurnNeighbourhood:
    """Samples about one reversal. ``first`` is the index of ``time_s[0]`` in the record.

    ``height`` is that of the lower side, ``wide_height`` that of the higher one, at most twice that.
    ``open_left``, ``open_right``: that side is not on record. ``least_samples``: so many make a dwell.
    ``read``: which samples were read, where others were put into rests.
    """

    time_s: FloatArray
    value: FloatArray
    peak: int
    first: int
    height: float
    wide_height: float
    open_left: bool
    open_right: bool
    sigma: float
    least_samples: int
    read: NDArray[np.bool_] | None = None

    @cached_property
    def _fallen(self) -> tuple[FloatArray, FloatArray]:
        """How far the value has fallen below the peak at most, going out from it to the left and right."""
        top = self.value[self.peak]
        left = np.maximum.accumulate(top - self.value[self.peak - 1 :: -1]) if self.peak else self.value[:0]
        return left, np.maximum.accumulate(top - self.value[self.peak + 1 :])

    def above(self, level: float) -> slice:
        """Return the samples about the peak, at least itself, that are not below a level."""
        left, right = self._fallen
        below = float(self.value[self.peak]) - level
        return slice(
            self.peak - int(np.searchsorted(left, below, side="right")),
            self.peak + 1 + int(np.searchsorted(right, below, side="right")),
        )

    def windows(self, shares: FloatArray) -> tuple[IndexArray, IndexArray]:
        """Return first and last (excluded) samples in the record that are so near the peak."""
        left, right = self._fallen
        below = shares * self.height + 2.0 * self.sigma
        at = self.first + self.peak
        first = at - np.searchsorted(left, below, side="right")
        return first, at + 1 + np.searchsorted(right, below, side="right")

    @property
    def step_s(self) -> float:
        """Usual step between samples [s]."""
        return float(self.time_s[-1] - self.time_s[0]) / max(1, self.time_s.size - 1)


def least_height(sigma_mm: float) -> float:
    """Return how much the stroke must move beside a reversal for that side to be on record [mm]."""
    return 20.0 * sigma_mm + 1e-12


def side_of(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    reversal: Reversal,
    sigma_mm: float,
    least_samples: int,
    read: NDArray[np.bool_] | None = None,
) -> TurnNeighbourhood:
    """Return the neighbourhood of a reversal; ``sigma_mm`` is the noise of the stroke."""
    first, last = reversal.limits
    part = stroke_mm[first : last + 1]
    value = part if reversal.kind == "upper" else -part
    peak = reversal.index - first
    left = float(value[peak] - np.min(value[: peak + 1]))
    right = float(value[peak] - np.min(value[peak:]))
    least = least_height(sigma_mm)
    open_left = left <= max(least, ONE_SIDED * right if reversal.at_end[0] else 0.0)
    open_right = right <= max(least, ONE_SIDED * left if reversal.at_end[1] else 0.0)
    heights = [height for height, is_open in ((left, open_left), (right, open_right)) if not is_open]
    height = min(heights, default=max(left, right, 1e-12))
    return TurnNeighbourhood(
        time_s=time_s[first : last + 1],
        value=value,
        peak=peak,
        first=first,
        height=height,
        wide_height=min(max(heights, default=height), 2.0 * height),
        open_left=open_left,
        open_right=open_right,
        sigma=sigma_mm,
        least_samples=least_samples,
        read=None if read is None else read[first : last + 1],
    )
