"""Leaps of a channel: steps between samples that the motion before and after them does not make.

A corner of the motion makes any step between those that the speeds on its two sides would make; what is left
of a step beyond them is a leap. A channel that leaps again and again (samples that are held, a stick that
slips) has many alike; one that the measuring chain made stands alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import LONGER, Samples

BESIDE = 3
"""The motion on a side is the median speed of so many steps."""
WIDTHS = (1, 4)
"""A leap is made in one step, or in so many where a filter or an interpolation blurs it."""
_MOVES = {1: 1.5, 4: 0.5}
"""Over as many steps the motion beside a leap makes less than so many times its size."""
_WIDER = 1.1
"""What a wider step adds to the same leap counts for nothing below this ratio."""
_REACH = 8
"""Leaps so few samples beside each other are one."""
_EVEN = 0.5
"""The steps on one side of a leap differ by less than this share of it."""
RING, RINGS = 40, 0.8
"""A channel rings that goes to and fro by this share of a leap over so many samples on either side of it."""
_CHUNK = 8192
"""Samples that are looked at together: what is made of them stays in the processor's cache."""
_NEAR_BREAK = 2
"""Channels have instants of their own, a little off those of the record."""
_WHOLE = 150_000
_CHUNKS = 2
"""Of more samples, so many chunks of :class:`bufferstand.evaluation.plausibility.run_view.view.Scan` are
looked at: those with the largest second differences."""


class SampleJump(NamedTuple):
    """A leap from sample ``first`` to sample ``last``: ``size`` is what the motion leaves of the step."""

    first: int
    last: int
    size: float


def largest_leaps(channel: Samples, breaks_s: Sequence[float], count: int) -> list[SampleJump]:
    """Return the largest leaps of a channel, the largest first, none beside another.

    Parameters
    ----------
    channel : Samples
    breaks_s : sequence of float
        Moments of the last sample before each interruption of the record [s]: a step across one is none.
    count : int
        So many at most.
    """
    broken = np.searchsorted(channel.time_s, np.asarray(breaks_s, dtype=np.float64), side="right").tolist()
    found = [
        leap
        for part in _parts(channel)
        for width in WIDTHS
        for leap in _leaps(channel, part, width, 8 * count)
    ]
    leaps: list[SampleJump] = []
    beside: set[int] = set()
    for leap in sorted(found, key=_order):
        if leap.first in beside or any(
            leap.first - _NEAR_BREAK < at <= leap.last + _NEAR_BREAK for at in broken
        ):
            continue
        leaps.append(leap)
        if len(leaps) == count:
            break
        beside.update(range(leap.first - _REACH, leap.first + _REACH + 1))
    return leaps


def may_leap(channel: Samples, least: float) -> bool:
    """Say whether a channel may have a leap larger than ``least``: most records have none.

    From the step over a leap the motion beside it is taken off. Where samples are evenly spaced, that is at
    most the largest step of the channel for each sample, and over several samples less than
    :data:`_MOVES` times the leap: the largest steps tell nearly always.

    Parameters
    ----------
    channel : Samples
    least : float
        In the channel's unit.
    """
    size = channel.value.size
    if size > _WHOLE or size <= max(WIDTHS) + 2 * BESIDE:
        return size > _WHOLE
    return any(
        float(np.max(_sizes(channel, width), initial=0.0)) > least
        for width in WIDTHS
        if _most(channel, width) > least and (width > 1 or _unlike(channel) > least)
    )


def _most(channel: Samples, width: int) -> float:
    """Return what no leap over ``width`` samples is larger than, by the largest steps (:func:`may_leap`)."""
    step = float(np.max(channel.scan.step))
    if width > 1:
        wide = channel.value[width:] - channel.value[:-width]
        own = max(float(wide.max()), -float(wide.min()))
        share = _MOVES[width] * channel.unevenness
        return min(own / (1.0 - share) if share < 1.0 else np.inf, own + width * step * channel.unevenness)
    return step * (1.0 + channel.unevenness)


def _unlike(channel: Samples) -> float:
    """Return what no leap over one sample is larger than, by how unlike steps are to the two before them.

    The median of three speeds lies between any two of them, so no further from a step than one of these two.
    """
    step = np.diff(channel.value)
    apart = [step[after:] - step[:-after] for after in (1, 2)]
    most = max(max(float(own.max()), -float(own.min())) for own in apart)
    return most + (channel.unevenness - 1.0) * float(np.max(channel.scan.step))


def goes_on(channel: Samples, leap: SampleJump) -> bool:
    """Say whether a channel moves evenly before and after a leap, and so goes on from where it arrived.

    With a few samples a stroke the motion itself leaps: the steps beside a leap must be like each other. A
    channel that stood still to the last digit and catches up has been held.
    """
    before = np.diff(channel.value[max(0, leap.first - BESIDE) : leap.first + 1])
    after = np.diff(channel.value[leap.last : leap.last + BESIDE + 1])
    if min(before.size, after.size) < BESIDE or np.any(before) != np.any(after):
        return False
    return max(float(np.ptp(before)), float(np.ptp(after))) < _EVEN * abs(leap.size)


def rings(channel: Samples, leap: SampleJump, within: slice) -> bool:
    """Say whether a channel goes to and fro beside a leap by as much: a stick that slips, play that closes.

    Parameters
    ----------
    channel : Samples
    leap : Leap
    within : slice
        Rows of its pass, from one turn to the next: there the motion itself goes one way.
    """
    sides = (
        slice(max(within.start, leap.first + 1 - RING), leap.first + 1),
        slice(leap.last, min(within.stop, leap.last + RING)),
    )
    return any(_to_and_fro(channel.value[side]) > RINGS * abs(leap.size) for side in sides)


def _to_and_fro(value: FloatArray) -> float:
    """Return by how much samples both rise and fall from one to a later one; 0 where they only do either."""
    if not value.size:
        return 0.0
    rise = float(np.max(value - np.minimum.accumulate(value)))
    return min(rise, float(np.max(np.maximum.accumulate(value) - value)))


def _order(leap: SampleJump) -> float:
    return -abs(leap.size) / (1.0 if leap.last - leap.first == WIDTHS[0] else _WIDER)


def _parts(channel: Samples) -> list[slice]:
    """Return what is looked at: all of it, or of a long record the stretches with the largest steps."""
    size = channel.value.size
    if size <= _WHOLE:
        return [slice(0, size)]
    scan = channel.scan
    chosen = np.sort(np.argsort(scan.step, kind="stable")[-_CHUNKS:])
    ends = np.append(scan.first[1:], size)
    return [
        slice(max(0, int(scan.first[i]) - _REACH), min(size, int(ends[i]) + _REACH)) for i in chosen.tolist()
    ]


def _sizes(channel: Samples, width: int) -> FloatArray:
    """Return :func:`_left` of a whole channel, shape (K,).

    Whether there may be leaps and which are the largest ones is asked of the same figures.
    """
    known = channel.left
    if width not in known:
        reach = width + 2 * BESIDE
        sizes = np.empty(max(0, channel.value.size - reach))
        for at in range(0, sizes.size, _CHUNK):
            sizes[at : at + _CHUNK] = _left(channel, slice(at, at + _CHUNK + reach), width)
        known[width] = sizes
    return known[width]


def _left(channel: Samples, part: slice, width: int) -> FloatArray:
    """Return what steps over ``width`` samples leave when the motion on either side is off, absolute."""
    time_s, value = channel.time_s[part], channel.value[part]
    inner = max(0, value.size - width - 2 * BESIDE)
    speed = np.diff(value)
    speed /= _lasting(np.diff(time_s))
    middle = _median3(speed[:-2], speed[1:-1], speed[2:])
    before, after = middle[:inner], middle[BESIDE + width :][:inner]
    own_s = time_s[BESIDE + width :][:inner] - time_s[BESIDE:][:inner]
    step = value[BESIDE + width :][:inner] - value[BESIDE:][:inner]
    low, high = np.minimum(before, after), np.maximum(before, after)
    low *= own_s
    high *= own_s
    step -= np.minimum(np.maximum(step, low, out=low), high, out=high)
    return np.abs(step, out=step)


def _lasting(step_s: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(step_s, np.finfo(np.float64).tiny))


def _leaps(channel: Samples, part: slice, width: int, count: int) -> list[SampleJump]:
    """Return the largest of what steps over ``width`` samples leave when the motion on either side is off."""
    whole = part == slice(0, channel.value.size)
    size = _sizes(channel, width) if whole else _left(channel, part, width)
    largest = np.argpartition(size, -count)[-count:] if size.size > count else np.arange(size.size)
    largest += part.start
    time_s, value = channel.time_s, channel.value
    first, last = largest + BESIDE, largest + BESIDE + width
    sides = [[at + k for k in range(BESIDE)] for at in (largest, last)]
    steps_s = [[time_s[at + 1] - time_s[at] for at in side] for side in sides]
    beside_s = np.minimum(*(_median3(*map(_lasting, side)) for side in steps_s))
    one, two = (
        _median3(*((value[at + 1] - value[at]) / _lasting(own) for at, own in zip(side, lasts, strict=True)))
        for side, lasts in zip(sides, steps_s, strict=True)
    )
    own = time_s[last] - time_s[first]
    # Stamps may be rounded: the motion may have gone on for as long as steps beside last.
    made = np.stack([speed * lasts_s for speed in (one, two) for lasts_s in (own, width * beside_s)])
    step = value[last] - value[first]
    beyond = step - np.clip(step, np.min(made, axis=0), np.max(made, axis=0))
    moves = np.maximum(np.abs(one), np.abs(two)) * own
    told = (own <= LONGER * width * beside_s) & (moves < _MOVES[width] * np.abs(beyond)) & (beyond != 0.0)
    return [
        SampleJump(at, at + width, size)
        for at, size in zip(first[told].tolist(), beyond[told].tolist(), strict=True)
    ]


def _median3(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c)))
