"""A recorded run as the identification sees it: a de-noised stroke through nodes, and forces at some of them.

The spring's law is exact over any monotone stroke, and sees every reversal. So what matters of a noisy stroke
is where it turns; between two turns a few samples are as good as all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import isotonic_regression

from bufferstand.foundation import BadInput

Floats = NDArray[np.float64]
Places = NDArray[np.intp]

_TURN_MM = 0.3
"""A smooth turn is fitted with a parabola over the samples within this distance of it …"""
_CORNER_MM = 1.0
"""… and a sharp one with two straight lines over this much."""
_TURN_SAMPLES = 400
_TRANSITION_MM = 4.0
"""Way over which the memory of a turn is taken to fade; only for weighting."""
_REST_S = 2.0
"""Nodes of a standing spring are no further apart than this."""
_STILL_MM, _STILL_S = 0.08, 0.3
"""A half stroke that begins with a rest has a node where it leaves it: fast branches relax until then."""
_LEAST_SHARE = 1e-4
"""Noise of the force is taken as this share of the largest force at least: filters make it look smaller."""
_CHUNK = 8
"""The way between turns is looked through by the extremes of so many samples."""


@dataclass(frozen=True, eq=False)
class Reduction:
    """How densely a run is kept.

    Parameters
    ----------
    near_mm, far_mm, growth : float
        Distance of nodes at a turn, greatest distance, and by which share of the way from the turn it grows.
    block_mm : float
        Widest stroke over which samples are averaged to one node.
    block_samples : int
        Most samples that are averaged.
    reversal_mm : float
        Least movement that counts as a reversal; at least six times the noise of the stroke is taken anyway.
    """

    near_mm: float = 0.3
    far_mm: float = 2.5
    growth: float = 0.2
    block_mm: float = 0.1
    block_samples: int = 10
    reversal_mm: float = 0.06


@dataclass(frozen=True, eq=False)
class Drive:
    """Nodes of one run, and what was measured there.

    Attributes
    ----------
    time_s, stroke_mm : arrays, shape (n,)
        Nodes; the stroke is monotone between its turns.
    half : array of int, shape (n,)
        Number of the half stroke that each node belongs to; 0 is the first loading.
    node : array of int, shape (m,)
        Nodes at which force was measured.
    force_kN, force_sigma_kN : arrays, shape (m,)
        Force there and the standard deviation of its noise, that of the stroke included.
    sensor_s, sensor_C : arrays, shape (k,)
        Readings of the specimen's temperature.
    ambient_C : float
        Temperature of the surroundings.
    turn_kN : array, shape (m,)
        What one standard deviation of the fitted turn before it does to the force: common to a half stroke.
    rested : bool
        Whether the spring had rested until it was as warm as its sensor.
    runs : tuple of (float, str)
        Begin [s] and name of every run in it.
    """

    time_s: Floats
    stroke_mm: Floats
    half: Places
    node: Places
    force_kN: Floats
    force_sigma_kN: Floats
    turn_kN: Floats
    sensor_s: Floats
    sensor_C: Floats
    ambient_C: float
    rested: bool = False
    runs: tuple[tuple[float, str], ...] = ()

    def name_at(self, time_s: float) -> str:
        """Return the name of the run at a time; empty if there is none."""
        names = [name for begin, name in self.runs if begin <= time_s + 1e-9]
        return names[-1] if names else ""

    @property
    def name(self) -> str:
        """Names of the runs, for messages."""
        return ", ".join(name for _, name in self.runs if name)


def noise_of(values: Floats) -> float:
    """Return the standard deviation of white noise on a smooth signal, from its third differences.

    Robust (median), so that turns and steps do not count; no less than a third of the values' resolution.
    """
    if values.size < 8:
        return 0.0
    third = np.diff(values, n=3)
    steps = np.abs(np.diff(values))
    resolution = float(np.min(steps[steps > 0.0], initial=np.inf))
    floor = 0.3 * resolution if np.isfinite(resolution) and np.mean(steps == 0.0) > 0.01 else 0.0
    return max(float(1.4826 * np.median(np.abs(third)) / np.sqrt(20.0)), floor)


def find_turns(stroke_mm: Floats, least_mm: float) -> list[int]:
    """Return the samples at which the stroke turns, first and last sample included.

    A turn counts when the stroke moves away from it by ``least_mm`` or more.
    """
    turns, rising = [0], None
    low = high = (float(stroke_mm[0]), 0)
    for at, x in zip(*_extremes(stroke_mm), strict=True):
        high, low = max(high, (x, at), key=_value), min(low, (x, at), key=_value)
        if rising is not False and high[0] - x >= least_mm:
            if rising and high[1] > turns[-1]:
                turns.append(high[1])
            rising, low, high = False, (x, at), (x, at)
        elif rising is not True and x - low[0] >= least_mm:
            if rising is False and low[1] > turns[-1]:
                turns.append(low[1])
            rising, low, high = True, (x, at), (x, at)
        elif rising:
            low = high
        elif rising is False:
            high = low
    if turns[-1] != stroke_mm.size - 1:
        turns.append(stroke_mm.size - 1)
    return turns


def _value(extreme: tuple[float, int]) -> float:
    return extreme[0]


def _extremes(stroke_mm: Floats) -> tuple[list[int], list[float]]:
    """Return place and value of the least and the largest sample of every few, in order of time."""
    whole = stroke_mm.size // _CHUNK * _CHUNK
    rows = stroke_mm[:whole].reshape(-1, _CHUNK)
    base = np.arange(0, whole, _CHUNK)
    both = np.stack([base + rows.argmin(axis=1), base + rows.argmax(axis=1)], axis=1)
    at = np.concatenate([np.sort(both, axis=1).ravel(), np.arange(whole, stroke_mm.size)])
    return at.tolist(), stroke_mm[at].tolist()


@dataclass(frozen=True)
class _Turn:
    time_s: float
    stroke_mm: float
    sigma_mm: float = 0.0


def _fit_turn(time: Floats, stroke: Floats, at: int, limits: tuple[int, int], sigma: float) -> _Turn:
    """Return where and when the stroke turned: the better one of a parabola and two straight lines."""
    least = min(abs(stroke[at] - stroke[end]) for end in limits)
    first, last = _window(stroke, at, limits, min(_TURN_MM, 0.06 * least) + 2.0 * sigma)
    raw = _Turn(float(time[at]), float(stroke[at]), sigma)
    if last - first < 5:
        return raw
    t = time[first : last + 1] - time[at]
    x = stroke[first : last + 1]
    scale = float(np.max(np.abs(t)))
    fit = np.polynomial.polynomial.polyfit(t / scale, x, 2)
    smooth = float(np.sum((x - np.polynomial.polynomial.polyval(t / scale, fit)) ** 2))
    corner = _corner(time, stroke, at, (first, last), sigma)
    if corner is not None and corner[1] < smooth:
        wide = _corner(time, stroke, at, _window(stroke, at, limits, _CORNER_MM + 2.0 * sigma), sigma)
        return (wide or corner)[0]
    vertex = -0.5 * fit[1] / fit[2] if fit[2] != 0.0 else np.inf
    if (fit[2] < 0.0) != (stroke[at] >= stroke[limits[0]]) or abs(vertex) > 1.0:
        return raw
    top = float(fit[0] - 0.25 * fit[1] ** 2 / fit[2])
    return _Turn(float(time[at] + vertex * scale), top, 1.5 * sigma / float(np.sqrt(t.size)))


def _window(stroke: Floats, at: int, limits: tuple[int, int], reach_mm: float) -> tuple[int, int]:
    """Return first and last sample about ``at`` within ``reach_mm`` of it, without a gap."""
    first, last = max(limits[0], at - _TURN_SAMPLES), min(limits[1], at + _TURN_SAMPLES)
    off = np.abs(stroke[first : last + 1] - stroke[at]) > reach_mm
    here = at - first
    before, after = np.flatnonzero(off[:here]), np.flatnonzero(off[here:])
    return (
        first + int(before[-1]) + 1 if before.size else first,
        at + int(after[0]) - 1 if after.size else last,
    )


def _corner(
    time: Floats, stroke: Floats, at: int, window: tuple[int, int], sigma: float
) -> tuple[_Turn, float] | None:
    """Return where two straight lines meet, and their sum of squares; None if they do not meet near by."""
    first, last = window
    if at - first < 3 or last - at < 3:
        return None
    left, right = slice(first, at), slice(at + 1, last + 1)
    (a1, b1), square1, *_ = np.polyfit(time[left] - time[at], stroke[left], 1, full=True)
    (a2, b2), square2, *_ = np.polyfit(time[right] - time[at], stroke[right], 1, full=True)
    if a1 * a2 >= 0.0:
        return None
    meet = (b2 - b1) / (a1 - a2)
    reach = time[min(at + 2, last)] - time[max(at - 2, first)] + 4.0 * sigma / min(abs(a1), abs(a2))
    if abs(meet) > reach:
        return None
    spread = 2.0 * sigma / float(np.sqrt(last - first))
    turn = _Turn(float(time[at] + meet), float(b1 + a1 * meet), spread)
    return turn, float(np.sum(square1) + np.sum(square2))


def reduce_run(
    time_s: ArrayLike,
    stroke_mm: ArrayLike,
    force_kN: ArrayLike,
    *,
    sensor_s: ArrayLike = (),
    sensor_C: ArrayLike = (),
    ambient_C: float,
    rested: bool = False,
    reduction: Reduction | None = None,
    name: str = "",
) -> Drive:
    """De-noise a recorded stroke and keep as many samples as the identification needs.

    Turns are fitted (parabola or two lines over the samples next to them). Between two turns the samples are
    averaged over short stretches of stroke, force with stroke, and made monotone (isotonic regression), so
    that noise does not pass for reversals.

    Parameters
    ----------
    time_s, stroke_mm, force_kN : array_like, shape (N,)
        As recorded, rising time; seconds, mm, kN.
    sensor_s, sensor_C : array_like, shape (k,)
        Temperature of the specimen as measured; empty if it was not.
    ambient_C : float
        Temperature of the surroundings.
    rested : bool
        Whether the spring had rested before, so that it is as warm as its sensor.
    reduction : Reduction, optional
    name : str
        Of the run.

    Returns
    -------
    Drive

    Raises
    ------
    BadInput
        If the record is too short to say anything.
    """
    how = reduction or Reduction()
    time, stroke, force = (np.asarray(values, dtype=np.float64) for values in (time_s, stroke_mm, force_kN))
    if time.size < 16:
        raise BadInput("the record has fewer than 16 samples", file=name or None)
    sigma_x, sigma_F = noise_of(stroke), noise_of(force)
    turns = find_turns(stroke, max(how.reversal_mm, 6.0 * sigma_x))
    fitted = [_Turn(float(time[0]), float(stroke[0]))]
    for before, at, after in zip(turns, turns[1:], turns[2:], strict=False):
        fitted.append(_fit_turn(time, stroke, at, (before, after), sigma_x))
    fitted.append(_Turn(float(time[-1]), float(stroke[-1])))
    parts = [
        _half(time, stroke, force, (turns[i], turns[i + 1]), (fitted[i], fitted[i + 1]), how)
        for i in range(len(turns) - 1)
    ]
    return _assemble(parts, (sigma_x, sigma_F), sensor_s, sensor_C, ambient_C, name, rested)


@dataclass(frozen=True, eq=False)
class _Half:
    """One half stroke: nodes with its beginning, without its end; ``count`` samples each, 0 at the turn."""

    time: Floats
    stroke: Floats
    force: Floats
    count: Floats
    turn_sigma_mm: float


def _half(
    time: Floats,
    stroke: Floats,
    force: Floats,
    ends: tuple[int, int],
    turns: tuple[_Turn, _Turn],
    how: Reduction,
) -> _Half:
    start, end = turns
    first, last = ends[0] + 1, ends[1]
    t = time[first:last]
    inside = (t > start.time_s) & (t < end.time_s)
    if not np.any(inside):
        return _Half(
            np.array([start.time_s]), np.array([start.stroke_mm]), np.zeros(1), np.zeros(1), start.sigma_mm
        )
    first += int(np.argmax(inside))
    last = first + int(np.count_nonzero(inside))
    blocks = _blocks(time[first:last], stroke[first:last], start.stroke_mm, how)
    edges = np.stack(blocks, axis=1).ravel()
    count = (blocks[1] - blocks[0]).astype(np.float64)
    means = [_sums(values[first:last], edges) / count for values in (time, stroke, force)]
    low, high = sorted((start.stroke_mm, end.stroke_mm))
    rising = end.stroke_mm >= start.stroke_mm
    monotone = isotonic_regression(means[1], weights=count, increasing=rising).x
    return _Half(
        np.concatenate([[start.time_s], means[0]]),
        np.concatenate([[start.stroke_mm], np.clip(monotone, low, high)]),
        np.concatenate([[0.0], means[2]]),
        np.concatenate([[0.0], count]),
        start.sigma_mm,
    )


def _sums(values: Floats, edges: Places) -> Floats:
    """Return the sums between pairs of edges (begin, end, begin, end …)."""
    total = np.concatenate([[0.0], np.cumsum(values - values[0])])
    pairs = edges.reshape(-1, 2)
    return np.asarray(
        total[pairs[:, 1]] - total[pairs[:, 0]] + values[0] * (pairs[:, 1] - pairs[:, 0]), dtype=np.float64
    )


def _blocks(time: Floats, stroke: Floats, start_mm: float, how: Reduction) -> tuple[Places, Places]:
    """Return first and last-but-one sample of the stretches that become nodes of a half stroke."""
    way = np.maximum.accumulate(np.abs(stroke - start_mm))
    total = float(way[-1])
    marks = [0.0]
    while marks[-1] < total:
        from_turn = min(marks[-1], total - marks[-1])
        marks.append(marks[-1] + min(how.near_mm + how.growth * from_turn, how.far_mm))
    by_way = np.searchsorted(way, marks[:-1])
    resting = np.searchsorted(time, np.arange(time[0], time[-1], _REST_S))
    still = max(int(np.searchsorted(way, _STILL_MM)) - 1, 0)
    leaving = [still] if time[still] - time[0] > _STILL_S else []
    begin = np.unique(np.concatenate([by_way, resting, leaving])).astype(np.intp)
    begin = begin[begin < time.size]
    width = np.minimum(np.diff(begin, append=time.size), how.block_samples)
    reach = np.searchsorted(way, way[begin] + how.block_mm, side="right") - begin
    return begin, begin + np.maximum(np.minimum(width, reach), 1)


def _assemble(
    parts: Sequence[_Half],
    noise: tuple[float, float],
    sensor_s: ArrayLike,
    sensor_C: ArrayLike,
    ambient_C: float,
    name: str,
    rested: bool,
) -> Drive:
    time, stroke, force, count = (
        np.concatenate([getattr(part, field) for part in parts])
        for field in ("time", "stroke", "force", "count")
    )
    half = np.repeat(np.arange(len(parts)), [part.time.size for part in parts])
    order = np.concatenate([[True], np.diff(time) > 0.0])
    time, stroke, force, count, half = (v[order] for v in (time, stroke, force, count, half))
    node = np.flatnonzero(count > 0.0)
    slope = np.abs(np.gradient(force[node], time[node])) / np.maximum(
        np.abs(np.gradient(stroke[node], time[node])), 1e-6
    )
    steep = np.minimum(slope, float(np.quantile(slope, 0.98)))
    # How the force moves with the turn before it: as it moves with the stroke while it leaves the curve.
    start_mm = np.concatenate([np.full(part.time.size, part.stroke[0]) for part in parts])[order]
    turn_mm = np.concatenate([np.full(part.time.size, part.turn_sigma_mm) for part in parts])[order]
    fading = np.exp(-np.abs(stroke - start_mm)[node] / _TRANSITION_MM)
    sigma = np.sqrt((noise[1] ** 2 + (steep * noise[0]) ** 2) / count[node])
    return Drive(
        time_s=time,
        stroke_mm=stroke,
        half=half,
        node=node,
        force_kN=force[node],
        force_sigma_kN=np.maximum(sigma, _LEAST_SHARE * float(np.max(np.abs(force[node])))),
        turn_kN=steep * fading * turn_mm[node],
        sensor_s=np.asarray(sensor_s, dtype=np.float64),
        sensor_C=np.asarray(sensor_C, dtype=np.float64),
        ambient_C=ambient_C,
        rested=rested,
        runs=((float(time[0]), name),),
    )


def join(drives: Sequence[Drive]) -> Drive:
    """Return drives that follow each other in time as one: between them the spring stands unloaded.

    Parameters
    ----------
    drives : sequence of Drive
        In order, on one clock, each beginning and ending at zero stroke.

    Raises
    ------
    BadInput
        If one begins before its predecessor ends.
    """
    time, stroke, half, node, halves, nodes = [], [], [], [], 0, 0
    last_s: float | None = None
    for drive in drives:
        begin = float(drive.time_s[0])
        if last_s is not None:
            if begin <= last_s:
                raise BadInput(
                    f"{drive.name or 'a run'} begins before its predecessor ends",
                    remedy="runs that overlap in time cannot be of one specimen",
                )
            rests = np.arange(last_s, begin, _REST_S)[1:]
            time.append(rests)
            stroke.append(np.zeros(rests.size))
            half.append(np.full(rests.size, halves))
            nodes += rests.size
        time.append(drive.time_s)
        stroke.append(drive.stroke_mm)
        half.append(drive.half + halves)
        node.append(drive.node + nodes)
        halves += int(drive.half[-1]) + 1
        nodes += drive.time_s.size
        last_s = float(drive.time_s[-1])
    return Drive(
        time_s=np.concatenate(time),
        stroke_mm=np.concatenate(stroke),
        half=np.concatenate(half),
        node=np.concatenate(node),
        force_kN=np.concatenate([drive.force_kN for drive in drives]),
        force_sigma_kN=np.concatenate([drive.force_sigma_kN for drive in drives]),
        turn_kN=np.concatenate([drive.turn_kN for drive in drives]),
        sensor_s=np.concatenate([drive.sensor_s for drive in drives]),
        sensor_C=np.concatenate([drive.sensor_C for drive in drives]),
        ambient_C=float(np.mean([drive.ambient_C for drive in drives])),
        rested=drives[0].rested,
        runs=tuple(run for drive in drives for run in drive.runs),
    )
