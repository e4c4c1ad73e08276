"""The paper's tests (§ 3) and simulations (§ 4) run with a model: histories for its Figs 4 to 12."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.prediction import predict_static
from bufferstand.model.simulation import Simulation, simulate
from bufferstand.model.spring import HeatBalance, HeatRule, SpringModel

Floats = NDArray[np.float64]

STATIC_SPEED_MM_PER_S = 5.0
PEAK_SPEED_MM_PER_S = 80.0
FORCE_LIMIT_kN = 600.0
SEQUENCE_mm = (
    (20.0, (5.0, 10.0, 15.0, 20.0)),
    (48.5, (5.0, 10.0, 15.0, 30.0)),
    (78.0, (5.0, 10.0, 15.0)),
)
"""Prestress and amplitudes of Figs 5 and 7, with the strokes as they were, not as they were asked for."""
PAPER_HEAT = (2000.0, 10.0)
"""C [J/K] and lambda [W/K] of the paper's § 4.2, which it calls no result of a measurement."""
_STEP_S = 1e-3
_STATIC_STEP_S = 5e-3
_MOVE_S = 2.0
_PAUSE_S = 5.0


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """A run or part of one; arrays of shape (n,).

    Parameters
    ----------
    name : str
        What it is.
    time_s, stroke_mm, force_kN, temperature_C, heat_J : NDArray
        Its history.
    prestress_mm, amplitude_mm, frequency_Hz : float
        Mean stroke, half the range, frequency; 0 for a static run.
    """

    name: str
    time_s: Floats
    stroke_mm: Floats
    force_kN: Floats
    temperature_C: Floats
    heat_J: Floats
    prestress_mm: float = 0.0
    amplitude_mm: float = 0.0
    frequency_Hz: float = 0.0

    def part(self, first: int, last: int) -> SimulatedRun:
        """Return the samples from ``first`` up to ``last``, not included."""
        columns = (self.time_s, self.stroke_mm, self.force_kN, self.temperature_C, self.heat_J)
        time_s, stroke_mm, force_kN, temperature_C, heat_J = (column[first:last] for column in columns)
        return replace(
            self,
            time_s=time_s,
            stroke_mm=stroke_mm,
            force_kN=force_kN,
            temperature_C=temperature_C,
            heat_J=heat_J,
        )

    @property
    def points_per_cycle(self) -> int:
        """Samples of one cycle, at the rate with which the run ends."""
        return round(1.0 / (self.frequency_Hz * float(self.time_s[-1] - self.time_s[-2])))


def frequency_of(amplitude_mm: float, peak_speed_mm_per_s: float = PEAK_SPEED_MM_PER_S) -> float:
    """Return the frequency [Hz] of a sine of this amplitude and peak speed."""
    return peak_speed_mm_per_s / (2.0 * np.pi * amplitude_mm)


def static_run(
    model: SpringModel,
    temperature_C: float,
    *,
    force_limit_kN: float = FORCE_LIMIT_kN,
    stroke_limit_mm: float = np.inf,
) -> SimulatedRun:
    """Return one slow stroke to the first limit and back, at one temperature."""
    reach = min(stroke_limit_mm, model.curves.end_mm)
    end = predict_static(model, force_limit_kN, reach, STATIC_SPEED_MM_PER_S, temperature_C).end_stroke_mm
    time, stroke = _slow(end)
    result = simulate(model, time, stroke, temperature_C=temperature_C, isothermal=True)
    return _run(f"quasi-static, {temperature_C:g} °C", time, stroke, result)


def harmonic_run(
    model: SpringModel,
    prestress_mm: float,
    amplitude_mm: float,
    frequency_Hz: float,
    temperature_C: float,
    *,
    settle_s: float = 60.0,
    cycles: int = 3,
) -> SimulatedRun:
    """Return the last cycles of a sine at one temperature, after at least ``settle_s`` of it."""
    points = max(400, 2 * round(0.5 / (frequency_Hz * _STEP_S)))
    before = max(2, int(np.ceil(settle_s * frequency_Hz)))
    time = np.arange((before + cycles) * points + 1) / (points * frequency_Hz)
    stroke = prestress_mm - amplitude_mm * np.cos(2.0 * np.pi * frequency_Hz * time)
    result = simulate(model, time, stroke, temperature_C=temperature_C, isothermal=True)
    run = _run("", time, stroke, result)
    run = replace(run, prestress_mm=prestress_mm, amplitude_mm=amplitude_mm, frequency_Hz=frequency_Hz)
    return run.part(before * points, len(time))


def sequence(
    model: SpringModel, temperature_C: float, cycles: int = 10
) -> tuple[SimulatedRun, tuple[SimulatedRun, ...]]:
    """Return the sequence of Fig. 4 as a whole, and its runs: a slow stroke, then loops at three prestresses.

    The spring warms up by what it loses, and cools towards the temperature with which it began.
    """
    end = predict_static(
        model, FORCE_LIMIT_kN, model.curves.end_mm, STATIC_SPEED_MM_PER_S, temperature_C
    ).end_stroke_mm
    time, stroke = _slow(end)
    parts, marks = [(time, stroke)], [(0, len(time), 0.0, 0.0)]
    place, count = 0.0, len(time)
    for prestress, amplitudes in SEQUENCE_mm:
        for amplitude in amplitudes:
            move = _move(place, prestress - amplitude)
            loops = _loops(prestress, amplitude, cycles)
            parts += [move, loops]
            marks.append((count + len(move[0]), len(loops[0]), prestress, amplitude))
            count += len(move[0]) + len(loops[0])
            place = float(loops[1][-1])
    parts.append(_move(place, 0.0))
    time, stroke = _joined(parts)
    whole = _run(
        "sequence",
        time,
        stroke,
        simulate(model, time, stroke, temperature_C=temperature_C, ambient_C=temperature_C),
    )
    runs = []
    for first, length, prestress, amplitude in marks:
        frequency = frequency_of(amplitude) if amplitude else 0.0
        name = f"{prestress:g} ± {amplitude:g} mm" if amplitude else "quasi-static"
        part = whole.part(first, first + length)
        runs.append(
            replace(part, name=name, prestress_mm=prestress, amplitude_mm=amplitude, frequency_Hz=frequency)
        )
    return whole, tuple(runs)


def warming_run(model: SpringModel, rule: HeatRule, until_s: float = 45.0) -> tuple[SimulatedRun, int]:
    """Return the run of Figs 11 and 12, and the sample with which its loops begin.

    A slow stroke, then 78 ± 15 mm with 80 mm/s from 25 °C, with the paper's C and lambda.
    """
    hot = replace(model, heat=HeatBalance(*PAPER_HEAT, rule))
    cycles = int(until_s * frequency_of(15.0))
    parts = [_slow(95.0), _move(0.0, 63.0), _loops(78.0, 15.0, cycles)]
    time, stroke = _joined(parts)
    result = simulate(hot, time, stroke, temperature_C=25.0, ambient_C=25.0)
    run = replace(
        _run("warming up", time, stroke, result),
        prestress_mm=78.0,
        amplitude_mm=15.0,
        frequency_Hz=frequency_of(15.0),
    )
    return run, len(time) - len(parts[-1][0])


def _slow(end_mm: float) -> tuple[Floats, Floats]:
    half = end_mm / STATIC_SPEED_MM_PER_S
    steps = round(half / _STATIC_STEP_S)  # so many that one ends at the turn
    time = np.arange(2.0 * steps + round(_PAUSE_S / _STATIC_STEP_S)) * (half / steps)
    return time, np.maximum(0.0, end_mm - STATIC_SPEED_MM_PER_S * np.abs(time - half))


def _move(start_mm: float, end_mm: float) -> tuple[Floats, Floats]:
    time = np.arange(_STEP_S, _MOVE_S + 0.5 * _STEP_S, _STEP_S)
    return time, start_mm + (end_mm - start_mm) * 0.5 * (1.0 - np.cos(np.pi * time / _MOVE_S))


def _loops(prestress_mm: float, amplitude_mm: float, cycles: int) -> tuple[Floats, Floats]:
    """Return whole cycles from and to the lower turning point; a sample for about every millisecond."""
    frequency = frequency_of(amplitude_mm)
    points = 2 * round(0.5 / (frequency * _STEP_S))
    angle = np.arange(1.0, cycles * points + 1.0) * (2.0 * np.pi / points)
    return angle / (2.0 * np.pi * frequency), prestress_mm - amplitude_mm * np.cos(angle)


def _joined(parts: Sequence[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    starts = np.concatenate([[0.0], np.cumsum([part[0][-1] for part in parts])])
    time = np.concatenate([part[0] + start for part, start in zip(parts, starts[:-1], strict=True)])
    assert all(later > earlier for earlier, later in pairwise(starts))
    return time, np.concatenate([part[1] for part in parts])


def _run(name: str, time_s: Floats, stroke_mm: Floats, result: Simulation) -> SimulatedRun:
    return SimulatedRun(name, time_s, stroke_mm, result.force_kN, result.temperature_C, result.heat_J)
