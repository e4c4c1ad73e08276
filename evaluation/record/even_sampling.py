"""Samples of an even clock with uneven time stamps: rounded, or stamped late by a busy computer.

Stamps that scatter about even steps say one of two things. The samples were taken when they say, and the
stroke is off its curve by the speed times the scatter; or they were taken evenly, and the stroke is not. The
stroke itself tells which: in the second case the stamps' scatter would go into every slope over time.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.foundation.numbers import median

_LEAST_SAMPLES = 64
_MOST_OFF = 0.75
"""Stamps of an even clock are no further than this share of a step from the line through them …"""
_LEAST_SCATTER = 0.01
"""… and whether they are is asked where they scatter by this share of it."""
_LOOKED_AT = 4096
"""Steps at the begin of a stretch that show whether its stamps scatter at all."""
_AROUND = 4
"""The speed is taken over so many samples to either side."""
_CORNER = 6.0
"""Third differences of the stroke that are so many times as large as usual are corners of it."""
_FOLLOWS, _SURE = 0.5, 3.0
"""The stroke does not follow the stamps where its share is below this by so many standard deviations."""


class EvenStamps(NamedTuple):
    """Moments ``time_s`` (N,) by even steps, and in words what the stamps are."""

    time_s: FloatArray
    note: str


def even_stamps(time_s: FloatArray, stroke_mm: FloatArray, breaks: NDArray[np.intp]) -> EvenStamps | None:
    """Return even moments for samples that were taken evenly; None where the stamps are as good, or better.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
        Stamps, strictly rising, and the stroke at them.
    breaks : array of int
        Samples before which something is not on record: lines do not go across.

    Notes
    -----
    With e the distance of the stamps from the line, v the speed and D third differences, D x = β v D e: β is
    1 where the samples were taken when they are stamped, 0 where they were taken evenly.
    """
    stretches = pairwise([0, *breaks.tolist(), time_s.size])
    lines = [(a, b, line) for a, b in stretches if (line := _line(time_s[a:b])) is not None]
    if not lines:
        return None
    moments, off = time_s.copy(), np.zeros(time_s.size)
    products = squares = residual = 0.0
    used = 0
    for first, last, line in lines:
        moments[first:last] = line
        off[first:last] = time_s[first:last] - line
        expected, shown = _third_differences(line, off[first:last], stroke_mm[first:last])
        products += float(expected @ shown)
        squares += float(expected @ expected)
        residual += float(shown @ shown)
        used += shown.size
    if squares == 0.0:
        return None
    follows = products / squares
    scatter = max(residual - products * follows, 0.0) / used
    if follows + _SURE * float(np.sqrt(scatter / squares)) >= _FOLLOWS or not np.all(np.diff(moments) > 0.0):
        return None
    scatter_s = float(np.std(off[off != 0.0]))
    note = (
        f"time stamps scatter by {scatter_s:.2g} s about even steps, and the stroke does not: its samples "
        "are taken as even"
    )
    return EvenStamps(moments, note)


def _line(time_s: FloatArray) -> FloatArray | None:
    """Return the even moments nearest to some stamps; None where these are no even clock's, or even."""
    if time_s.size < _LEAST_SAMPLES:
        return None
    first = np.diff(time_s[:_LOOKED_AT])
    if float(np.std(first)) < _LEAST_SCATTER * float(np.mean(first)):  # nearly every record: seen at once
        return None
    rank = np.arange(time_s.size) - 0.5 * (time_s.size - 1)
    middle_s = float(np.mean(time_s))
    step_s = float(rank @ (time_s - middle_s)) / float(rank @ rank)
    line = np.asarray(middle_s + step_s * rank, dtype=np.float64)
    off = np.abs(time_s - line)
    if np.max(off) > _MOST_OFF * step_s or np.std(time_s - line) < _LEAST_SCATTER * step_s:
        return None
    return line


def _third_differences(
    line_s: FloatArray, off_s: FloatArray, stroke_mm: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return those of the stroke that stamps which are right would make, and those that it has."""
    reach = slice(_AROUND, -_AROUND)
    speed = (stroke_mm[2 * _AROUND :] - stroke_mm[: -2 * _AROUND]) / (2.0 * _AROUND * (line_s[1] - line_s[0]))
    expected = 0.5 * (speed[1:-2] + speed[2:-1]) * np.diff(off_s[reach], 3)
    shown = np.diff(stroke_mm[reach], 3)
    usual = np.abs(shown) <= _CORNER * median(np.abs(shown))
    return expected[usual], shown[usual]
