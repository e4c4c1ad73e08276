"""Dwells at a reversal: the stroke arrives, rests or creeps, and leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.cycles.dwell_corners import corner_moment
from bufferstand.evaluation.cycles.turn_neighbourhood import TurnNeighbourhood
from bufferstand.evaluation.numerics import FloatArray

PLATEAU_BANDS = (0.001, 0.003, 0.01)
"""Half-widths of the bands, as shares of the height; the wider ones see a dwell during which it creeps."""
LEAST_SAMPLES = 4
"""A dwell has at least so many samples."""
_NEAR = 0.05
_RESOLVED_STEPS = 2.0
"""A band is no narrower than so many of the smallest steps: the rounded top of a coarse sine is no dwell …"""
_SURE_SAMPLES = 10
"""… where that has so few samples."""
PLATEAU_NOISE = 6.5
PLATEAU_WIDER = 9.0
PLATEAU_RATIO = 1.8
"""Time within nine bands over time within one: 3 for a parabola, 9 for a triangle, towards 1 for a dwell."""
CUT_OFF_RATIO = 1.5
"""The same where the record ends within nine bands: of a parabola cut off beyond its top 2 is left."""
_LEAST_LEVELLED = 16
_EASED = 0.03
EASED_S = 0.2
"""No stand is taken to ease into a rest, or to swing, for longer [s]: so long it needs to reverse at most."""
_PARTS = 8
_ONE_LEVEL = 4.0
"""Eight means of noise span 4 of their standard deviations or less in 90 of 100 dwells."""
_OF_MEDIAN = float(np.sqrt(0.5 * np.pi))
"""Standard deviation of the median of normal noise over that of its mean."""
_LEAST_LINE = 6
_ANOTHER = 3.0


@dataclass(frozen=True)
class Dwell:
    """A dwell: when and where the stroke arrives and leaves (turned as the side is), and its first sample."""

    arrive_s: float
    arrive: float
    leave_s: float
    leave: float
    index: int
    u: float
    u_arrive_s: float
    u_leave_s: float


def plateau(side: TurnNeighbourhood) -> Dwell | None:
    """Return the dwell about the peak, if it is one, at the finest scale at which it shows."""
    for share in PLATEAU_BANDS:
        band = max(PLATEAU_NOISE * side.sigma, share * side.wide_height)
        found = _within(side, band)
        few = found is not None and found[0].stop - found[0].start < _SURE_SAMPLES
        if few and band < (resolved := _RESOLVED_STEPS * _resolution(side)):
            band, found = resolved, _within(side, resolved)
        if found is not None:
            return _dwell(side, *found, band)
    return None


def _within(side: TurnNeighbourhood, band: float) -> tuple[slice, slice, float] | None:
    """Return the samples within one and nine bands about a dwell, and its level, if it is one."""
    near = side.value[side.above(side.value[side.peak] - 2.0 * band)]
    level = _middle(near)
    inner = side.above(level - band)
    if inner.stop - inner.start < side.least_samples:
        return None
    outer = side.above(level - PLATEAU_WIDER * band)
    inner_s = _time_above(side, inner, level - band)
    outer_s = _time_above(side, outer, level - PLATEAU_WIDER * band)
    cut_off = outer.start == 0 or outer.stop == side.value.size
    ratio = CUT_OFF_RATIO if cut_off else PLATEAU_RATIO
    return (inner, outer, level) if outer_s <= ratio * inner_s else None


def _middle(values: FloatArray) -> float:
    """Return the median; NumPy's own takes ten times as long for a handful of values."""
    order, half = np.sort(values), values.size // 2
    return float(order[half] if values.size % 2 else 0.5 * (order[half - 1] + order[half]))


def _time_above(side: TurnNeighbourhood, inside: slice, level: float) -> float:
    """Return the time between the crossings of a level, between samples: of four samples within the band of a
    rounded turn and six within nine bands, the span of the samples alone would make a dwell.
    """
    first, last = inside.start, inside.stop - 1
    begin, end = float(side.time_s[first]), float(side.time_s[last])
    if first > 0:
        begin -= _share(side.value[first], side.value[first - 1], level) * float(
            begin - side.time_s[first - 1]
        )
    if last + 1 < side.value.size:
        end += _share(side.value[last], side.value[last + 1], level) * float(side.time_s[last + 1] - end)
    return end - begin


def _share(inside: float, outside: float, level: float) -> float:
    """Return where the line from a sample inside to its neighbour outside crosses a level, 0 … 1."""
    return min(max(float((inside - level) / (inside - outside)), 0.0), 1.0) if inside > outside else 0.0


def _resolution(side: TurnNeighbourhood) -> float:
    """Return the smallest step between neighbours near the peak, 0 where it is no converter's."""
    near = side.value[side.above(side.value[side.peak] - _NEAR * side.height)]
    step = np.abs(np.diff(near))
    least = float(np.min(step[step > 0.0], initial=np.inf))
    return least if least <= PLATEAU_BANDS[-1] * side.height else 0.0


def _dwell(side: TurnNeighbourhood, inner: slice, outer: slice, level: float, band: float) -> Dwell:
    time, value = side.time_s[inner], side.value[inner]
    rise_s = float(time[0] - side.time_s[outer.start])
    fall_s = float(side.time_s[outer.stop - 1] - time[-1])
    climb = (PLATEAU_WIDER - 1.0) * band
    read = np.ones(value.size, dtype=bool) if side.read is None else side.read[inner]
    arrive_s, arrive, arriving = _corner(time, value, read, level - band, rise_s / climb)
    leave_s, leave, leaving = _corner(-time[::-1], value[::-1], read[::-1], level - band, fall_s / climb)
    steps = np.diff(value[read])
    scatter = max(side.sigma, float(np.std(steps)) / float(np.sqrt(2.0))) if steps.size else side.sigma
    u = _OF_MEDIAN * scatter / float(np.sqrt(min(arriving, leaving)))
    u_arrive_s = u_leave_s = side.step_s
    if (at := corner_moment(side.time_s, side.value, inner.start, arrive, band, side.sigma)) is not None:
        arrive_s, u_arrive_s = at
    back = side.value.size - inner.stop
    if (at := corner_moment(-side.time_s[::-1], side.value[::-1], back, leave, band, side.sigma)) is not None:
        leave_s, u_leave_s = at
    if (levels := _levels(side, arrive_s, leave_s)) is not None:
        arrive, leave, u = levels
    arrive_s = min(arrive_s, 0.5 * float(time[0] + time[-1]))
    leave_s = min(leave_s, -0.5 * float(time[0] + time[-1]))
    index = inner.start + int(np.searchsorted(time, arrive_s))
    return Dwell(
        arrive_s, arrive, max(-leave_s, arrive_s), leave, side.first + index, u, u_arrive_s, u_leave_s
    )


def _levels(side: TurnNeighbourhood, arrive_s: float, leave_s: float) -> tuple[float, float, float] | None:
    """Return the levels at both ends of a dwell, and their u; None where it has too few samples.

    Eighths of the dwell are averaged. Those at its ends that still belong to a rounded arrival lie below the
    middle, and do not count. Where the rest is one level within the noise that is the level; else the stroke
    creeps, and lines say where it is at either end.
    """
    # A stand eases into a rest and out of it, so that the corners are no part of it.
    rest_s = -leave_s - arrive_s
    inset_s = max(_EASED * rest_s, min(EASED_S, rest_s / _PARTS))
    time, value = side.time_s, side.value
    if side.read is not None:
        time, value = time[side.read], value[side.read]
    first, last = np.searchsorted(time, (arrive_s + inset_s, -leave_s - inset_s))
    samples = int(last - first)
    if samples < _LEAST_LEVELLED:
        return None
    edges = first + np.round(np.arange(_PARTS + 1) * samples / _PARTS).astype(int)
    means = np.add.reduceat(value, edges[:-1])[: _PARTS - 1] / np.diff(edges)[:-1]
    means = np.append(means, np.mean(value[edges[-2] : edges[-1]]))
    scatter = max(side.sigma, float(np.std(np.diff(value[first:last]))) / float(np.sqrt(2.0)))
    u = scatter / float(np.sqrt(samples / _PARTS))
    middle = means[_PARTS // 4 : -(_PARTS // 4)]
    least = _middle(middle) - 3.0 * u - 3.0 * float(np.ptp(middle))
    inside = np.flatnonzero(means >= least)
    kept = means[inside[0] : inside[-1] + 1]
    if np.ptp(kept) <= _ONE_LEVEL * u:
        level = float(np.mean(kept))
        return level, level, u / float(np.sqrt(kept.size))
    creeping = value[edges[inside[0]] : edges[inside[-1] + 1]]
    (arrive, u_arrive), (leave, u_leave) = (_end_level(own, scatter) for own in (creeping[::-1], creeping))
    return arrive, leave, max(u_arrive, u_leave)


def _end_level(value: FloatArray, scatter: float) -> tuple[float, float]:
    """Return the level at which creeping samples end, and its u: by a line over their last part.

    Creep is fast at first: the part is halved for as long as that says another level.
    """
    number = max(_LEAST_LINE, 3 * value.size // 8)
    found, u = _line_end(value[-number:], scatter)
    while number >= 2 * _LEAST_LINE:
        number //= 2
        shorter, u_shorter = _line_end(value[-number:], scatter)
        if abs(shorter - found) <= _ANOTHER * u_shorter:
            break
        found, u = shorter, u_shorter
    return found, u


def _line_end(value: FloatArray, scatter: float) -> tuple[float, float]:
    """Return where a line through samples ends, and its u; their mean where it is level."""
    place = np.arange(value.size) - 0.5 * (value.size - 1)
    spread = float(place @ place)
    slope, mean = float(place @ value) / spread, float(np.mean(value))
    u_mean, u_slope = scatter / float(np.sqrt(value.size)), scatter / float(np.sqrt(spread))
    if abs(slope) <= 2.0 * u_slope:
        return mean, u_mean
    reach = 0.5 * value.size
    return mean + reach * slope, float(np.hypot(u_mean, reach * u_slope))


def _corner(
    time: FloatArray, value: FloatArray, read: NDArray[np.bool_], entered: float, slowness: float
) -> tuple[float, float, int]:
    """Return time and value where a flank, which enters the band at ``time[0]``, meets the dwell; of how many
    samples that were read the value is the median.

    ``slowness`` is the flank's time per value. The value is the median just behind the corner, so that
    creep during the dwell does not shift it.
    """
    middle = 0.5 * float(time[0] + time[-1])
    corner, level = float(time[0]), _middle(value)
    for _ in range(3):
        corner = min(float(time[0]) + max(level - entered, 0.0) * slowness, middle)
        first = max(0, min(int(np.searchsorted(time, corner)), time.size - LEAST_SAMPLES))
        span = max(2.0 * abs(level - entered) * slowness, 0.02 * float(time[-1] - time[0]))
        last = max(int(np.searchsorted(time, corner + span)), first + LEAST_SAMPLES)
        level = _middle(value[first:last])
    return corner, level, max(1, int(np.count_nonzero(read[first:last])))
