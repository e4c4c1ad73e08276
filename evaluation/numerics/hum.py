"""Hum: waves of one frequency on a channel, which have nothing to do with its motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.numerics.arrays import FloatArray
from bufferstand.foundation.numbers import median

_MOST_LINES = 3
_FASTER = 12
"""So many harmonics of a cycle are its own; hum is looked for above them."""
_ABOVE = 40.0
"""Power over the median beside it from which a peak is hum: of noise, one of 10^16 values is so large."""
_BESIDE = 40
_ABOVE_NEIGHBOURS = 10.0
"""… and over that of the next harmonics of the cycle: corners of a loop make lines at all of them, those of a
stroke that is flat at both its turns alike at every other one, and between those some nearly vanish."""
_NEXT_HARMONICS = (1, 2, 3, 4)
_LEAST_SAMPLES = 512
_ORDER = 5
_MAIN_LOBE = 2


class HumLine(NamedTuple):
    """A wave on a channel: frequency as the samples show it (folded, if it is faster) and amplitude."""

    frequency_Hz: float
    amplitude: float


def lines_of(
    rows: FloatArray, step_s: float, shortest_cycle_s: float, usual_cycle_s: float
) -> tuple[HumLine, ...]:
    """Return the hum on a channel, strongest first.

    Parameters
    ----------
    rows : array, shape (R, L)
        Even samples of stretches of the record.
    step_s : float
        Distance of the samples [s].
    shortest_cycle_s, usual_cycle_s : float
        Length of the shortest cycle, above whose harmonics hum is looked for, and of most of them [s]: a
        first or last cycle that is a little shorter says nothing of where the harmonics lie.
    """
    if rows.shape[1] < _LEAST_SAMPLES:
        return ()
    power, frequency_Hz = _power(rows, step_s)
    first = int(np.searchsorted(frequency_Hz, _FASTER / shortest_cycle_s))
    apart = 1.0 / usual_cycle_s / float(frequency_Hz[1])
    away = tuple(max(2 * _MAIN_LOBE + 1, round(number * apart)) for number in _NEXT_HARMONICS)
    found: list[int] = []
    above = power / np.maximum(_level(power), 1e-300)
    order = np.argsort(above[first:-2])[::-1][: 4 * _MOST_LINES * (2 * _MAIN_LOBE + 1)] + first
    for at in order.tolist():
        if any(abs(at - other) <= 2 * _MAIN_LOBE for other in found):
            continue
        if above[at] >= _ABOVE and _stands_out(power, at, away):
            found.append(at)
        if len(found) == _MOST_LINES:
            break
    return tuple(_line(rows, step_s, _refined(power, at) * float(frequency_Hz[1])) for at in found)


def without_lines(rows: FloatArray, step_s: float, lines: Sequence[HumLine]) -> FloatArray:
    """Return samples less the waves of these frequencies, each stretch by itself."""
    waves = _waves(rows.shape[1], step_s, lines)
    high = _differences(rows)
    found, *_ = np.linalg.lstsq(_differences(waves).T, high.T, rcond=None)
    return rows - (waves.T @ found).T


def _waves(size: int, step_s: float, lines: Sequence[HumLine]) -> FloatArray:
    angle = 2.0 * np.pi * step_s * np.outer([line.frequency_Hz for line in lines], np.arange(size))
    return np.concatenate((np.cos(angle), np.sin(angle)))


def _differences(rows: FloatArray) -> FloatArray:
    """Return fifth differences: what is smooth is gone, and a step is over after six samples."""
    return np.diff(rows, _ORDER, axis=1)


def _power(rows: FloatArray, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Return the mean power of the stretches' fifth differences, undone, and its frequencies."""
    high = _differences(rows)
    size = high.shape[1]
    window = 1.0 - np.cos(2.0 * np.pi * np.arange(size) / size)
    frequency_Hz = np.fft.rfftfreq(size, step_s)
    gain = (2.0 * np.sin(np.pi * frequency_Hz * step_s)) ** (2 * _ORDER)
    power = np.mean(np.abs(np.fft.rfft(high * window)) ** 2, axis=0)
    power[1:] /= gain[1:]
    power[0] = np.max(power)  # a difference does not know it; no hum is there
    return np.asarray(power), np.asarray(frequency_Hz)


def _level(power: FloatArray) -> FloatArray:
    """Return the power that noise has about each frequency: medians of blocks, and between them."""
    size = 2 * _BESIDE
    whole = max(1, power.size // size)
    blocks = np.array_split(power, whole)
    middles = np.cumsum([block.size for block in blocks]) - 0.5 * np.array([block.size for block in blocks])
    return np.interp(np.arange(power.size), middles, [median(block) for block in blocks])


def _stands_out(power: FloatArray, at: int, away: Sequence[int]) -> bool:
    """Say whether a peak is none of a row of peaks that are a few harmonics of the cycle apart."""
    for beside in (at + sign * far for sign in (-1, 1) for far in away):
        part = power[max(0, beside - _MAIN_LOBE) : beside + _MAIN_LOBE + 1]
        if part.size and power[at] < _ABOVE_NEIGHBOURS * np.max(part):
            return False
    return True


def _refined(power: FloatArray, at: int) -> float:
    """Return the place of a peak of a windowed line between three values of it."""
    low, middle, high = np.log(power[at - 1 : at + 2])
    bend = low - 2.0 * middle + high
    return at + (0.5 * float(low - high) / float(bend) if bend < 0.0 else 0.0)


def _line(rows: FloatArray, step_s: float, frequency_Hz: float) -> HumLine:
    waves = _waves(rows.shape[1], step_s, [HumLine(frequency_Hz, 1.0)])
    found, *_ = np.linalg.lstsq(_differences(waves).T, _differences(rows).T, rcond=None)
    return HumLine(frequency_Hz, float(np.sqrt(np.mean(np.sum(found**2, axis=0)))))
