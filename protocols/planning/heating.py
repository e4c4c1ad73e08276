"""Follows a step with the model's heat law: its duration, its temperature, and where it would be stopped.

The specimen is one lumped mass (paper, eqs. (6), (7)) with a sensor on it: the mass decides the forces, the
sensor decides the temperature stop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from bufferstand.foundation import Harmonic, RampTo, Release, StaticCycles
from bufferstand.protocols.limits import Envelope, TestLimits
from bufferstand.protocols.prediction import (
    Predictor,
    StaticEstimate,
    Temperatures,
    comes_in_two_goes,
    force_turns,
    piston_mm,
    rested_even,
)
from bufferstand.protocols.steps import (
    ExpectedStop,
    ExpectedTurns,
    ForceCycles,
    Heating,
    Hold,
    Motion,
    MotionEstimate,
    RampToForce,
    StartBand,
    TouchOff,
    WaitUntilCool,
    Warmth,
)

FADE_SHARE = 0.4
"""Heat of the cycle in (or out) as a share of a full one: mean of a**1.5 while the amplitude a grows
linearly, between friction (a) and viscous loss (a**2)."""
PIECES = 50
"""Into how many pieces a long motion is cut, each at the temperature reached by then."""
EACH_CYCLE = 200
"""So many slow cycles of a motion are each predicted at their own temperature."""
ONE_BY_ONE = 1000
"""So many slow cycles of a motion are walked through one by one, those beyond in as many pieces."""
MOST_STOPS = 100
"""Stops of a step by its temperature after which no further one is looked for: it is no step to be run."""
SAME_CYCLE_K = 0.05
"""Beyond them, one stands for all within this [K]: forces follow temperature by 1 % in a kelvin."""
WARM_PIECE_K = 0.25
"""While it is warmed up, a piece heats the specimen by so much [K], or by a quarter of the band."""
LONGEST_WAIT_S = 7.0 * 86400.0
"""A wait longer than this counts as for ever [s]."""


@dataclass(frozen=True)
class Surroundings:
    """What a walk needs to know: the model, the limits, the guards and the air [°C]."""

    predictor: Predictor
    limits: Envelope
    test: TestLimits
    ambient_C: float

    @property
    def give_mm_per_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """By how much the machine gives way under 1 kN [mm/kN]."""
        return self.limits.machine.give_mm_per_kN


@dataclass(frozen=True)
class Walk:
    """What the walk through a step found; fields as in :class:`bufferstand.protocols.steps.PlannedStep`.

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
    cycles: float = 0.0
    """Full cycles done."""


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


_Expected = RampTo | Release | Hold | WaitUntilCool | Harmonic | StaticCycles | ForceCycles | TouchOff
"""A motion whose end is known: a ramp to a force has become the ramp to where the force is expected."""


class Walker:
    """Walks through the motions of one step.

    Parameters
    ----------
    around : Surroundings
        Model, limits, guards and air.
    start : Temperatures
        At the start.
    compensate : bool
        Whether the motions' strokes are the specimen's; else they are the piston's.
    """

    def __init__(self, around: Surroundings, start: Temperatures, *, compensate: bool = True) -> None:
        self._around = around
        self._compensate = compensate
        self._taken = 0.0 if compensate else around.give_mm_per_kN
        """What the machine takes of a stroke that is asked for [mm/kN]."""
        self._warmth: Warmth | None = None
        self._now = start
        self._highest = start
        self._elapsed_s = 0.0
        self._heat_J = 0.0
        self._cycles = 0.0
        self._cycle_C: list[float] = []
        """Of the motion under way: the mass at even steps of its cycles [°C]."""
        self._stops: list[ExpectedStop] = []
        self._ended = False

    def cool_into(self, band: StartBand | None) -> float:
        """Wait until a specimen that is too warm is in the band in which a step begins; return how long [s].

        The time-out where it will not be by then; 0 where there is no band.
        """
        if band is None:
            return 0.0
        before_s = self._elapsed_s
        self._cool(WaitUntilCool(band.high_C, band.timeout_s))
        self._highest = self._now  # how warm it was before belongs to no test
        return self._elapsed_s - before_s

    @property
    def now(self) -> Temperatures:
        """The temperatures at present."""
        return self._now

    def walk(
        self, motions: Sequence[Motion], warmth: Warmth | None = None, heating: Heating | None = None
    ) -> Walk:
        """Return what is expected of the motions, in order, beginning at zero force.

        With ``warmth`` cyclic motions last until the spring is as warm as that, and it rests until the sensor
        is even with it; a specimen that is warm already is not moved, and one that is too warm, before or
        afterwards, rests. ``heating`` says whether the cycles come in two goes, with a rest between.
        """
        self._warmth = warmth
        first_s = 0.0 if warmth is None else self._rest_even(warmth)
        if warmth is not None and self._now.sensor_C >= warmth.low_C:
            rest_s = first_s + self._cool(WaitUntilCool(warmth.high_C, warmth.timeout_s))
            still = (MotionEstimate(0.0, 0.0, self._now.mass_C),) * (len(motions) - 1)
            return self._walked([*still, MotionEstimate(rest_s, 0.0, self._now.mass_C)])
        estimates = []
        stroke_mm = 0.0
        for motion in motions:
            heat_before_J = self._heat_J
            expected = self._ramp_to(motion, stroke_mm) if isinstance(motion, RampToForce) else motion
            turns, self._cycle_C = self._turns(expected), []
            duration_s = self._one(expected, stroke_mm)
            between = turns if isinstance(expected, ForceCycles) else None
            stroke_mm = expected.end_mm(stroke_mm) if between is None else between.lower_mm
            heat_J = self._heat_J - heat_before_J
            estimates.append(
                MotionEstimate(duration_s, heat_J, self._now.mass_C, turns, tuple(self._cycle_C))
            )
        if warmth is not None:
            rest_s = self._rest_even(warmth)
            if heating is not None and comes_in_two_goes(heating, warmth):
                self._elapsed_s += rest_s
                rest_s *= 2.0
            rest_s += first_s + self._cool(WaitUntilCool(warmth.high_C, warmth.timeout_s))
            last = estimates[-1]
            estimates[-1] = replace(last, duration_s=last.duration_s + rest_s)
            if not self._around.predictor.knows_heat:  # it ends so warm, or the campaign stops
                self._now = Temperatures(warmth.temperature_C, warmth.temperature_C)
        return self._walked(estimates)

    def heating(self, motions: Sequence[Motion]) -> Heating:
        """Return what is expected of warming up with these motions from now on."""
        walks = []
        for cycles in (1, 2):
            walker = Walker(self._around, self._now, compensate=self._compensate)
            walks.append(walker.walk([_with_cycles(motion, cycles) for motion in motions]))
        one, two = walks
        lag_s = self._around.predictor.sensor_lag_s
        rise_K = two.end.mass_C - one.end.mass_C
        period_s = two.expected_duration_s - one.expected_duration_s
        if not (rise_K > 0.0 and period_s > 0.0):
            return Heating(None, None, None, lag_s)
        return Heating(rise_K, rise_K / period_s, one.end.mass_C - self._now.mass_C, lag_s)

    def _rest_even(self, warmth: Warmth) -> float:
        """Rest until sensor and spring are even; return how long [s]."""
        rest_s, _ = rested_even(self._around.predictor, self._now, self._around.ambient_C, warmth)
        self._rest(rest_s)
        return rest_s

    def _walked(self, estimates: Sequence[MotionEstimate]) -> Walk:
        return Walk(
            tuple(estimates),
            self._heat_J,
            self._now,
            self._highest,
            self._elapsed_s,
            tuple(self._stops),
            self._ended,
            self._cycles,
        )

    def _one(self, motion: _Expected, stroke_mm: float) -> float:
        if isinstance(motion, Harmonic):
            return self._harmonic(motion)
        if isinstance(motion, StaticCycles):
            return self._static(motion)
        if isinstance(motion, ForceCycles):
            return self._between_forces(motion)
        if isinstance(motion, WaitUntilCool):
            return self._cool(motion)
        duration_s = motion.duration_s(stroke_mm)
        heat_J = 0.0
        if isinstance(motion, RampTo | Release):
            heat_J = self._ramp_heat(stroke_mm, motion.end_mm(stroke_mm), motion.speed_mm_per_s)
        self._advance(duration_s, heat_J)
        return duration_s

    def _slow(self, force_limit_kN: float, stroke_limit_mm: float, speed_mm_per_s: float) -> StaticEstimate:
        """Return the slow cycle from zero to the limits, whosever the stroke limit is."""
        return self._around.predictor.static(
            force_limit_kN, stroke_limit_mm, speed_mm_per_s, self._now.mass_C, self._taken
        )

    def _turns(self, motion: _Expected) -> ExpectedTurns | None:
        """Return where a motion turns, or ends, at the temperature with which it begins."""
        give = self._around.give_mm_per_kN
        if self._around.predictor.known_to_mm == 0.0:
            return None
        if isinstance(motion, Harmonic):
            cycle = self._around.predictor.harmonic(
                motion.mean_mm, motion.amplitude_mm, motion.frequency_Hz, self._now.mass_C, self._taken
            )
            low, high, stroke = cycle.lower_force_kN, cycle.peak_force_kN, cycle.stroke
            return ExpectedTurns(
                stroke.lower_mm, stroke.upper_mm, low, high,
                piston_mm(stroke.lower_mm, low, give), piston_mm(stroke.upper_mm, high, give),
            )  # fmt: skip
        if isinstance(motion, ForceCycles):
            return force_turns(self._around.predictor, motion, self._now.mass_C, give, self._taken)
        if isinstance(motion, StaticCycles):
            slow = self._slow(motion.force_limit_kN, motion.stroke_limit_mm, motion.speed_mm_per_s)
        elif isinstance(motion, RampTo) and motion.target_mm > 0.0:
            slow = self._slow(self._around.limits.force.value, motion.target_mm, motion.speed_mm_per_s)
        else:
            return None
        end_mm, high = slow.end_stroke_mm, slow.peak_force_kN
        return ExpectedTurns(0.0, end_mm, 0.0, high, 0.0, piston_mm(end_mm, high, give))

    def _ramp_to(self, motion: RampToForce, stroke_mm: float) -> RampTo:
        """Return the ramp to where the force is expected, from rest; never back."""
        slow = self._slow(motion.force_kN, motion.stroke_limit_mm, motion.speed_mm_per_s)
        end_mm = piston_mm(slow.end_stroke_mm, slow.peak_force_kN, self._taken)
        return RampTo(max(stroke_mm, end_mm), motion.speed_mm_per_s)

    def _ramp_heat(self, from_mm: float, to_mm: float, speed_mm_per_s: float) -> float:
        """Half of what a slow cycle would absorb: there and back make a whole one."""
        halves = [
            0.5 * _slow_heat_J(self._slow(self._around.limits.force.value, stroke_mm, speed_mm_per_s))
            if stroke_mm > 0.0
            else 0.0
            for stroke_mm in (from_mm, to_mm)
        ]
        return abs(halves[1] - halves[0])

    def _harmonic(self, motion: Harmonic) -> float:
        period_s = 1.0 / motion.frequency_Hz

        def run(cycles: int, share: float) -> None:
            cycle = self._around.predictor.harmonic(
                motion.mean_mm, motion.amplitude_mm, motion.frequency_Hz, self._now.mass_C, self._taken
            )
            counted = float(cycles) if share == 1.0 else 0.0
            self._advance(cycles * period_s, share * cycles * cycle.absorbed_energy_J, counted)

        run(1, FADE_SHARE)
        if self._warmth is not None:
            done = self._until_warm(motion.cycles, lambda cycles: run(cycles, 1.0))
            return (done + 1) * period_s  # it ends by a hold, without a cycle out
        self._cycle_C.append(self._now.mass_C)
        for cycles in _pieces(motion.cycles):
            run(cycles, 1.0)
            self._cycle_C.append(self._now.mass_C)
        run(1, FADE_SHARE)
        return motion.duration_s(0.0)

    def _until_warm(self, most: int, run: Callable[[int], object]) -> int:
        """Run cycles until the sensor will be warm enough or the most are done; return how many."""
        done, last, now = 0, 0, self._now
        assert self._warmth is not None
        piece_K = min(WARM_PIECE_K, 0.25 * self._warmth.band_K)
        while done < most and not self._ended and self._expected_C() < self._warmth.temperature_C:
            before, pieces = self._now, 1
            if done:
                rise_K = (before.mass_C - now.mass_C) / (done - last)
                pieces = most - done if rise_K <= 1e-9 else max(1, int(piece_K / rise_K))
            last, now = done, before
            run(min(pieces, most - done))
            done += min(pieces, most - done)
        return done

    def _expected_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Return what the sensor will show when it is even with the spring, if nothing moves from now on."""
        assert self._warmth is not None
        around = self._around
        return rested_even(around.predictor, self._now, around.ambient_C, self._warmth)[1].sensor_C

    def _static(self, motion: StaticCycles) -> float:
        duration_s = 0.0
        known: dict[int, StaticEstimate] = {}
        done = 0
        for alike in _ever_more(motion.cycles):
            if self._warmth is not None and self._expected_C() >= self._warmth.temperature_C:
                break
            cycle = self._slow_again(motion, known, done)
            # It is the piston that moves at the constant speed, whosever the limit of the stroke is.
            top_mm = piston_mm(cycle.end_stroke_mm, cycle.peak_force_kN, self._around.give_mm_per_kN)
            cycle_s, heat_J = 2.0 * top_mm / motion.speed_mm_per_s, _slow_heat_J(cycle)
            if (
                before := alike - 1
            ):  # at their mean power, at which the temperature is in the middle of a pause
                self._advance(
                    before * (cycle_s + motion.pause_s) - 0.5 * motion.pause_s, before * heat_J, float(before)
                )
                self._advance(0.5 * motion.pause_s, 0.0)
            self._advance(cycle_s, heat_J, 1.0)
            done += alike
            pause_s = motion.pause_s if done < motion.cycles else 0.0
            self._advance(pause_s, 0.0)
            duration_s += before * (cycle_s + motion.pause_s) + cycle_s + pause_s
        return duration_s

    def _slow_again(
        self, motion: StaticCycles, known: dict[int, StaticEstimate], number: int
    ) -> StaticEstimate:
        """Return the slow cycle at the present temperature; of many, one for each small part of a kelvin."""
        part = round(self._now.mass_C / SAME_CYCLE_K)
        cycle = known.get(part) if number >= EACH_CYCLE else None
        if cycle is None:
            cycle = self._slow(motion.force_limit_kN, motion.stroke_limit_mm, motion.speed_mm_per_s)
            known[part] = cycle
        return cycle

    def _between_forces(self, motion: ForceCycles) -> float:
        """Load to the lower force, cycle from there; the strokes follow the temperature in pieces."""
        turns = force_turns(
            self._around.predictor, motion, self._now.mass_C, self._around.give_mm_per_kN, self._taken
        )
        duration_s = turns.piston_lower_mm / motion.speed_mm_per_s
        self._advance(duration_s, self._ramp_heat(0.0, turns.lower_mm, motion.speed_mm_per_s))
        for cycles in _pieces(motion.cycles):
            turns = force_turns(
                self._around.predictor, motion, self._now.mass_C, self._around.give_mm_per_kN, self._taken
            )
            move_s = 2.0 * (turns.piston_upper_mm - turns.piston_lower_mm) / motion.speed_mm_per_s
            amplitude_mm = 0.5 * (turns.upper_mm - turns.lower_mm)
            heat_J = 0.0
            if amplitude_mm > 0.0:  # of the sine between the same turns, in the same time
                heat_J = self._around.predictor.harmonic(
                    turns.lower_mm + amplitude_mm, amplitude_mm, 1.0 / move_s, self._now.mass_C
                ).absorbed_energy_J
            cycle_s = move_s + 2.0 * motion.DWELL_S
            self._advance(cycles * cycle_s, cycles * heat_J, float(cycles))
            duration_s += cycles * cycle_s
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
        enough = len(self._stops) >= MOST_STOPS
        if around.test.on_temperature_stop != "wait-and-continue" or wait_s is None or enough:
            self._ended = True
            return
        self._rest(wait_s)


def _with_cycles(motion: Motion, cycles: int) -> Motion:
    """Return a cyclic motion with other cycles, any other as it is."""
    return replace(motion, cycles=cycles) if isinstance(motion, Harmonic | StaticCycles) else motion


def _slow_heat_J(cycle: StaticEstimate) -> float:  # noqa: N802 - the unit keeps its capital
    """Return what a slow cycle heats [J].

    A small one is not closed: friction ends it above where it began, so that its work is less than nothing.
    """
    return max(0.0, cycle.absorbed_energy_J)


def _ever_more(count: int) -> list[int]:
    """Return ``count`` cut into whole numbers: one by one, then so many alike that a plan is done at once."""
    single = min(count, ONE_BY_ONE)
    return [1] * single + (_pieces(count - single, ONE_BY_ONE) if count > single else [])


def _pieces(count: int, most: int = PIECES) -> list[int]:
    """Return ``count`` cut into at most ``most`` whole numbers of nearly equal size."""
    number = min(count, most)
    return [count * (index + 1) // number - count * index // number for index in range(number)]
