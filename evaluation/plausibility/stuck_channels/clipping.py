"""Clipping: a channel pinned at its own extreme while the other one moves on.

Two ways to tell. Where the noise of a channel moves it by more than its resolution, no two neighbours are
alike for long: samples that stay at the extreme to the last digit are clipped. Where it does not (converter
steps, smooth records), the shape tells: both flanks lead beyond the flat top by more than converter steps
make of a turning point, and the other channel goes on and comes back meanwhile. It does not in a dwell, in
which force relaxes or stroke creeps, nor where friction limits a force, which falls as the stroke turns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.plausibility.run_view import RunView, Samples
from bufferstand.foundation.numbers import median

LEAST_ROWS = 8
"""So many samples at the extreme …"""
CHANCE = 1e-6
"""… or fewer, if noise makes so many alike less often than this …"""
LEAST_RUN = 4
"""… and of a record without noise so many in a row."""
MOVED_SHARE, MOVED_NOISE, MOVED_STEPS = 0.005, 8.0, 2.0
"""The other channel moves on by this share of its span, and by so many standard deviations of its noise and
steps of its converter."""
BEYOND_SHARE, BEYOND_NOISE, BEYOND_STEPS = 0.003, 6.0, 4.0
"""Both flanks lead beyond the flat top by this share of the span, so many standard deviations and steps (a
parabola that a converter cuts into steps: 1.5 of them)."""
_BACK = 3.0
"""It comes back by so many of its steps from sample to sample: more than a turn between two samples shows,
and than a force that comes some samples late makes of friction."""
_TOGETHER, _COARSE, _BACK_TOGETHER, _NOISE_TOGETHER = 3, 0.01, 0.1, 3.0
"""Where a step from sample to sample is more than this share of the span, no force comes as late as one
sample. There it comes back by so much less of a step, and so many standard deviations, if in all of three."""
NO_LOAD = 0.02
"""A force that stays at less than this share of its span is that of a specimen that is not touched."""
_NEXT = 2.5
_FEWER_NEXT = 3.0
"""Within so many resolutions below a true extreme there are not so many times fewer samples than at it."""


@dataclass(frozen=True)
class _Level:
    """The extreme of a channel, ``side`` +1 the greatest, -1 the least; shape (K, 2): first and last rows."""

    value: float
    side: int
    runs: NDArray[np.intp]


def clipped(look: RunView) -> list[Finding]:
    """Return where force or stroke is pinned at its own extreme.

    Parameters
    ----------
    look : Look

    Returns
    -------
    list of Finding
        One for each end of each channel; ``size`` is the value at which it is pinned.
    """
    found = []
    for channel in look.channels:
        if not np.any(channel.scan.same):
            continue
        other = look.other(channel)
        for value, runs in _pinned_ends(channel, other):
            found.append(_finding(look, channel, other, value, runs))
    return found


def pinned_rows(look: RunView, channel: Samples) -> frozenset[int]:
    """Return the first rows of all stretches in which a channel is clipped."""
    ends = _pinned_ends(channel, look.other(channel))
    return frozenset(int(first) for _, runs in ends for first in runs[:, 0])


def clipped_again(look: RunView, channel: Samples, value: float) -> Finding | None:
    """Return that a channel that is frozen at a value is clipped, if that is its extreme several times.

    What freezes anew does not stop at the same value.
    """
    other = look.other(channel)
    for side, end in zip((-1, 1), channel.ends, strict=True):
        if value != end:
            continue
        runs = _level(channel, value, side).runs
        runs = runs[runs[:, 1] - runs[:, 0] + 1 >= LEAST_RUN * channel.sampling.held]
        moved = [other.moved(*channel.time_s[run].tolist()) > _least_move(other) for run in runs]
        if len(moved) >= _TOGETHER and all(moved):
            return _finding(look, channel, other, value, runs)
    return None


def _pinned_ends(channel: Samples, other: Samples) -> list[tuple[float, NDArray[np.intp]]]:
    """Return each end of a channel at which it is pinned, and where, shape (K, 2)."""
    found = []
    for side, value in zip((-1, 1), channel.ends, strict=True):
        if channel.quantity == "force" and side < 0 and abs(value) < NO_LOAD * channel.span:
            continue
        runs = _pinned(channel, other, _level(channel, value, side))
        if runs.size:
            found.append((value, runs))
    return found


def _level(channel: Samples, value: float, side: int) -> _Level:
    rows = np.flatnonzero(channel.value == value)
    cuts = np.flatnonzero(np.diff(rows) > 1)
    first, last = rows[np.append(0, cuts + 1)], rows[np.append(cuts, rows.size - 1)]
    return _Level(value, side, np.stack((first, last), axis=1))


def _pinned(channel: Samples, other: Samples, level: _Level) -> NDArray[np.intp]:
    """Return those stretches at an extreme that are clipped."""
    lengths = level.runs[:, 1] - level.runs[:, 0] + 1
    if not np.any(lengths > 1):
        return level.runs[:0]
    if channel.is_noisy:
        runs = level.runs[lengths >= 2]
        count = int(np.sum(lengths[lengths >= 2]))
        few = not _beyond_chance(channel, count - runs.shape[0])
        if (few and count < LEAST_ROWS * channel.sampling.held) or 2 * count < int(np.sum(lengths)):
            return runs[:0]
        beside = np.abs(channel.value - level.value) <= _NEXT * channel.resolution
        if _FEWER_NEXT * (int(np.count_nonzero(beside)) - int(np.sum(lengths))) > count:
            return runs[:0]
        moving = [
            other.moved(float(channel.time_s[first]), float(channel.time_s[last])) > _least_move(other)
            for first, last in runs.tolist()
        ]
        return runs if any(moving) else runs[:0]
    if not np.any(lengths >= LEAST_RUN):
        return level.runs[:0]
    runs = level.runs[lengths >= LEAST_RUN * channel.sampling.held]
    cut = [_is_cut(channel, other, run, level.side, _BACK) for run in runs.tolist()]
    if not any(cut) and len(cut) >= _TOGETHER:
        cut = [_is_cut(channel, other, run, level.side, _BACK_TOGETHER) for run in runs.tolist()]
        cut = [all(cut)] * len(cut)
    return np.asarray(runs[np.array(cut, dtype=bool)])


def _beyond_chance(channel: Samples, pairs: int) -> bool:
    """Say whether noise does not make so many pairs of neighbours that are alike to the last digit.

    Two values with noise s that is written in steps of r are alike with the probability r / (2 √π s).
    """
    alike = channel.resolution / (2.0 * float(np.sqrt(np.pi)) * channel.noise)
    return bool(alike**pairs < CHANCE) and channel.sampling.held <= 1


def _least_move(other: Samples) -> float:
    return max(MOVED_SHARE * other.span, MOVED_NOISE * other.sigma, MOVED_STEPS * other.sampling.step)


def _is_cut(channel: Samples, other: Samples, run: list[int], side: int, back: float) -> bool:
    """Say by its shape whether a flat stretch is cut off; the other channel comes ``back`` so many steps."""
    first, last = run
    count = max(2, (last - first + 1) // 2)
    if first - count < 0 or last + count >= channel.value.size:
        return False
    time_s, value = channel.time_s, side * channel.value
    rises = float(value[first] - value[first - count]) / float(time_s[first] - time_s[first - count])
    falls = float(value[last] - value[last + count]) / float(time_s[last + count] - time_s[last])
    beyond = 0.25 * float(time_s[last] - time_s[first]) * min(rises, falls)
    own = channel.sampling
    steps = BEYOND_STEPS * max(own.step, channel.resolution)
    if beyond <= max(BEYOND_SHARE * channel.span, BEYOND_NOISE * channel.sigma, steps):
        return False
    moved = side * other.within(float(time_s[first]), float(time_s[last]))
    furthest = float(np.max(moved))
    own_step = abs(float(moved[-1] - moved[0])) / (last - first)
    own_step = max(own_step, median(np.abs(np.diff(moved))))
    if back < _BACK and own_step < _COARSE * other.span:
        return False
    noises = MOVED_NOISE if back == _BACK else _NOISE_TOGETHER
    comes_back = max(noises * other.sigma, MOVED_STEPS * other.sampling.step, back * own_step)
    entered, left = furthest - float(moved[0]), furthest - float(moved[-1])
    return entered > _least_move(other) and left > comes_back


def _finding(
    look: RunView, channel: Samples, other: Samples, value: float, runs: NDArray[np.intp]
) -> Finding:
    begins, ends = channel.time_s[runs[:, 0]], channel.time_s[runs[:, 1]]
    cycles = look.touched_by(begins, ends)
    longest = int(np.argmax(ends - begins))
    count = int(np.sum(runs[:, 1] - runs[:, 0] + 1))
    text = (
        f"{channel.name} clipped: {count} samples stay at {value:.6g} {channel.unit} to the last digit while "
        f"the {other.name} moves on (longest from {begins[longest]:.6g} to {ends[longest]:.6g} s); amplifier "
        "or converter ended there: choose a larger range and repeat the test"
    )
    start_s, end_s = float(begins[0]), float(ends[-1])
    return Finding(
        "clipped", channel.name, start_s, end_s, cycles, value, channel.unit, text, effect="spoils"
    )
