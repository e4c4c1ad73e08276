"""Single samples, or two in a row, that contradict their neighbours on both sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray, IndexArray
from bufferstand.foundation.numbers import median, quantile

NOISE = 12.0
"""A lone sample is further off than so many standard deviations of the noise …"""
STEPS = 4.0
"""… than so many steps of the converter …"""
SHARE = 0.01
"""… than this share of what the channel usually spans …"""
LEAST: Mapping[str, float] = {"force": 0.1, "stroke": 0.05}
"""… and than this [kN, mm]."""
LOCAL = 1.5
"""It leaves the cubic through two neighbours on each side by so many of the steps beside it: the tip of a
triangle leaves it by 0.67. Nor is the step on either side of its neighbours larger than it is off: the last
sample before a specimen is let go leaves the cubic, too."""
LOCAL_UNEVEN = 4.0
"""Where the samples about it are not evenly spaced: so many of the steps beside it from both neighbours."""
SCATTER, MOST_LIKE, ABOUT = 2.0, 0.92, 20
"""Nor is it one of many: it leaves that cubic by so many times what all but few of the samples about it do,
so many on either side. A force that rings, or sticks and slips, has tips all along."""
SCATTER_ON_FLANK = NOISE / 1.75
"""So many times where it is the cubic alone that denies it: 12 standard deviations of what those samples
leave, 8 % of which leave more than 1.75. A friction damper's force that sticks and slips has tips of 5."""
SCATTER_OF_PAIR = SCATTER_ON_FLANK / 3.0
"""So many times for two in a row, of which either leaves a third: the cubic goes through the other one."""
_STANDS_OUT = 1.25
"""… and by so much more than its neighbours do: of a lone sample 1.5, of a jump 1."""
_APART = 0.3
_EVEN = 1.3
_HOLE = 5.0
"""A neighbour that is further in time than so many steps of those about it denies nothing: it comes after a
rest in a log by event."""
_BESIDE = 4
_MOST_CANDIDATES = 20_000
_PAIR_ALIKE = 0.5


def least_apart(quantity: str, sigma: float, step: float, span: float) -> float:
    """Return how far a lone sample is off at least, in the channel's unit."""
    return max(NOISE * sigma, STEPS * step, SHARE * span, LEAST[quantity])


def lone_rows(time_s: FloatArray, value: FloatArray, least: float, looked_at: Sequence[slice]) -> IndexArray:
    """Return the rows of samples, or of two in a row, that their neighbours deny.

    Parameters
    ----------
    time_s, value : arrays, shape (N,)
    least : float
        How far off they are at least (:func:`least_apart`).
    looked_at : sequence of slice
        Stretches in which they are looked for.
    """
    found: list[int] = []
    for part in looked_at:
        first, last = max(part.start, 2), min(part.stop, value.size - 2)
        if last - first < 1:
            continue
        near = value[first - 2 : last + 2]
        step = np.diff(near)
        into, out_of = step[1:-2], step[2:-1]
        single = _turns(into, out_of, _APART * least)
        rows = np.flatnonzero(single) + first
        double = _turns(into, step[3:], least)
        opposed = single[:-1] & single[1:]
        pairs = np.union1d(np.flatnonzero(double), np.flatnonzero(opposed)) + first
        if rows.size + pairs.size > _MOST_CANDIDATES:
            continue  # not lone samples, but noise of another kind
        for row in rows.tolist():
            if scatter := _scatter_of_lone(time_s, value, row, least):
                found += [row] if _is_alone(value, row, row, scatter) else []
        for row in pairs.tolist():
            if _is_pair(value, row, least) and _is_alone(value, row, row + 1, SCATTER_OF_PAIR):
                found += [row, row + 1]
    return np.unique(np.array(found, dtype=np.intp))


def _turns(into: FloatArray, out_of: FloatArray, least: float) -> NDArray[np.bool_]:
    """Say where a step is followed by one in the other direction, both larger than the least."""
    return np.asarray((np.minimum(np.abs(into), np.abs(out_of)) > least) & (into * out_of < 0.0))


def _scatter_of_lone(time_s: FloatArray, value: FloatArray, row: int, least: float) -> float:
    """Return by how many times a lone sample has to stand out of those about it; 0: it is none.

    One between neighbours that are further from each other than it is from the nearer, beyond what a flank
    explains, is none: a force that breaks down as a damper turns or a specimen is let go swings over the new
    level, by less than the step itself.
    """
    before, at, after = (float(v) for v in value[row - 1 : row + 2])
    apart = min(abs(at - before), abs(at - after))
    beside = _step_beside(value, row, row)
    steps_s = np.diff(time_s[max(0, row - _BESIDE) : row + _BESIDE + 1])
    if max(time_s[row + 1] - time_s[row], time_s[row] - time_s[row - 1]) > _HOLE * median(steps_s):
        return 0.0
    if apart < abs(after - before) - 2.0 * beside:
        return 0.0
    if apart > max(least, LOCAL_UNEVEN * beside):
        return SCATTER
    return SCATTER_ON_FLANK if _leaves_cubic(time_s, value, row, least, apart) else 0.0


def _leaves_cubic(time_s: FloatArray, value: FloatArray, row: int, least: float, apart: float) -> bool:
    """Say whether a sample leaves the cubic through its neighbours as a lone one does."""
    if row < 3 or row > value.size - 4:
        return False
    steps = np.diff(time_s[row - 3 : row + 4])
    if np.max(steps) > _EVEN * np.min(steps):
        return False
    before, own, after = (_off(value, at) for at in (row - 1, row, row + 1))
    flank = float(max(abs(value[row - 1] - value[row - 2]), abs(value[row + 2] - value[row + 1])))
    return (
        abs(own) > max(least, LOCAL * _step_beside(value, row, row), flank)
        and abs(own) > _STANDS_OUT * max(abs(before), abs(after))
        and before * own <= 0.0
        and own * after <= 0.0
        and apart > _APART * abs(own)
    )


def _off(value: FloatArray, row: int) -> float:
    """Return by how much a sample is off the cubic through two neighbours on each side, evenly spaced."""
    return float(_all_off(value[row - 2 : row + 3])[0])


def _is_alone(value: FloatArray, first: int, last: int, scatter: float) -> bool:
    """Say whether samples are off by far more than most of those about them are."""
    before, after = value[max(0, first - ABOUT) : first], value[last + 1 : last + 1 + ABOUT]
    off = np.abs(np.concatenate((_all_off(before), _all_off(after))))
    own = max(abs(_off(value, row)) for row in {first, min(last, value.size - 3)})
    return off.size == 0 or own > scatter * quantile(off, MOST_LIKE)


def _all_off(value: FloatArray) -> FloatArray:
    """Return by how much each sample, but for two at either end, is off the cubic through those beside it."""
    return np.asarray(value[2:-2] - (4.0 * (value[1:-3] + value[3:-1]) - value[:-4] - value[4:]) / 6.0)


def _is_pair(value: FloatArray, row: int, least: float) -> bool:
    """Say whether two samples from a row on are off, and what is beside them goes on as it came.

    They are alike, or on either side of it: a motion that goes there and there has more samples on its way.
    """
    if row + 2 >= value.size:
        return False
    before, one, two, after = (float(v) for v in value[row - 1 : row + 3])
    apart = min(abs(one - before), abs(two - after))
    alike = abs(two - one) < _PAIR_ALIKE * apart
    return (
        apart > max(least, LOCAL_UNEVEN * _step_beside(value, row, row + 1))
        and (alike or (one - before) * (two - after) < 0.0)
        and abs(after - before) < _PAIR_ALIKE * apart
    )


def _step_beside(value: FloatArray, first: int, last: int) -> float:
    """Return the third largest of the steps between four samples on either side.

    A steep flank beside has three; another lone sample among them makes two.
    """
    left = value[max(0, first - _BESIDE) : first]
    right = value[last + 1 : last + 1 + _BESIDE]
    steps = np.sort(np.concatenate((np.abs(np.diff(left)), np.abs(np.diff(right)))))
    return float(steps[-3]) if steps.size >= 3 else float("inf")
