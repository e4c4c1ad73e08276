"""Time stamps that are rounded so coarsely that several samples share one.

Each sample was taken within its rounding step. Where even samples fit all stamps, they are even; else those
of one stamp are spread evenly over its step. Either way no moment is off by more than the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_LEAST_SAMPLES = 16
_SHARED = 0.2
"""Stamps are rounded where so many of the steps are none: what repeats a stamp now and then is a defect."""
_WHOLE = 1e-3
"""… and all others are whole multiples of one, to this share of it."""
_FITS = 1.02
"""Even samples fit where they lie within this many rounding steps of the stamps."""
_MOST_ALIKE = 4.0
"""A stamp shared by this many times as many samples as is usual is that of a clock that stood still."""


@dataclass(frozen=True, eq=False)
class Unrounded:
    """Moments ``time_s`` (N,) of samples whose stamps are rounded to ``step_s``; ``even``: they are even."""

    time_s: FloatArray
    step_s: float
    even: bool

    @property
    def error_s(self) -> float:
        """Limit of the error of a moment [s]: half the rounding step of even samples, else all of it."""
        return 0.5 * self.step_s if self.even else self.step_s

    @property
    def note(self) -> str:
        """What was done, in words."""
        how = "even samples fit all of them" if self.even else "the samples of one stamp are spread over it"
        return (
            f"several samples share a time stamp: stamps are rounded to {self.step_s:.4g} s, and {how}; "
            f"moments are known to {self.error_s:.4g} s"
        )


def unrounded(time_s: FloatArray) -> Unrounded | None:
    """Return moments for samples that share rounded stamps; None where the stamps are no such.

    Parameters
    ----------
    time_s : array, shape (N,)
        Stamps as recorded [s].
    """
    step_s = _rounding_step_s(time_s)
    if step_s is None:
        return None
    first = np.concatenate(([0], np.flatnonzero(np.diff(time_s) > 0.0) + 1))
    shared = np.diff(np.append(first, time_s.size))
    if np.max(shared) > _MOST_ALIKE * np.median(shared):
        return None
    even = _even(time_s, step_s)
    if even is not None:
        return Unrounded(even, step_s, even=True)
    rank = np.arange(time_s.size) - np.repeat(first, shared)
    spread = step_s * (rank + 0.5) / np.repeat(shared, shared)
    return Unrounded(time_s + spread, step_s, even=False)


def _rounding_step_s(time_s: FloatArray) -> float | None:
    """Return to what stamps are rounded that many samples share, or None."""
    if time_s.size < _LEAST_SAMPLES or not np.isfinite(time_s).all():
        return None
    steps = np.diff(time_s)
    rises = steps[steps > 0.0]
    if np.min(steps) < 0.0 or steps.size - rises.size < _SHARED * steps.size or rises.size < 2:
        return None
    step_s = float(np.min(rises))
    multiples = rises / step_s
    off = np.abs(multiples - np.round(multiples))
    return step_s if np.all(off <= _WHOLE * np.maximum(multiples, 1.0)) else None


def _even(time_s: FloatArray, step_s: float) -> FloatArray | None:
    """Return even moments within a rounding step of all stamps, or None."""
    order = np.arange(time_s.size) - 0.5 * (time_s.size - 1)
    slope = float(order @ (time_s - time_s[0]) / (order @ order))
    off = time_s - slope * order
    low, high = float(np.min(off)), float(np.max(off))
    if slope <= 0.0 or high - low > _FITS * step_s:
        return None
    return np.asarray(0.5 * (low + high) + slope * order)
