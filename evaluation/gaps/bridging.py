"""Which of a record's breaks are rest, which are bridged, and across which nothing is fitted.

Rest is rest, logged or not: between two samples of the same stroke and force, where the stroke does not move
into the hole or not out of it, nothing happened but time. A logger that stops at rest wakes up with the
motion: its first sample may be a step into it. Samples at rest are put in, so that a dwell is seen as one.
What is left is bridged: the curves that are fitted and integrated go through it as through any step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray, IndexArray, Sampling, find_reversals, sampling_of
from bufferstand.evaluation.record import LONGER, Defect, Record
from bufferstand.foundation.numbers import median

SAME_SIGMAS, SAME_STEPS, SAME_SHARE = 6.0, 1.5, 1e-4
"""Two values are the same within so many standard deviations of the noise, steps of the converter, or this
share of the channel's range."""
CREEP, RELAXATION = 0.02, 0.2
"""Where the stroke is still on both sides it may have crept, and the force relaxed, by these shares of their
ranges."""
WIDE = 0.1
"""Across a hole longer than this share of the shortest stroke nothing is fitted."""
_LEAST_NEAR, _MOST_NEAR = 3, 12
"""The stroke is still beside a hole if its samples over half the hole's length, at least and at most so many,
have no slope that would have led it anywhere within the hole."""
_HELD, _HELD_SAMPLES = 8.0, 8
"""In a record by event the stroke rests in a step of so many usual ones; so many samples say so."""
ASTIR = 1.5
"""Where one side is still and the other leaves it, the stroke may have moved by so many of its steps."""
_REST_SAMPLES = 48
"""At most so many samples are put into a rest."""
_BEYOND_RANGE = 0.25
"""A motion that would have gone on for this share of the record's range within the hole did stop."""
_MORE_ROWS = 0.5
"""Samples with stamps of the past leave; where less than this share of their own time is behind them when the
stamps rise again, the clock was set, and how long that took is not known."""


@dataclass(frozen=True)
class RecordGap:
    """A step in which more may have happened than the sampling usually sees, from ``start_s`` to ``end_s``.

    ``rest``: nothing did. ``wide``: nothing is fitted across it. ``unknown``: how long it lasted is not
    known. ``text`` says what it is; ``change_mm`` is by what the stroke differs behind it.
    """

    start_s: float
    end_s: float
    text: str
    change_mm: float = 0.0
    rest: bool = False
    wide: bool = False
    unknown: bool = False

    @property
    def length_s(self) -> float:
        """How long it lasted by its time stamps [s]."""
        return self.end_s - self.start_s


@dataclass(frozen=True, eq=False)
class Bridged:
    """A record whose rests have samples, and whose ``breaks`` are wide holes only; and all its holes."""

    record: Record
    holes: tuple[RecordGap, ...] = ()


def bridged(record: Record) -> Bridged:
    """Bridge the breaks of a record.

    Parameters
    ----------
    record : Record
        As it was cleaned, or averaged over blocks.

    Returns
    -------
    Bridged
        The same record where it has no breaks.
    """
    if record.by_event:
        record = _held(record)
    breaks = np.array(record.breaks, dtype=np.intp)
    if not breaks.size:
        return Bridged(record)
    unknown = _of_unknown_length(record, breaks)
    counts = unknown | _is_long(record.time_s, breaks)
    breaks, unknown = breaks[counts], unknown[counts]
    sampling = sampling_of(record.stroke_mm)
    rest, still = _rests(record, breaks, sampling)
    filled, places = _filled(record, breaks, rest, still)
    length_s = record.time_s[breaks] - record.time_s[breaks - 1]
    wide = ~rest & (unknown | (length_s > WIDE * _shortest_stroke_s(filled, sampling)))
    holes = tuple(
        RecordGap(
            float(record.time_s[at - 1]),
            float(record.time_s[at]),
            text,
            abs(float(record.stroke_mm[at] - record.stroke_mm[at - 1])),
            rest=is_rest,
            wide=is_wide,
            unknown=is_unknown,
        )
        for at, text, is_rest, is_wide, is_unknown in zip(
            breaks.tolist(),
            _texts(record, breaks),
            rest.tolist(),
            wide.tolist(),
            unknown.tolist(),
            strict=True,
        )
    )
    return Bridged(replace(filled, breaks=tuple(places[wide].tolist())), holes)


def _held(record: Record) -> Record:
    """Return a record that is written by event with a few samples in its long steps, in which it rests.

    The stroke stays within an event of where it was until about the usual step before the next sample.
    """
    step_s = np.diff(record.time_s)
    usual_s = median(step_s)
    long = np.flatnonzero(step_s > _HELD * usual_s)
    long = np.setdiff1d(long, np.array(record.breaks, dtype=np.intp) - 1)
    count = np.minimum(np.round(step_s[long] / usual_s).astype(np.intp) - 1, _HELD_SAMPLES)
    at = np.repeat(long, count)
    rank = np.concatenate([np.arange(1, own + 1) for own in count.tolist()] or [np.zeros(0)])
    width_s = np.repeat((step_s[long] - usual_s) / np.maximum(count, 1), count)

    def column(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else np.insert(values, at + 1, values[at])

    return replace(
        record,
        time_s=np.insert(record.time_s, at + 1, record.time_s[at] + rank * width_s),
        stroke_mm=np.insert(record.stroke_mm, at + 1, record.stroke_mm[at]),
        force_kN=np.insert(record.force_kN, at + 1, record.force_kN[at]),
        speed_mm_per_s=column(record.speed_mm_per_s),
        wire_difference_mm=column(record.wire_difference_mm),
        breaks=tuple(b + int(np.searchsorted(at, b - 1)) for b in record.breaks),
        filled_s=_spans(record.time_s, long),
    )


def _spans(time_s: FloatArray, steps: IndexArray) -> tuple[tuple[float, float], ...]:
    """Return from when to when some steps last."""
    return tuple(zip(time_s[steps].tolist(), time_s[steps + 1].tolist(), strict=True))


def _is_long(time_s: FloatArray, breaks: IndexArray) -> NDArray[np.bool_]:
    """Say which breaks are longer than the steps beside them: a sample may leave, and nothing is missing."""
    step = np.diff(time_s)
    at = breaks - 1
    near = at[:, None] + np.array([-3, -2, -1, 1, 2, 3])
    there = (near >= 0) & (near < step.size)
    around = np.where(there, step[np.clip(near, 0, step.size - 1)], np.nan)
    alone = ~there.any(axis=1)
    around[alone] = 0.0
    return np.asarray(step[at] > LONGER * np.nanmedian(around, axis=1))


def _of_unknown_length(record: Record, breaks: IndexArray) -> NDArray[np.bool_]:
    """Say at which breaks more samples left than time passed by their stamps: the clock was set."""
    usual_s = median(np.diff(record.time_s)) / record.averaged
    inside_s = [
        0.5 * (d.start_s + d.end_s)
        for d in record.defects
        if d.unknown or (d.kind == "backward-time" and d.end_s - d.start_s < _MORE_ROWS * d.samples * usual_s)
    ]
    if not inside_s:
        return np.zeros(breaks.size, dtype=bool)
    moments = np.array(sorted(inside_s))
    # Means over blocks have moments of their own: the break is the one that lies about it.
    return np.asarray(
        np.searchsorted(moments, record.time_s[breaks], side="right")
        > np.searchsorted(moments, record.time_s[breaks - 1])
    )


@dataclass(frozen=True, eq=False)
class _Sides:
    """The stroke beside a hole: ``into`` and ``out_of`` it [mm/s], and whether it is still on either side.

    ``step_mm``: what it moves by in a usual step, on the side on which it moves.
    """

    into: float
    out_of: float
    still: tuple[bool, bool]
    step_mm: float

    def astir(self, change_mm: float) -> bool:
        """Say whether a change of the stroke across the hole is the beginning, or the end, of the motion."""
        if self.still == (True, False):
            leaves = change_mm * self.out_of >= 0.0
        elif self.still == (False, True):
            leaves = change_mm * self.into >= 0.0
        else:
            return False
        return leaves and abs(change_mm) <= ASTIR * self.step_mm


def _rests(
    record: Record, breaks: IndexArray, sampling: Sampling
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Say which breaks are rest, shape (B,); and on which sides of them the stroke is still, (B, 2)."""
    stroke, force = record.stroke_mm, record.force_kN
    same = alike_within(stroke, sampling), alike_within(force, sampling_of(force))
    change_mm, change_kN = (values[breaks] - values[breaks - 1] for values in (stroke, force))
    apart = np.abs(change_mm), np.abs(change_kN)
    spans = float(np.ptp(stroke)), float(np.ptp(force))
    alike = (apart[0] <= same[0]) & (apart[1] <= same[1])
    near = (apart[0] <= CREEP * spans[0]) & (apart[1] <= RELAXATION * spans[1])
    rest, still = np.zeros(breaks.size, dtype=bool), np.zeros((breaks.size, 2), dtype=bool)
    for row in np.flatnonzero(alike | near).tolist():
        sides = _sides(record, int(breaks[row]), sampling.sigma, spans[0])
        rest[row] = (
            all(sides.still)
            or (bool(alike[row]) and (any(sides.still) or _stopped(record, int(breaks[row]), sides, same[0])))
            or sides.astir(float(change_mm[row]))
        )
        still[row] = sides.still
    return rest, still


def alike_within(values: FloatArray, sampling: Sampling) -> float:
    """Return by how much two values may differ that are the same."""
    span = float(np.ptp(values)) if values.size else 0.0
    return max(SAME_SIGMAS * sampling.sigma, SAME_STEPS * sampling.step, SAME_SHARE * span)


def _sides(record: Record, at: int, sigma_mm: float, range_mm: float) -> _Sides:
    """Return how the stroke moves beside the hole between samples ``at`` - 1 and ``at``."""
    length_s = float(record.time_s[at] - record.time_s[at - 1])
    speeds, still, step_mm = [], [], 0.0
    for side in _beside(record.time_s, at):
        speed, u = _speed(record.time_s[side], record.stroke_mm[side], sigma_mm)
        speeds.append(speed)
        led_mm = 0.25 * length_s * abs(speed)
        enough = side.stop - side.start >= _LEAST_NEAR
        still.append(enough and led_mm <= max(0.75 * length_s * u, SAME_SHARE * range_mm))
        if enough and not still[-1]:
            step_mm = max(step_mm, abs(speed) * median(np.diff(record.time_s[side])))
    return _Sides(speeds[0], speeds[1], (still[0], still[1]), step_mm)


def _beside(time_s: FloatArray, at: int) -> tuple[slice, slice]:
    """Return the samples that are looked at before and behind the hole between ``at`` - 1 and ``at``."""
    length_s = float(time_s[at] - time_s[at - 1])
    left = _near(time_s[at - 1] - time_s[max(0, at - _MOST_NEAR - 1) : at][::-1], length_s)
    right = _near(time_s[at : at + _MOST_NEAR + 1] - time_s[at], length_s)
    return slice(at - left, at), slice(at, at + right)


def _near(away_s: FloatArray, length_s: float) -> int:
    """Return how many samples beside a hole are looked at."""
    within = int(np.searchsorted(away_s[: _MOST_NEAR + 1], 0.5 * length_s, side="right"))
    return min(max(within, _LEAST_NEAR), away_s.size, _MOST_NEAR)


def _speed(time_s: FloatArray, stroke_mm: FloatArray, sigma_mm: float) -> tuple[float, float]:
    """Return the slope of a line through a few samples and its u by noise; 0 through one."""
    if time_s.size < 2:
        return 0.0, 0.0
    away = time_s - np.mean(time_s)
    power = float(away @ away)
    return float(away @ stroke_mm) / power, sigma_mm / float(np.sqrt(power))


def _stopped(record: Record, at: int, sides: _Sides, same_mm: float) -> bool:
    """Say whether the stroke stood still between two samples of the same stroke, though it moves beside both.

    It did where it goes on as it came, but later; where it would have been led further than it ever went; and
    where it stands at the end of the stroke, which other turns of the record show.
    """
    stroke = record.stroke_mm
    length_s = float(record.time_s[at] - record.time_s[at - 1])
    slower = min(abs(sides.into), abs(sides.out_of))
    if sides.into * sides.out_of > 0.0:
        return abs(float(stroke[at] - stroke[at - 1])) < 0.5 * slower * length_s
    if 0.25 * length_s * slower > _BEYOND_RANGE * float(np.ptp(stroke)):
        return True
    apart = np.concatenate((stroke[: max(0, at - _MOST_NEAR)], stroke[at + _MOST_NEAR :]))
    if not apart.size:
        return False
    end = float(np.min(apart)) if sides.into < 0.0 else float(np.max(apart))
    return abs(end - 0.5 * float(stroke[at] + stroke[at - 1])) <= same_mm


def _filled(
    record: Record, breaks: IndexArray, rest: NDArray[np.bool_], still: NDArray[np.bool_]
) -> tuple[Record, IndexArray]:
    """Return the record with samples in its rests, and where its breaks are in it.

    They lie between the levels of the sides on which the stroke is ``still``, (B, 2): means, so that the
    noise of one sample is not the level of a rest. Of a side that moves, nothing reaches into the rest.
    """
    length_s = record.time_s[breaks] - record.time_s[breaks - 1]
    usual_s = median(np.diff(record.time_s))
    wanted = np.clip(np.round(length_s / usual_s).astype(np.intp) - 1, 0, _REST_SAMPLES)
    more = np.where(rest, wanted, 0)
    places = breaks + np.cumsum(more)
    if not np.any(more):
        return record, places
    at = np.repeat(breaks, more)
    share = np.concatenate([np.arange(1, own + 1) / (own + 1) for own in more.tolist()])
    near = [
        (_beside(record.time_s, int(row)), bool(sides[0]), bool(sides[1]))
        for row, sides in zip(breaks.tolist(), still.tolist(), strict=True)
    ]

    def column(values: FloatArray) -> FloatArray:
        ends = []
        for (left, right), still_left, still_right in near:
            before = float(np.mean(values[left]) if still_left else values[left.stop - 1])
            after = float(np.mean(values[right]) if still_right else values[right.start])
            if still_left != still_right:
                before = after = before if still_left else after
            ends.append((before, after))
        low, high = np.repeat(np.array(ends), more, axis=0).T
        return np.insert(values, at, low + share * (high - low))

    moments = np.repeat(record.time_s[breaks - 1], more) + share * np.repeat(length_s, more)
    speed, difference = record.speed_mm_per_s, record.wire_difference_mm
    return (
        replace(
            record,
            time_s=np.insert(record.time_s, at, moments),
            stroke_mm=column(record.stroke_mm),
            force_kN=column(record.force_kN),
            speed_mm_per_s=None if speed is None else column(speed),
            wire_difference_mm=None if difference is None else column(difference),
            filled_s=tuple(sorted((*record.filled_s, *_spans(record.time_s, breaks[more > 0] - 1)))),
        ),
        places,
    )


def _shortest_stroke_s(record: Record, sampling: Sampling) -> float:
    """Return the shortest time from one reversal to the next but one [s]; no end where there are too few."""
    moments = record.time_s[find_reversals(record.stroke_mm, sampling)]
    inner = moments[1:-1] if moments.size >= 5 else moments
    return float(np.min(inner[2:] - inner[:-2], initial=np.inf))


def _texts(record: Record, breaks: IndexArray) -> list[str]:
    """Return what each break is, by the defects that lie in it."""
    defects: tuple[Defect, ...] = tuple(d for d in record.defects if d.kind != "doubled")
    starts = np.array([defect.start_s for defect in defects])
    ends = np.maximum.accumulate([defect.end_s for defect in defects]) if defects else starts
    texts = []
    for at in breaks.tolist():
        begin_s, end_s = float(record.time_s[at - 1]), float(record.time_s[at])
        own = defects[int(np.searchsorted(ends, begin_s, side="right")) : int(np.searchsorted(starts, end_s))]
        text = own[0].text if own else f"gap of {end_s - begin_s:.4g} s after {begin_s:.6g} s"
        texts.append(text + (f" and {len(own) - 1} more" if len(own) > 1 else ""))
    return texts
