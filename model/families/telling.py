"""Loops that fitted families foretell: do they create energy, and where do two of them differ most?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.families.comparing import FittedFamily
from bufferstand.model.families.data import FamilyData, nodes_of
from bufferstand.model.identification import Drive, Experiment, FixedParts
from bufferstand.model.spring import TemperatureLaw

Floats = NDArray[np.float64]

_POINTS = 60
"""Nodes of half a stroke."""
_CYCLES = 4
_SHARES = (0.15, 0.35, 0.55, 0.75, 0.9)
"""Where the loops lie, of the largest stroke."""
_AMPLITUDE_SHARES = (0.01, 0.03, 0.1, 0.25)
FREQUENCIES_Hz = (0.02, 0.08, 0.32, 1.27, 2.5)
_CREATED = 1e-4
"""A loop creates energy if it gives back more than this share of its force times its range."""
DAMPING_SIGMA = 0.002
STIFFNESS_SHARE = 0.005
"""What a stand tells of a loop: damping, and relative force over its range (docs/facts/spring-model.md)."""


@dataclass(frozen=True)
class TellingRun:
    """A loop at which two families differ.

    Attributes
    ----------
    prestress_mm, amplitude_mm, frequency_Hz : float
    damping, force_kN : tuple of float
        Damping and upper force less lower force, by the one and the other.
    """

    prestress_mm: float
    amplitude_mm: float
    frequency_Hz: float
    damping: tuple[float, float]
    force_kN: tuple[float, float]

    @property
    def sigmas(self) -> float:
        """By how many standard deviations of a stand they differ."""
        return _apart(*zip(self.damping, self.force_kN, strict=True))


def _apart(one: tuple[float, float], other: tuple[float, float]) -> float:
    damping = (one[0] - other[0]) / DAMPING_SIGMA
    force = (one[1] - other[1]) / (STIFFNESS_SHARE * max(abs(one[1]), abs(other[1]), 1e-6))
    return float(np.hypot(damping, force))


def telling_run(
    one: FittedFamily, other: FittedFamily, frame: FixedParts, law: TemperatureLaw, speed_mm_per_s: float
) -> TellingRun:
    """Return the loop at which two families differ most, of those that a stand can drive.

    Settled loops within the curves at the reference temperature, of 0.02 to 2.5 Hz, no faster than
    ``speed_mm_per_s``.
    """
    best: TellingRun | None = None
    end = frame.knots_mm[-1]
    for prestress in _SHARES:
        for share in _AMPLITUDE_SHARES:
            amplitude = share * end
            if not amplitude < prestress * end <= end - amplitude:
                continue
            for frequency in FREQUENCIES_Hz:
                if 2.0 * np.pi * frequency * amplitude > speed_mm_per_s:
                    continue
                data = sine_data(prestress * end, amplitude, frequency, law, end)
                (d0, f0), (d1, f1) = (_loop(fitted, frame, data) for fitted in (one, other))
                run = TellingRun(prestress * end, amplitude, frequency, (d0, d1), (f0, f1))
                if best is None or run.sigmas > best.sigmas:
                    best = run
    assert best is not None, "the slowest small loop is always within reach"
    return best


def creates_energy(fitted: FittedFamily, frame: FixedParts, law: TemperatureLaw) -> str | None:
    """Return the loop by which a fitted family creates energy, in words, or None.

    Sines and saw-teeth (slow up, fast down, and the reverse) about five strokes, three sizes, two rates.
    """
    end = frame.knots_mm[-1]
    for centre in _SHARES:
        for amplitude in (0.5, 2.0, 0.08 * end):
            if not amplitude < centre * end <= end - amplitude:
                continue
            for frequency in (0.1, 1.5):
                for name, shape in _SHAPES.items():
                    data = _data(shape, centre * end, amplitude, frequency, law, end)
                    damping, force = _loop(fitted, frame, data)
                    if damping < -_CREATED and force > 0.0:
                        return (
                            f"{name} of ± {amplitude:.3g} mm about {centre * end:.3g} mm at {frequency:g} Hz"
                        )
    return None


def _saw(phase: Floats, rise: float) -> Floats:
    """Return -1 … 1 … -1 over a cycle, linear, rising during the share ``rise`` of it."""
    return np.interp(phase % 1.0, [0.0, rise, 1.0], [-1.0, 1.0, -1.0])


_SHAPES: dict[str, Callable[[Floats], Floats]] = {
    "a sine": lambda phase: -np.cos(2.0 * np.pi * phase),
    "a slow rise and fast fall": lambda phase: _saw(phase, 0.9),
    "a fast rise and slow fall": lambda phase: _saw(phase, 0.1),
}


def sine_data(
    prestress_mm: float, amplitude_mm: float, frequency_Hz: float, law: TemperatureLaw, end_mm: float
) -> FamilyData:
    """Return the nodes of four cycles of a sine from contact, at the reference temperature."""
    return _data(_SHAPES["a sine"], prestress_mm, amplitude_mm, frequency_Hz, law, end_mm)


def _data(
    shape: Callable[[Floats], Floats],
    prestress_mm: float,
    amplitude_mm: float,
    frequency_Hz: float,
    law: TemperatureLaw,
    end_mm: float,
) -> FamilyData:
    half = np.concatenate([np.arange(_POINTS) / (2.0 * _POINTS), 0.5 + np.arange(_POINTS) / (2.0 * _POINTS)])
    phase = np.concatenate([half + cycle for cycle in range(_CYCLES)] + [np.array([float(_CYCLES)])])
    swing = prestress_mm + amplitude_mm * shape(phase)
    turn = int(np.argmax(swing[: 2 * _POINTS]))
    lead_s = max(10.0, 3.0 / frequency_Hz)
    lead = np.linspace(0.0, 1.0, _POINTS, endpoint=False)
    stroke = np.concatenate([lead * swing[0], swing])
    time = np.concatenate([lead * lead_s, lead_s + phase / frequency_Hz])
    halves = np.zeros(stroke.size, dtype=np.intp)
    for cycle in range(_CYCLES):
        first = _POINTS + cycle * 2 * _POINTS
        halves[first + turn :] = 2 * cycle + 1
        if cycle + 1 < _CYCLES:
            halves[first + 2 * _POINTS :] = 2 * cycle + 2
    nothing = np.zeros(stroke.size)
    nodes = np.arange(stroke.size)
    drive = Drive(time, stroke, halves, nodes, nothing, np.ones(stroke.size), nothing,
                  np.empty(0), np.empty(0), law.reference_C)  # fmt: skip
    experiment = Experiment(drive, True, np.ones(stroke.size, dtype=np.bool_))
    return nodes_of(experiment, np.full(stroke.size, law.reference_C), law, end_mm)


def _loop(fitted: FittedFamily, frame: FixedParts, data: FamilyData) -> tuple[float, float]:
    """Return damping, and upper less lower force, of the last cycle."""
    last = slice(-2 * _POINTS - 1, None)
    force = fitted.family.force_kN(frame, fitted.vector, data)[last]
    x = data.x_mm[last]
    work = 0.5 * (force[1:] + force[:-1]) * np.diff(x)
    stored = float(np.sum(work[work > 0.0]))
    damping = float(np.sum(work)) / stored if stored > 0.0 else 0.0
    return damping, float(force.max() - force.min())
