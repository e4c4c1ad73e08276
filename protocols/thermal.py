"""The walk through a step with the model's heat law: how long, how hot, and where it would be stopped.

The specimen is one lumped mass (paper, eqs. (6), (7)) with a sensor on it: the mass decides the forces, the
sensor decides the temperature stop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from protocols.limits import Envelope, TestLimits
from protocols.prediction import Predictor, Temperatures
from protocols.steps import (
    ExpectedStop,
    Harmonic,
    Hold,
    Motion,
    MotionEstimate,
    RampTo,
    RampToForce,
    Release,
    StaticCycles,
    WaitUntilCool,
)

FADE_SHARE = 0.4
"""Heat of the cycle in (or out) as a share of a full one: mean of a**1.5 while the amplitude a grows
linearly, between friction (a) and viscous loss (a**2)."""
PIECES = 50
"""Into how many pieces a long motion is cut, each at the temperature reached by then."""
LONGEST_WAIT_S = 7.0 * 86400.0
"""A wait longer than this counts as for ever [s]."""


@dataclass(frozen=True)
class Surroundings:
    """What a walk needs to know: the model, the limits, the guards and the air [°C]."""

    predictor: Predictor
    limits: Envelope
    test: TestLimits
    ambient_C: float


@dataclass(frozen=True)
class Walk:
    """What the walk through a step found; fields as in :class:`protocols.steps.PlannedStep`.

    ``end`` is the state at its end, or at the stop that ended it (``ended``); ``highest`` are the highest
    temperatures met.
    """

    estimates: tuple[MotionEstimate, ...]
    heat_J: float
    end: Temperatures
    highest: Temperatures
    expected_duration_s: float
    stops: tuple[ExpectedStop, ...]
    ended: bool


def cooling_time_s(
    predictor: Predictor,
    start: Temperatures,
    to_C: float,
    ambient_C: float,
    longest_s: float = LONGEST_WAIT_S,
) -> float | None:
    """Return how long a resting specimen takes until its sensor reads ``to_C`` or less [s].

    Returns
    -------
    float or None
        0 if it is cool enough already; None if it takes longer than ``longest_s``.
    """
    if start.sensor_C <= to_C:
        return 0.0

    def cool(duration_s: float) -> bool:
        return predictor.temperatures_after(start, ambient_C, 0.0, duration_s).sensor_C <= to_C

    if not cool(longest_s):
        return None
    return _first(cool, longest_s)


def _first(happened: Callable[[float], bool], longest_s: float) -> float:
    """Return the first time at which something has happened that stays so, bisected to 1e-6 of the span."""
    low, high = 0.0, longest_s
    while high - low > 1e-6 * max(high, 1.0):
        middle = (low + high) / 2.0
        low, high = (low, middle) if happened(middle) else (middle, high)
    return high


_Expected = RampTo | Release | Hold | WaitUntilCool | Harmonic | StaticCycles
"""A motion whose end is known: a ramp to a force has become the ramp to where the force is expected."""


class Walker:
    """Walks through the motions of one step.

    Parameters
    ----------
    around : Surroundings
        Model, limits, guards and air.
    start : Temperatures
        At the start.
    """

    def __init__(self, around: Surroundings, start: Temperatures) -> None:
        self._around = around
        self._now = start
        self._highest = start
        self._elapsed_s = 0.0
        self._heat_J = 0.0
        self._cycles = 0.0
        self._stops: list[ExpectedStop] = []
        self._ended = False

    def walk(self, motions: Sequence[Motion]) -> Walk:
        """Return what is expected of the motions, in order, beginning at zero force."""
        estimates = []
        stroke_mm = 0.0
        for motion in motions:
            heat_before_J = self._heat_J
            expected = self._ramp_to(motion, stroke_mm) if isinstance(motion, RampToForce) else motion
            duration_s = self._one(expected, stroke_mm)
            stroke_mm = expected.end_mm(stroke_mm)
            estimates.append(MotionEstimate(duration_s, self._heat_J - heat_before_J, self._now.mass_C))
        return Walk(
            tuple(estimates),
            self._heat_J,
            self._now,
            self._highest,
            self._elapsed_s,
            tuple(self._stops),
            self._ended,
        )

    def _one(self, motion: _Expected, stroke_mm: float) -> float:
        if isinstance(motion, Harmonic):
            return self._harmonic(motion)
        if isinstance(motion, StaticCycles):
            return self._static(motion)
        if isinstance(motion, WaitUntilCool):
            return self._cool(motion)
        duration_s = motion.duration_s(stroke_mm)
        heat_J = 0.0
        if isinstance(motion, RampTo | Release):
            heat_J = self._ramp_heat(stroke_mm, motion.end_mm(stroke_mm), motion.speed_mm_per_s)
        self._advance(duration_s, heat_J)
        return duration_s

    def _ramp_to(self, motion: RampToForce, stroke_mm: float) -> RampTo:
        """Return the ramp to where the force is expected, from rest; never back."""
        end_mm = self._around.predictor.static(
            motion.force_kN, motion.stroke_limit_mm, motion.speed_mm_per_s, self._now.mass_C
        ).end_stroke_mm
        return RampTo(max(stroke_mm, end_mm), motion.speed_mm_per_s)

    def _ramp_heat(self, from_mm: float, to_mm: float, speed_mm_per_s: float) -> float:
        """Half of what a slow cycle would absorb: there and back make a whole one."""
        halves = [
            0.5
            * self._around.predictor.static(
                self._around.limits.force.value, stroke_mm, speed_mm_per_s, self._now.mass_C
            ).absorbed_energy_J
            if stroke_mm > 0.0
            else 0.0
            for stroke_mm in (from_mm, to_mm)
        ]
        return abs(halves[1] - halves[0])

    def _harmonic(self, motion: Harmonic) -> float:
        period_s = 1.0 / motion.frequency_Hz

        def run(cycles: int, share: float) -> None:
            cycle = self._around.predictor.harmonic(
                motion.mean_mm, motion.amplitude_mm, motion.frequency_Hz, self._now.mass_C
            )
            counted = float(cycles) if share == 1.0 else 0.0
            self._advance(cycles * period_s, share * cycles * cycle.absorbed_energy_J, counted)

        run(1, FADE_SHARE)
        for cycles in _pieces(motion.cycles):
            run(cycles, 1.0)
        run(1, FADE_SHARE)
        return motion.duration_s(0.0)

    def _static(self, motion: StaticCycles) -> float:
        duration_s = 0.0
        for number in range(motion.cycles):
            cycle = self._around.predictor.static(
                motion.force_limit_kN, motion.stroke_limit_mm, motion.speed_mm_per_s, self._now.mass_C
            )
            cycle_s = 2.0 * cycle.end_stroke_mm / motion.speed_mm_per_s
            self._advance(cycle_s, cycle.absorbed_energy_J, 1.0)
            pause_s = motion.pause_s if number + 1 < motion.cycles else 0.0
            self._advance(pause_s, 0.0)
            duration_s += cycle_s + pause_s
        return duration_s

    def _cool(self, motion: WaitUntilCool) -> float:
        wait_s = cooling_time_s(
            self._around.predictor,
            self._now,
            motion.temperature_C,
            self._around.ambient_C,
            motion.timeout_s,
        )
        duration_s = motion.timeout_s if wait_s is None else wait_s
        self._rest(duration_s)
        return duration_s

    def _rest(self, duration_s: float) -> None:
        if self._ended:
            return
        self._now = self._after(0.0, duration_s)
        self._elapsed_s += duration_s

    def _advance(self, duration_s: float, heat_J: float, cycles: float = 0.0) -> None:
        """Go on at constant power; where the stop temperature is reached, do what the policy says."""
        if duration_s <= 0.0:
            return
        power_W, per_s = heat_J / duration_s, cycles / duration_s
        left_s = duration_s
        while left_s > 0.0 and not self._ended:
            hot_s = self._until_hot_s(power_W, left_s)
            run_s = left_s if hot_s is None else hot_s
            self._now = self._after(power_W, run_s)
            self._highest = Temperatures(
                max(self._highest.mass_C, self._now.mass_C), max(self._highest.sensor_C, self._now.sensor_C)
            )
            self._elapsed_s += run_s
            self._heat_J += power_W * run_s
            self._cycles += per_s * run_s
            left_s -= run_s
            if hot_s is not None:
                self._stop()

    def _after(self, power_W: float, duration_s: float) -> Temperatures:
        return self._around.predictor.temperatures_after(
            self._now, self._around.ambient_C, power_W, duration_s
        )

    def _until_hot_s(self, power_W: float, longest_s: float) -> float | None:
        """Return when the stop temperature is reached (0 if it is already), None if not within the time."""
        stop_C = self._around.test.temperature_stop_C
        if self._now.sensor_C >= stop_C:
            return 0.0
        if self._after(power_W, longest_s).sensor_C < stop_C:
            return None
        return _first(lambda time_s: self._after(power_W, time_s).sensor_C >= stop_C, longest_s)

    def _stop(self) -> None:
        around = self._around
        wait_s = cooling_time_s(
            around.predictor, self._now, around.test.temperature_resume_C, around.ambient_C
        )
        self._stops.append(ExpectedStop(self._elapsed_s, self._cycles, wait_s))
        if around.test.on_temperature_stop != "wait-and-continue" or wait_s is None:
            self._ended = True
            return
        self._rest(wait_s)


def _pieces(count: int) -> list[int]:
    """Return ``count`` cut into at most PIECES whole numbers of nearly equal size."""
    number = min(count, PIECES)
    return [count * (index + 1) // number - count * index // number for index in range(number)]
