"""Invalid temperature readings: codes of sensors and loggers, and values that no specimen can have.

A sensor that fails goes on sending numbers: 85.0 °C after a reset, -127 °C when its wire is off, 999.9 or
9.91E+37 when its logger sees an open input. Taken for temperatures they break conditions that were kept. What
is no reading is left out and named; whether the others still cover a cycle is another question
(:mod:`bufferstand.evaluation.quantities.temperature`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray

Mask = NDArray[np.bool_]

POSSIBLE_C = (-80.0, 300.0)
"""Below and above, neither a room nor a rubber, elastomer or steel spring is tested: codes lie there."""
CODES: tuple[tuple[float, str], ...] = (
    (85.0, "the power-on value of a DS18B20: it was reset and has not converted"),
    (127.9375, "a DS18B20 with too little power for a conversion"),
    (0.0, "what a dead line reads"),
)
"""Codes that may be temperatures, too [°C]: taken for one only where the readings about them say so."""
_NAMED: tuple[tuple[float, str], ...] = (
    (-127.0, "the code of a DS18B20 that does not answer: disconnected"),
    (850.0, "the end of a Pt100's range: open or broken"),
)
_BEYOND = "no temperature that a specimen can have: the code of an open or over-ranged input"
_JUMP = "away from the readings before and after, which agree: a disturbed reading"
_ROUNDED_C = 0.005
_STEP_K = 5.0
"""A code is one if it is farther than this from the readings about it …"""
_RATE_K_PER_S = 0.05
"""… and, where there are such on one side only, the temperature would have moved faster than this."""
_FAST_K_PER_S = 0.5
"""Between a lower and a higher reading, it would have moved faster than this."""
_JUMP_K, _AGREE_K = 10.0, 3.0
_MOST_DISTURBED, _WITHIN_S = 3, 120.0


@dataclass(frozen=True)
class InvalidReadings:
    """Readings of a sensor that are none, all for one reason.

    Attributes
    ----------
    shown_C : float
        What the first of them shows.
    what : str
        What that is.
    times_s : tuple of float
        When; shape (n,).
    """

    shown_C: float
    what: str
    times_s: tuple[float, ...]


def true_readings(time_s: FloatArray, shown_C: FloatArray) -> tuple[Mask, tuple[InvalidReadings, ...]]:
    """Say which readings of a temperature sensor are true, and what the others are.

    Parameters
    ----------
    time_s, shown_C : arrays, shape (N,)
        NaN is no reading, and no fault.

    Returns
    -------
    (array of bool, tuple of SensorFault)
        Shape (N,): NaN counts as true here.
    """
    true = np.ones(shown_C.size, dtype=bool)
    reasons: dict[tuple[float, str], list[int]] = {}
    with np.errstate(invalid="ignore"):
        beyond = np.flatnonzero((shown_C < POSSIBLE_C[0]) | (shown_C > POSSIBLE_C[1]))
    for row in beyond.tolist():
        shown = float(shown_C[row])
        named = [what for code, what in _NAMED if abs(shown - code) <= _ROUNDED_C]
        reasons.setdefault((shown, named[0] if named else _BEYOND), []).append(row)
    true[beyond] = False
    for code, what in CODES:
        rows = _code_rows(time_s, shown_C, true, code)
        if rows.size:
            reasons[code, what] = rows.tolist()
            true[rows] = False
    disturbed = _disturbed_rows(time_s, shown_C, true)
    if disturbed.size:
        reasons[float(shown_C[disturbed[0]]), _JUMP] = disturbed.tolist()
        true[disturbed] = False
    faults = [
        InvalidReadings(shown, what, tuple(time_s[rows].tolist())) for (shown, what), rows in reasons.items()
    ]
    return true, tuple(sorted(faults, key=lambda fault: fault.times_s[0]))


def said(name: str, faults: Sequence[InvalidReadings], readings: int) -> list[str]:
    """Return warnings: one for each reason, with the place of the first reading and how many there are.

    Parameters
    ----------
    name : str
        Of the sensor.
    faults : sequence of SensorFault
    readings : int
        That the sensor has in all.
    """
    return [
        f"{name}: sensor fault: {_shown(fault.shown_C)}, {fault.what}; "
        + (
            f"at {fault.times_s[0]:.6g} s"
            if len(fault.times_s) == 1
            else f"{len(fault.times_s)} of {readings} readings, the first at {fault.times_s[0]:.6g} s, "
            f"the last at {fault.times_s[-1]:.6g} s"
        )
        + "; left out of all figures"
        for fault in faults
    ]


def _shown(value_C: float) -> str:
    return f"{value_C:.6g} °C"


def _code_rows(time_s: FloatArray, shown_C: FloatArray, true: Mask, code_C: float) -> NDArray[np.intp]:
    """Return the readings that are a code and no temperature: the others about them are far from it."""
    is_code = true & (np.abs(shown_C - code_C) <= _ROUNDED_C)
    if not is_code.any():
        return np.zeros(0, dtype=np.intp)
    others = np.flatnonzero(true & ~is_code & np.isfinite(shown_C))
    rows = np.flatnonzero(is_code)
    if not others.size:  # nothing but the code: a room is at 0 °C, a specimen is not at 85.00 °C throughout
        return rows if code_C != 0.0 and rows.size > 1 else rows[:0]
    after = np.searchsorted(others, rows)
    beside = np.stack((others[np.maximum(after - 1, 0)], others[np.minimum(after, others.size - 1)]))
    there = np.stack((after > 0, after < others.size))
    # Neighbours of the same code stand for one event: what counts is how far the other readings are from it.
    off_K = shown_C[beside] - code_C
    first_s, last_s = _ends_of_runs(time_s, rows, after)
    apart_s = np.abs(time_s[beside] - np.stack((first_s, last_s)))
    rate = np.abs(off_K) / np.maximum(apart_s, 1e-9)
    far = np.abs(off_K) > _STEP_K
    outward = there.all(axis=0) & far.all(axis=0) & (off_K[0] * off_K[1] > 0.0)
    through = there.all(axis=0) & far.all(axis=0) & (rate > _FAST_K_PER_S).all(axis=0)
    at_end = ~there.all(axis=0) & (there & far & (rate > _RATE_K_PER_S)).any(axis=0)
    return np.asarray(rows[outward | through | at_end])


def _ends_of_runs(
    time_s: FloatArray, rows: NDArray[np.intp], after: NDArray[np.intp]
) -> tuple[FloatArray, FloatArray]:
    """Return when the run of neighbouring codes that each row belongs to begins and ends [s]."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(after)) + 1))
    ends = np.append(starts[1:], rows.size) - 1
    run = np.searchsorted(starts, np.arange(rows.size), side="right") - 1
    return time_s[rows[starts[run]]], time_s[rows[ends[run]]]


def _disturbed_rows(time_s: FloatArray, shown_C: FloatArray, true: Mask) -> NDArray[np.intp]:
    """Return up to three readings in a row that leave those before and after, which agree, by over 10 K."""
    good = np.flatnonzero(true & np.isfinite(shown_C) & np.isfinite(time_s))
    value, at_s = shown_C[good], time_s[good]
    before = np.flatnonzero(np.abs(np.diff(value)) > _JUMP_K)
    if not before.size:
        return before
    disturbed = np.zeros(value.size, dtype=bool)
    for many in range(1, _MOST_DISTURBED + 1):
        first = before[before + many + 1 < value.size]
        last = first + many + 1
        found = np.abs(value[last] - value[first]) <= _AGREE_K
        found &= at_s[last] - at_s[first] <= _WITHIN_S
        for at in range(1, many + 1):
            found &= np.abs(value[first + at] - value[first]) > _JUMP_K
            found &= ~disturbed[first + at]
        found &= ~disturbed[first] & ~disturbed[last]
        for at in range(1, many + 1):
            disturbed[first[found] + at] = True
    return good[disturbed]
