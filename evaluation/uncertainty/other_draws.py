"""Draws of the figures of a cycle: what the entries of the catalogue propagate."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bufferstand.evaluation.catalogue import OF_THERMOMETER, OF_TURNS, QUANTITIES, Quantity
from bufferstand.evaluation.facts import Cycle, Loop, Quantities
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.quantities import TANGENT_WINDOW
from bufferstand.evaluation.record import Temperature
from bufferstand.evaluation.uncertainty.error_model import Draws, stroke_term_slopes
from bufferstand.evaluation.uncertainty.monte_carlo import (
    CyclePropagation,
    slope_draws,
    turn_errors,
    turns_with,
    weighted,
)
from bufferstand.evaluation.uncertainty.speed_noise import speed_lean

_DISTORTING = range(2, 11)
"""Harmonics of the stroke that count as distortion."""
_SPEED_PARTS = 24
"""A branch is looked at in so many parts for where its speed may be largest …"""
_NEAR_LARGEST = 0.95
"""… which are those whose speed is at least this share of the largest."""
_MADE_BY_WIRES = 2.0
"""A fall of the speed by so many standard uncertainties of what the wires make of it may be none."""


@dataclass(frozen=True)
class Known:
    """What is known of a cycle besides its loop, for figures that are drawn about their value.

    Attributes
    ----------
    figures : Quantities
    temperatures : sequence of Temperature
    """

    figures: Quantities = field(default_factory=Quantities)
    temperatures: Sequence[Temperature] = ()


class DrawnTurns:
    """What a quantity is drawn from where a cycle has turning points and no loop: complete or not.

    Attributes
    ----------
    low_mm, high_mm, mean_mm, span_mm : arrays, shape (N,)
        Turning points of every draw, their mean and difference, as a quantity reads them of a cycle.
    """

    def __init__(
        self, draws: Draws, cycle: Cycle, known: Known, shares: tuple[float, float] = (1.0, 1.0)
    ) -> None:
        self.draws, self.cycle, self.known = draws, cycle, known
        self.errors_mm = turn_errors(draws, cycle, shares)

    @cached_property
    def _turns(self) -> tuple[FloatArray, FloatArray]:
        return turns_with(self.draws, self.cycle, self.errors_mm)

    @property
    def low_mm(self) -> FloatArray:
        """Lower turning point [mm]."""
        return self._turns[0]

    @property
    def high_mm(self) -> FloatArray:
        """Upper turning point [mm]."""
        return self._turns[1]

    @property
    def mean_mm(self) -> FloatArray:
        """Mean of both [mm]."""
        return 0.5 * (self.low_mm + self.high_mm)

    @property
    def span_mm(self) -> FloatArray:
        """Upper less lower one [mm]."""
        return self.high_mm - self.low_mm

    def temperature(self, name: str) -> FloatArray | None:
        """Return a temperature [°C]; None where a sensor on the specimen states no accuracy."""
        sensors = [one.accuracy_C for one in self.known.temperatures if one.role == "specimen"]
        limits = [limit for limit in sensors if limit is not None]
        value = getattr(self.known.figures, name)
        if value is None or not sensors or len(limits) < len(sensors):
            return None
        return np.asarray(value + max(limits) * self.draws.thermometer)


class DrawnLoop(DrawnTurns):
    """What a quantity of a complete cycle is drawn from.

    What several quantities rest on is drawn here, in this order, before any of them draws random numbers of
    its own: the figures of today stay what they are when another quantity comes.

    Attributes
    ----------
    stored_J, absorbed_J : arrays, shape (N,)
        Energies [J].
    first : array
        K* = K′ + i K″ [kN/mm].
    rise_kN : array
        Force at the end of the loading branch less that at its start [kN].
    forces_kN : (array, array)
        Least and largest force [kN].
    tangent_kN_per_mm : array or None
        Slope of the loading branch at the mean stroke [kN/mm].
    """

    def __init__(self, draws: Draws, propagation: CyclePropagation, known: Known) -> None:
        cycle = propagation.cycle
        super().__init__(
            draws, cycle, known, (propagation.turn_share(cycle.start), propagation.turn_share(cycle.top))
        )
        self.propagation, self.loop = propagation, propagation.loop
        self.stored_J, self.absorbed_J = propagation.energies(draws, self.errors_mm)
        self.first = _harmonic_draws(draws, propagation)
        rise = propagation.force[:, self.loop.top] - propagation.force[:, 0]
        ends_kN = propagation.end_scatter(self.errors_mm, draws)
        self.rise_kN = weighted(draws.force, rise) + ends_kN[1] - ends_kN[0]
        self.forces_kN = tuple(propagation.extreme_force(which, draws, ends_kN) for which in (0, 1))
        self.tangent_kN_per_mm = self._tangent()
        self._moments = draws.generator.standard_normal(draws.time_base.size)

    def _tangent(self) -> FloatArray | None:
        mean_mm = 0.5 * (self.cycle.stroke_min_mm + self.cycle.stroke_max_mm)
        reading = self.propagation.read(mean_mm, TANGENT_WINDOW * self.cycle.range_mm)
        return None if reading is None else slope_draws(self.draws, reading, self.mean_mm - mean_mm)

    @property
    def frequency_Hz(self) -> FloatArray | None:  # noqa: N802 - the unit keeps its capital
        """Frequency [Hz]: errors of the clock, and of the moments at which the cycle begins and ends."""
        value, cycle = self.known.figures.frequency_Hz, self.cycle
        if value is None:
            return None
        leaves_s, arrives_s = (
            self.propagation.moment_share(turn) * u_s
            for turn, u_s in ((cycle.start, cycle.start.u_leave_s), (cycle.end, cycle.end.u_time_s))
        )
        u_share = float(np.hypot(leaves_s, arrives_s)) / cycle.duration_s
        return value * (1.0 + self.draws.time_base + u_share * self._moments)

    def speed(self, name: str, branch: slice) -> FloatArray | None:
        """Return the largest speed of a branch [mm/s], by the name of its quantity."""
        speed, draws, own = getattr(self.known.figures, name), self.draws, self.propagation
        if speed is None:
            return None
        lean = speed_lean(self.loop, branch, own.samples, own.stroke_spectrum, self.cycle.index)
        too_fast = speed * _stretch(draws, self.loop, branch) + lean.mean
        by_noise = lean.scatter * draws.generator.standard_normal(draws.time_base.size)
        return np.asarray(speed * (1.0 + draws.time_base) + too_fast * draws.overreach + by_noise)

    @property
    def distortion(self) -> FloatArray | None:
        """Harmonics 2 to 10 of the stroke over the first."""
        return (
            None
            if self.known.figures.stroke_distortion is None
            else _distortion(self.draws, self.propagation)
        )


def cycle_draws(
    draws: Draws, propagation: CyclePropagation, known: Known | None = None
) -> dict[str, FloatArray]:
    """Return every quantity of a complete cycle that can be propagated, by name, for every draw.

    Parameters
    ----------
    draws : Draws
    propagation : CyclePropagation
    known : Known, optional
        Without it what is drawn about its value is left out.
    """
    return _drawn(QUANTITIES, DrawnLoop(draws, propagation, known or Known()))


def turn_draws(draws: Draws, cycle: Cycle, known: Known) -> dict[str, FloatArray]:
    """Return the quantities that a cycle has without its loop, for every draw."""
    return _drawn([*OF_TURNS, *OF_THERMOMETER], DrawnTurns(draws, cycle, known))


def _drawn(entries: Iterable[Quantity], drawn: DrawnTurns) -> dict[str, FloatArray]:
    """Return the draws of quantities of which there are any."""
    found = ((entry.name, entry.propagate(drawn)) for entry in entries)
    return {name: values for name, values in found if values is not None}


def _harmonic_draws(draws: Draws, propagation: CyclePropagation) -> FloatArray:
    """Return the complex stiffness K* of every draw, from Fourier integrals of the terms."""
    loop, cycle = propagation.loop, propagation.cycle
    turn = np.exp(-2j * np.pi * (loop.time_s - cycle.start_s) / cycle.duration_s)
    half = 0.5 * np.diff(loop.time_s)
    width = (np.append(half, 0.0) + np.append(0.0, half)) * turn  # the trapezoidal rule
    drift = (loop.time_s - cycle.start_s) / cycle.duration_s
    closed = propagation.stroke - np.outer(propagation.stroke[:, -1] - propagation.stroke[:, 0], drift)
    force_integrals = np.sum(propagation.force * width, axis=1)
    stroke_integrals = np.sum(closed * width, axis=1)
    amplitude_mm = abs(2.0 / cycle.duration_s * stroke_integrals[0])
    scatter = draws.generator.standard_normal((2, draws.force.shape[0]))
    stiffness = weighted(draws.force, force_integrals) / weighted(draws.stroke, stroke_integrals)
    both = np.asarray(np.stack((width.real, width.imag)) * (2.0 / cycle.duration_s), dtype=np.float64)
    whole = slice(0, loop.time_s.size)
    by_stroke = np.mean(np.abs(stiffness)) * propagation.stroke_noise_mm(both, whole)
    noise = np.hypot(propagation.force_noise_kN(both, whole), by_stroke) / amplitude_mm
    return np.asarray(stiffness + np.sqrt(np.mean(noise**2)) * (scatter[0] + 1j * scatter[1]))


def _speeds(loop: Loop, branch: slice) -> tuple[FloatArray, FloatArray]:
    """Return the mean speeds of parts of a branch as shares of the largest, and their strokes [mm]."""
    time_s, stroke_mm = loop.time_s[branch], loop.stroke_mm[branch]
    knots = np.unique(np.linspace(0, time_s.size - 1, _SPEED_PARTS + 1).round().astype(int))
    speed = np.abs(np.diff(stroke_mm[knots]) / np.diff(time_s[knots]))
    return speed / np.max(speed), 0.5 * (stroke_mm[knots[1:]] + stroke_mm[knots[:-1]])


def _stretch(draws: Draws, loop: Loop, branch: slice) -> FloatArray:
    """Return the relative error that the draw wires make of the largest speed of a branch, for every draw.

    Their deviation stretches the stroke here and shortens it there. Where the speed is even, the largest one
    is found where the stretch is largest, so that the error leans to one side, as that by noise does; where
    it has a peak, what it has fallen by beside it counts against that, but for what the wires may have made.
    """
    share, stroke_mm = _speeds(loop, branch)
    near = share >= _NEAR_LARGEST
    share = share[near]
    slopes = np.stack([stroke_term_slopes(float(at), draws.drums_mm) for at in stroke_mm[near]])
    stretch = draws.stroke @ slopes.T
    apart = stretch - stretch[:, [int(np.argmax(share))]]
    even = np.minimum(1.0, share + _MADE_BY_WIRES * np.sqrt(np.mean(apart**2, axis=0)))
    return np.asarray(np.max(even * (1.0 + stretch), axis=1) - 1.0)


def _distortion(draws: Draws, propagation: CyclePropagation) -> FloatArray:
    """Return the distortion of every draw: a deviation from the straight line makes harmonics of its own."""
    loop, cycle = propagation.loop, propagation.cycle
    drift = (loop.time_s - cycle.start_s) / cycle.duration_s
    closed = propagation.stroke - np.outer(propagation.stroke[:, -1] - propagation.stroke[:, 0], drift)
    weight = np.gradient(loop.time_s) * 2.0 / cycle.duration_s
    waves = np.exp(-2j * np.pi * np.outer([1, *_DISTORTING], drift)) * weight
    terms = closed @ waves.T
    real, imaginary = (draws.stroke @ part for part in (terms.real, terms.imag))
    harmonics = real + 1j * imaginary
    whole = slice(0, loop.time_s.size)
    both = [propagation.stroke_noise_mm(part, whole) for part in (waves.real, waves.imag)]
    share = np.sqrt(np.mean(np.square(both), axis=0))
    random = draws.generator.standard_normal((2, *harmonics.shape))
    harmonics = harmonics + share * (random[0] + 1j * random[1])
    others = np.sqrt(np.sum(np.abs(harmonics[:, 1:]) ** 2, axis=1))
    return np.asarray(others / np.abs(harmonics[:, 0]))
