"""Finds which of two force channels has jumped: its zero or its scale changed during the recording.

Where the stroke is continuous, the force of the specimen is, too. So the channel that jumps between two
samples, while the stroke and the other force do not, is the wrong one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.foundation.numbers import median, quantile

LEAST_KN = 3.0
"""A smaller jump is none: twice what right zeros are stated within, and many times their noise."""
LASTS_S = 0.3
"""It lasts so long on either side."""
STANDS_OUT, SIGMAS = 3.0, 6.0
"""It is so many times what both part by elsewhere, and the scatter of the one that jumps."""
OF_SIZE = 0.4
"""A break has the jump's size within this share; the other force breaks by less than it there."""
DELAY_S = np.arange(-0.04, 0.0401, 0.01)
"""Filters and wires delay the one by so much: a turn that one shows later is no jump."""
HOLE = 3.0
"""Across a step of so many times the usual one nothing is said."""


@dataclass(frozen=True)
class ForceChange:
    """A jump of one force against the other.

    Parameters
    ----------
    name : str
        The channel that has jumped; empty where that cannot be told.
    size_kN : float
        By so much; of ``force_2`` against ``force`` where it cannot be told.
    at_s : float
    at : int
        The last sample before it.
    """

    name: str
    size_kN: float
    at_s: float
    at: int


def jumped(
    time_s: FloatArray, one: FloatArray, two: FloatArray, stroke: FloatArray | None
) -> ForceChange | None:
    """Return the greatest jump of ``force_2`` against ``force`` that lasts; None where there is none.

    Parameters
    ----------
    time_s : array, shape (N,)
    one, two : arrays, shape (N,)
        ``force`` and ``force_2`` [kN].
    stroke : array, shape (N,), optional
        [mm]. Where it breaks, too, the specimen or its wire has moved: which force is wrong is not told.
    """
    step_s = median(np.diff(time_s))
    wide, lasts = _native(time_s, two, step_s), max(5, round(LASTS_S / step_s))
    width = wide + 1
    if time_s.size < 2 * lasts + 8 * width:
        return None
    apart = two - one
    breaks = _breaks(apart, width)
    breaks[: lasts + width] = breaks[-lasts - 2 * width :] = 0.0
    at = int(np.argmax(np.abs(breaks)))
    size_kN = _lasting(apart, at, width, lasts)
    elsewhere = np.delete(np.abs(breaks), np.arange(max(0, at - 3 * width), at + 3 * width))
    if abs(size_kN) < max(LEAST_KN, STANDS_OUT * quantile(elsewhere, 0.99)):
        return None
    about = slice(at - 2 * width, at + 3 * width)
    if abs(float(breaks[at]) - size_kN) > OF_SIZE * abs(size_kN):
        return None
    if float(np.max(np.diff(time_s[about]))) > HOLE * step_s:
        return None
    moves = round(float(DELAY_S[-1]) / step_s)  # a jump of ``one`` moves with it
    around = slice(max(0, about.start - moves), about.stop + moves)
    delayed = (two - np.interp(time_s - late_s, time_s, one) for late_s in DELAY_S)
    if min(float(np.max(np.abs(_breaks(own, width)[around]))) for own in delayed) < 0.5 * abs(size_kN):
        return None
    name = _name({"force": (one, -size_kN), "force_2": (two, size_kN)}, at, wide)
    if stroke is not None and _breaks_too(stroke, at, width):
        name = ""
    return ForceChange(name, -size_kN if name == "force" else size_kN, float(time_s[at]), at)


def _native(time_s: FloatArray, value: FloatArray, step_s: float) -> int:
    """Return over how many instants a signal goes straight that was interpolated between its own samples."""
    kinks = np.flatnonzero(np.abs(np.diff(value, 2)) > 1e-9 * max(1.0, float(np.ptp(value))))
    if kinks.size < 3:
        return 1
    return max(1, round(median(np.diff(time_s[kinks])) / step_s))


def _breaks(value: FloatArray, width: int) -> FloatArray:
    """Return by how much a signal changes over ``width`` instants from each on, less what it does beside."""
    steps = value[width:] - value[:-width]
    found = np.zeros(value.size)
    found[width : steps.size - width] = steps[width:-width] - 0.5 * (steps[: -2 * width] + steps[2 * width :])
    return found


def _lasting(apart: FloatArray, at: int, width: int, lasts: int) -> float:
    before, behind = apart[at - lasts : at], apart[at + width + 1 : at + width + 1 + lasts]
    return median(behind) - median(before)


def _name(forces: Mapping[str, tuple[FloatArray, float]], at: int, wide: int) -> str:
    """Return the one that alone breaks by its part, at any of some widths; empty where none does, or both."""
    found = set()
    for width in {1, 2, wide, wide + 1, 2 * wide}:
        near = slice(at - width, at + wide + width + 1)
        most, sharp = {}, []
        for name, (value, size_kN) in forces.items():
            breaks = _breaks(value, width)
            own = breaks[near]
            scatter = 1.4826 * median(np.abs(breaks))
            most[name] = float(np.max(np.abs(own)))
            greatest = float(own[int(np.argmax(np.abs(own)))])
            if abs(greatest - size_kN) < OF_SIZE * abs(size_kN) and abs(greatest) > SIGMAS * scatter:
                sharp.append(name)
        for name in sharp:
            other = "force_2" if name == "force" else "force"
            if most[other] < OF_SIZE * abs(forces[name][1]):
                found.add(name)
    return found.pop() if len(found) == 1 else ""


def _breaks_too(stroke: FloatArray, at: int, width: int) -> bool:
    breaks = np.abs(_breaks(stroke, width))
    scatter = 1.4826 * median(breaks)
    return float(np.max(breaks[at - width : at + width + 1])) > max(1.0, SIGMAS * scatter)
