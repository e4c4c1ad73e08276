"""Cycling between two forces, which no controller of edition 2 does by itself: it is driven from here.

A running ramp cannot be replaced by another, and a hold that is asked for comes late by a reaction. So the
first cycle feels its way: it goes no faster than a reaction allows, holds early by what the force would grow
meanwhile, and goes on by what is missing divided by the stiffness measured there. Every later ramp has the
speed that was asked for, goes to a learned position and ends by itself; after each turn the position is
corrected by::

    Δposition = (asked − reached force) / (dF / dposition)

Positions are the piston's from first contact [mm]: so what the machine gives way is part of what is learned.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bufferstand.daq.acquisition import Acquisition
from bufferstand.daq.motions.force_rows import ForceRow, ForceTurns, force_row
from bufferstand.daq.motions.turn_watch import TurnWatch
from bufferstand.daq.strokes import StrokeCommands
from bufferstand.foundation import RampTo
from bufferstand.protocols.prediction import FINEST_MM
from bufferstand.protocols.steps import ForceCycles, RampToForce

PASSES = 2.0
"""So many passes ahead is looked where a turn is not known yet: its force grows faster and faster."""
LOOKED_AT = 5
"""So many passes are looked at before the first ramp: on a busy computer they last longer than planned."""
WAY_MM = 2.0
"""As long as a turn is not known the piston goes no further than this within a reaction [mm]: so far a
spring's stiffness hardly changes, and its force can be foreseen."""
WINDOW_SHARE = 0.25
"""Nor may the force come by more than this share of what lies between the two forces …"""
STEEPER = 4.0
"""… where behind the upper turn it falls this much steeper than it rose: friction turns round."""
SLOWEST_MM_PER_S = 1.0
"""Slower it does not go [mm/s]: a spring would relax meanwhile."""
TOP_UPS = 8
"""So often at most a turn that fell short is gone on with."""
NEAR = 0.4
"""A turn within this share of the tolerance is left as it is; a ramp that would be off by more is held."""
LARGEST_SHARE = 0.2
"""A correction moves a turn by no more than this share of the stroke between the turns, on the way to less
force any further, for there the stiffness falls …"""
LARGEST_MM = 2.0
"""… or this, whichever is more [mm]: far off, the stiffness is another."""
BEYOND_MM = 0.1
"""So far beyond the stroke limit a ramp may seem to lead before it is held [mm]: noise."""
SOFTEST_SHARE = 0.2
"""A stiffness below this share of the secant's is taken for a failed measurement."""


class RampRunner(Protocol):
    """What cycling between two forces needs of whoever performs the motions."""

    commanding: StrokeCommands
    cycles_done: int
    command_s: float
    force_rows: list[ForceRow]

    def pump(self) -> None:
        """Take what was sampled, and obey guards and operator."""

    def wait(self, duration_s: float) -> None:
        """Let so much time pass [s of stand time]."""

    def ramp(self, way: RampTo, limit_s: float, enough: Callable[[], bool]) -> bool:
        """Perform a ramp until it ends or ``enough`` says so; return whether it ended by itself."""

    def counting_turns(self) -> AbstractContextManager[None]:
        """Count cycles by the turns of the force, inside."""

    def count_cycle(self) -> None:
        """Count a cycle that is complete."""


@dataclass
class _Turn:
    """One of the two turns: which way leads to it, the force aimed at [kN], and where it should lie [mm].

    ``known`` once it was made; ``stood_mm`` is where, with ``reached_kN``; ``by_limit``: not any further.
    """

    sign: float
    asked_kN: float
    target_mm: float
    known: bool = False
    reached_kN: float = 0.0
    stood_mm: float = 0.0
    by_limit: bool = False


def cycle_between_forces(
    motion: ForceCycles, driver: RampRunner, acquisition: Acquisition, limit_s: float
) -> None:
    """Perform the cycles; the piston stands at the lower force afterwards.

    Parameters
    ----------
    motion : ForceCycles
        What to do.
    driver : RampRunner
        Performs the ramps, counts the cycles, and obeys guards and operator.
    acquisition : Acquisition
        Its samples say what was reached; every cycle becomes an event of the run.
    limit_s : float
        So long a single ramp may take [s].

    Raises
    ------
    Halt
        As :meth:`bufferstand.daq.motions.motion_runner.MotionRunner.perform`.
    """
    cycling = _Cycling(motion, driver, acquisition, limit_s)
    acquisition.listeners.append(cycling.watch.take)
    try:
        with driver.counting_turns():
            cycling.look_at_passes()
            for _ in range(motion.cycles):
                cycling.cycle()
    finally:
        acquisition.listeners.remove(cycling.watch.take)
        cycling.say_what_was_reached()


class _Cycling:
    """The cycles of one motion, with what is learned in them."""

    def __init__(
        self, motion: ForceCycles, driver: RampRunner, acquisition: Acquisition, limit_s: float
    ) -> None:
        self._motion, self._driver = motion, driver
        self._acquisition, self._limit_s = acquisition, limit_s
        self.watch = TurnWatch()
        way = driver.commanding.way_to_force(
            RampToForce(motion.force_max_kN, motion.stroke_limit_mm, motion.speed_mm_per_s)
        )
        self._way_mm = self._furthest_mm = way.target_mm
        # What is within the tolerance of the upper force is not to be beyond the limit.
        most_kN = driver.commanding.force_max_kN - 0.5 * motion.tolerance_kN
        self._upper = _Turn(1.0, min(motion.force_max_kN, most_kN), self._furthest_mm)
        self._lower = _Turn(-1.0, motion.force_min_kN, 0.0)
        self._pass_s = acquisition.pace.tick_s
        self._passed_s: float | None = None
        self._stands_mm = 0.0
        self._made: list[ForceTurns] = []

    def look_at_passes(self) -> None:
        """Stand for some passes, to see how long one takes here: by that the first ramp has its speed."""
        for _ in range(LOOKED_AT):
            self._driver.pump()
            self._note_pass()

    def cycle(self) -> None:
        """Load, unload, and put what was reached into the run."""
        upper, lower = self._upper, self._lower
        before_mm = upper.stood_mm if upper.known else None
        self._go(upper)
        if before_mm is not None:  # what lies between the turns repeats itself, not where they are
            lower.target_mm = self._kept(lower.target_mm + upper.stood_mm - before_mm)
        self._go(lower)
        made = ForceTurns(self._driver.cycles_done + 1, lower.reached_kN, upper.reached_kN, upper.by_limit)
        self._acquisition.log.say(
            "force-cycle",
            f"cycle {made.number}: {made.text()}",
            cycle=made.number,
            force_min_kN=made.lower_kN,
            force_max_kN=made.upper_kN,
            piston_min_mm=lower.stood_mm,
            piston_max_mm=upper.stood_mm,
            stroke_limit=made.by_limit,
        )
        if made.is_off(self._motion) and not any(one.is_off(self._motion) for one in self._made):
            self._warn_of(made)
        self._made.append(made)
        self._driver.count_cycle()

    def _warn_of(self, made: ForceTurns) -> None:
        """Say aloud that a cycle is off, and why where that is known."""
        motion = self._motion
        why = f" (the stroke limit of {motion.stroke_limit_mm:g} mm came first)" if made.by_limit else ""
        self._driver.commanding.voice.warn(
            f"WARNING: cycle {made.number} went {made.text()}{why}, asked {motion.force_min_kN:g} … "
            f"{motion.force_max_kN:g} kN within {motion.tolerance_kN:.3g} kN"
        )

    def say_what_was_reached(self) -> None:
        """Put what was asked for and reached into the run; aloud where it was not met."""
        row = force_row(self._motion, self._made)
        if row is None:
            return
        self._driver.force_rows.append(row)
        self._acquisition.log.say("force", row.sentence(), **row.as_dict())
        if row.cycles_off:
            self._driver.commanding.voice.warn(f"WARNING: {row.sentence()}")

    def _go(self, turn: _Turn) -> None:
        """Go to a turn, and on where it fell short; learn where it lies."""
        self.watch.begin_turn(turn.sign)
        target_mm, turn.by_limit = turn.target_mm, False
        for _ in range(1 + TOP_UPS):
            self._ramp(turn, target_mm)
            turn.reached_kN = self.watch.extreme_kN
            missing_mm = self._missing_mm(turn)
            target_mm = self._kept(turn.stood_mm + missing_mm)
            short_kN = turn.sign * (turn.asked_kN - turn.reached_kN)
            if short_kN <= NEAR * self._motion.tolerance_kN:
                break
            if turn.sign * (target_mm - turn.stood_mm) < FINEST_MM:
                turn.by_limit = True
                break
        turn.target_mm, turn.known = target_mm, True

    def _ramp(self, turn: _Turn, target_mm: float) -> None:
        """Make one ramp and stand for the dwell, until all is read that was sampled in the ramp."""
        acquisition, driver = self._acquisition, self._driver
        self.watch.begin_ramp()
        self._passed_s = None
        speed = self._speed(turn)
        limit_s = self._limit_s + abs(target_mm - self._stands_mm) / speed
        driver.ramp(RampTo(target_mm, speed), limit_s, lambda: self._enough(turn, target_mm, speed))
        ended_us = acquisition.device_now_us
        acquisition.renew_status()
        driver.wait(self._motion.DWELL_S)
        while not acquisition.has_read_to(ended_us):
            driver.pump()
        status = acquisition.latest.status
        turn.stood_mm = target_mm if status is None else status.command_mm - driver.commanding.zero_mm
        self._stands_mm = turn.stood_mm
        if turn.sign > 0.0:  # the piston goes on by more than the specimen, never by less
            left_mm = self._motion.stroke_limit_mm - acquisition.latest.values.get("stroke", 0.0)
            self._furthest_mm = min(self._way_mm, turn.stood_mm + left_mm)

    def _speed(self, turn: _Turn) -> float:
        """Return how fast the piston goes to a turn [mm/s]: to one that is not known, as it can be seen."""
        if turn.known:
            return self._motion.speed_mm_per_s
        way_mm = WAY_MM
        if turn.sign < 0.0 and (stiffness := self.watch.stiffness_before_kN_per_mm):
            window_kN = self._upper.reached_kN - turn.asked_kN
            way_mm = min(way_mm, WINDOW_SHARE * max(window_kN, 0.0) / (STEEPER * stiffness))
        slow = max(way_mm / self._reaction_s(turn), SLOWEST_MM_PER_S)
        return min(self._motion.speed_mm_per_s, slow)

    def _reaction_s(self, turn: _Turn) -> float:
        """Return how long it takes from a sample until the piston stands because of it [s]."""
        wire_s = (self._acquisition.age_s or 0.0) + self._driver.command_s
        return (1.0 if turn.known else PASSES) * self._pass_s + wire_s + self._motion.REACTION_S

    def _note_pass(self) -> None:
        """See how long a pass takes; a long one counts for some time."""
        now_s = self._acquisition.latest.device_s
        if now_s is not None:
            if self._passed_s is not None:
                self._pass_s = max(now_s - self._passed_s, 0.9 * self._pass_s)
            self._passed_s = now_s

    def _enough(self, turn: _Turn, target_mm: float, speed_mm_per_s: float) -> bool:
        """Whether the ramp must be held now, so that the force is not overrun when the hold has come."""
        self._note_pass()
        rate = self.watch.rate_kN_per_s()
        if rate is None:
            return False
        left_s = turn.sign * (target_mm - self.watch.position_mm) / speed_mm_per_s
        ahead_s = min(self._reaction_s(turn), max(left_s, 0.0))
        then_mm = self._acquisition.latest.values.get("stroke", 0.0) + ahead_s * speed_mm_per_s
        if turn.sign > 0.0 and then_mm > self._motion.stroke_limit_mm + BEYOND_MM:
            return True
        then_kN = self.watch.force_kN + rate * ahead_s
        allowed_kN = NEAR * self._motion.tolerance_kN if turn.known else 0.0
        return turn.sign * (then_kN - turn.asked_kN) > allowed_kN

    def _missing_mm(self, turn: _Turn) -> float:
        """By how much the piston must go further (back: negative, signs as the stroke's), bounded."""
        between_mm = abs(self._upper.stood_mm - self._lower.stood_mm)
        between_kN = abs(self._upper.reached_kN - self._lower.reached_kN)
        softest = SOFTEST_SHARE * between_kN / between_mm if between_mm > 0.0 else 0.0
        stiffness = max(self.watch.stiffness_kN_per_mm() or 0.0, softest)
        if stiffness <= 0.0:
            return 0.0
        missing_mm = (turn.asked_kN - turn.reached_kN) / stiffness
        if turn.sign < 0.0 and missing_mm < 0.0:  # a spring unloads ever softer: this falls short, if at all
            return missing_mm
        most_mm = max(LARGEST_MM, LARGEST_SHARE * between_mm)
        return float(np.clip(missing_mm, -most_mm, most_mm))

    def _kept(self, target_mm: float) -> float:
        """Return a position that keeps contact and the limits of the step."""
        return min(max(target_mm, 0.0), self._furthest_mm)
