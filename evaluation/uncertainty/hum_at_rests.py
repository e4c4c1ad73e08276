"""Hum that shows in the rests of a static test, where no loop hides it.

Slow strokes have corners whose harmonics lie above a hum that is folded to a few hertz. Between the strokes
nothing moves: what stands out there of the noise beside it on both sides is a wave of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.evaluation.cycles import EASED_S
from bufferstand.evaluation.facts import Cycle
from bufferstand.evaluation.numerics import FloatArray, HumLine, without_lines
from bufferstand.foundation.numbers import median

_LEAST_REST, _MOST_REST = 64, 4096
"""Samples of a rest that is looked at; a longer one is cut."""
_OF_LONGEST = 0.4
"""Rests shorter than this share of the longest show a wave too wide."""
_EVEN = 1.02
"""A rest lacks no samples that takes no longer than so much of their usual step."""
_FINER = 4
"""The spectrum has so many values where the rest shows one."""
_LOWEST = 6.0
"""Waves in a rest below which what relaxes in it looks like one."""
_ABOVE = 40.0
"""Power of hum over the median of that beside it …"""
_NEAR, _FAR = 3, 12
"""… from so many waves in a rest more or less, to so many."""
_MOST_LINES = 3
_SHORT, _PERIODS = 128, 8
"""Samples, and periods of the hum, of a stretch in which its phase is looked for by itself: no rest shows a
frequency so well that its phase is known in the next one."""
_SEEN, _ORDER = 0.05, 5
"""Differences of this order leave so much of a wave that its phase can be told from them."""
_SLOWER, _FASTER = 2.5, 4.0
"""Differences of means that see frequencies from so many times slower to so many times faster see a wave."""


def lines_at_rests(
    time_s: FloatArray, values: FloatArray, cycles: Sequence[Cycle], step_s: float
) -> tuple[HumLine, ...]:
    """Return the hum on a channel as the rests between cycles show it, strongest first.

    Parameters
    ----------
    time_s, values : arrays, shape (N,)
        The channel as it was read.
    cycles : sequence of Cycle
        Complete ones, with the dwells at their ends.
    step_s : float
        Usual distance of the samples [s].
    """
    rests = [_flat(values[rows]) for rows in _rests(time_s, cycles, step_s)]
    if not rests:
        return ()
    shortest = min(rest.size for rest in rests)
    size = _FINER * (1 << int(max(rest.size for rest in rests) - 1).bit_length())
    power = np.mean([_power(rest, size) for rest in rests], axis=0)
    frequency_Hz = np.fft.rfftfreq(size, step_s)
    wave = max(1, round(size / shortest))
    found: list[int] = []
    order = np.argsort(power)[::-1]
    lowest, highest = int(_LOWEST * wave), power.size - _FAR * wave
    for at in order[: 16 * _MOST_LINES * wave].tolist():
        if not lowest <= at < highest or any(abs(at - other) < _NEAR * wave for other in found):
            continue
        if _stands_out(power, at, wave):
            found.append(at)
        if len(found) == _MOST_LINES:
            break
    return tuple(_line(rests, step_s, float(frequency_Hz[at])) for at in found)


def without_resting_lines(rows: FloatArray, step_s: float, lines: Sequence[HumLine]) -> FloatArray:
    """Return samples less hum that rests show, where differences show its phase; else as they are.

    Parameters
    ----------
    rows : array, shape (R, L)
        Even samples of stretches of the record.
    step_s : float
        Distance of the samples [s].
    lines : sequence of HumLine
    """
    if not lines or not _phase_is_seen(lines, step_s):
        return rows
    slowest_Hz = min(line.frequency_Hz for line in lines)
    stretch = min(rows.shape[1], max(_SHORT, round(_PERIODS / (slowest_Hz * step_s))))
    rows = rows[:, : rows.shape[1] // stretch * stretch]
    return without_lines(rows.reshape(-1, stretch), step_s, lines).reshape(rows.shape)


def beside_lines(
    points: list[tuple[float, float]], step_s: float, lines: Sequence[HumLine]
) -> list[tuple[float, float]]:
    """Return the densities that hum which could not be taken out has no part in, or the fastest one.

    Parameters
    ----------
    points : list of (float, float)
        Frequencies, rising, and densities.
    step_s : float
        Distance of the samples [s].
    lines : sequence of HumLine
    """
    if not lines or _phase_is_seen(lines, step_s):
        return points
    clear = [
        point
        for point in points
        if all(not 1.0 / _SLOWER < point[0] / line.frequency_Hz < _FASTER for line in lines)
    ]
    return clear or points[-1:]


def _phase_is_seen(lines: Sequence[HumLine], step_s: float) -> bool:
    return all(abs(2.0 * np.sin(np.pi * line.frequency_Hz * step_s)) ** _ORDER >= _SEEN for line in lines)


def _rests(time_s: FloatArray, cycles: Sequence[Cycle], step_s: float) -> list[slice]:
    """Return the rows of rests that are long enough, without what a stand eases at either end."""
    turns = sorted(
        {(turn.time_s, turn.leave_s) for c in cycles for turn in (c.start, c.end) if turn.dwell_s > EASED_S}
    )
    ends_s = np.array(turns).reshape(-1, 2) + np.array((EASED_S, -EASED_S))
    rows = [
        slice(first, min(last, first + _MOST_REST))
        for first, last in np.searchsorted(time_s, ends_s).tolist()
        if last - first >= _LEAST_REST
    ]
    even = [
        p for p in rows if time_s[p.stop - 1] - time_s[p.start] <= _EVEN * (p.stop - p.start - 1) * step_s
    ]
    longest = max((p.stop - p.start for p in even), default=0)
    return [p for p in even if p.stop - p.start >= _OF_LONGEST * longest]


def _flat(values: FloatArray) -> FloatArray:
    """Return a rest without the parabola that relaxes and drifts in it."""
    phase = np.linspace(-1.0, 1.0, values.size)
    matrix = np.stack((np.ones(values.size), phase, phase**2), axis=1)
    found, *_ = np.linalg.lstsq(matrix, values, rcond=None)
    return np.asarray(values - matrix @ found)


def _power(rest: FloatArray, size: int) -> FloatArray:
    window = 1.0 - np.cos(2.0 * np.pi * np.arange(rest.size) / rest.size)
    return np.asarray(np.abs(np.fft.rfft(rest * window, size)) ** 2 / np.sum(window**2))


def _stands_out(power: FloatArray, at: int, wave: int) -> bool:
    """Say whether a value is a peak over what lies beside it on either side: slow noise rises to one only."""
    if power[at] < np.max(power[max(0, at - wave) : at + wave + 1]):
        return False
    sides = power[max(0, at - _FAR * wave) : at - _NEAR * wave], power[at + _NEAR * wave :][: _FAR * wave]
    return all(side.size and power[at] > _ABOVE * median(side) for side in sides)


def _line(rests: Sequence[FloatArray], step_s: float, frequency_Hz: float) -> HumLine:
    """Return a wave with its amplitude: the root mean square over the rests."""
    squares = []
    for rest in rests:
        angle = 2.0 * np.pi * frequency_Hz * step_s * np.arange(rest.size)
        waves = np.stack((np.cos(angle), np.sin(angle)), axis=1)
        found, *_ = np.linalg.lstsq(waves, rest, rcond=None)
        squares.append(float(np.sum(found**2)))
    return HumLine(frequency_Hz, float(np.sqrt(np.mean(squares))))
