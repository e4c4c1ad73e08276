"""Cycling between two forces, which no controller of edition 2 does by itself: it is driven from here.

A running ramp cannot be replaced by another, and a hold that is asked for comes late by a reaction. So the
first cycle feels its way: it holds early by what the force would grow meanwhile, and goes on by what is
missing divided by the stiffness measured there. Every later ramp goes to a learned position and ends by
itself; after each turn the position is corrected by::

    Δposition = (asked − reached force) / (dF / dposition)

Positions are the piston's from first contact [mm]: so what the machine gives way is part of what is learned.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from daq.acquisition import Acquisition
from daq.turn_watch import TurnWatch
from protocols.steps import ForceCycles, RampTo, RampToForce

if TYPE_CHECKING:
    from daq.driving import Driver

REACTION_S = 0.03
"""From the command to hold until the piston stands [s]; the age of the newest sample, the time of a pass and
what the command takes on the wire come on top, as they are measured."""
PASSES = 2.0
"""So many passes ahead is looked where a turn is not known yet: its force grows faster and faster."""
TOP_UPS = 8
"""So often at most a turn that fell short is gone on with."""
NEAR = 0.4
"""A turn within this share of the tolerance is left as it is; a ramp that would be off by more is held."""
LARGEST_SHARE = 0.2
"""A correction moves a turn by no more than this share of the stroke between the turns, on the way to less
force any further, for there the stiffness falls …"""
LARGEST_MM = 2.0
"""… or this, whichever is more [mm]: far off, the stiffness is another."""
LEAST_MM = 0.02
"""Less is left as it is [mm]: encoders show a hundredth."""
BEYOND_MM = 0.1
"""So far beyond the stroke limit a ramp may seem to lead before it is held [mm]: noise."""
SOFTEST_SHARE = 0.2
"""A stiffness below this share of the secant's is taken for a failed measurement."""


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
    motion: ForceCycles, driver: Driver, acquisition: Acquisition, limit_s: float
) -> None:
    """Perform the cycles; the piston stands at the lower force afterwards.

    Parameters
    ----------
    motion : ForceCycles
        What to do.
    driver : Driver
        Performs the ramps, counts the cycles, and obeys guards and operator.
    acquisition : Acquisition
        Its samples say what was reached; every cycle becomes an event of the run.
    limit_s : float
        So long a single ramp may take [s].

    Raises
    ------
    Halt
        As :meth:`daq.driving.Driver.perform`.
    """
    cycling = _Cycling(motion, driver, acquisition, limit_s)
    acquisition.listeners.append(cycling.watch.take)
    try:
        with driver.counting_turns():
            for _ in range(motion.cycles):
                cycling.cycle()
    finally:
        acquisition.listeners.remove(cycling.watch.take)
    cycling.say_what_was_missed()


class _Cycling:
    """The cycles of one motion, with what is learned in them."""

    def __init__(self, motion: ForceCycles, driver: Driver, acquisition: Acquisition, limit_s: float) -> None:
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
        self._missed: dict[str, list[int]] = {}

    def cycle(self) -> None:
        """Load, unload, and put what was reached into the run."""
        for turn in (self._upper, self._lower):
            self._go(turn)
        upper, lower = self._upper, self._lower
        number = self._driver.cycles_done + 1
        for turn, name in ((upper, "force_max_kN"), (lower, "force_min_kN")):
            if abs(turn.reached_kN - getattr(self._motion, name)) > self._motion.tolerance_kN:
                self._missed.setdefault(name, []).append(number)
        self._acquisition.say(
            "force-cycle",
            f"cycle {number}: {lower.reached_kN:.1f} … {upper.reached_kN:.1f} kN",
            cycle=number,
            force_min_kN=lower.reached_kN,
            force_max_kN=upper.reached_kN,
            piston_min_mm=lower.stood_mm,
            piston_max_mm=upper.stood_mm,
            stroke_limit=upper.by_limit,
        )
        self._driver.count_cycle()

    def say_what_was_missed(self) -> None:
        """Say which turns were further from their force than the tolerance."""
        motion = self._motion
        for name, cycles in self._missed.items():
            where = f"{len(cycles)} of the cycles, first in {cycles[0]}"
            met = f"was not met within {motion.tolerance_kN:.3g} kN"
            why = ""
            if name == "force_max_kN" and self._upper.by_limit:
                why = f": the stroke limit of {motion.stroke_limit_mm:g} mm came first"
            text = f"{name} = {getattr(motion, name):g} {met} in {where}{why}"
            self._acquisition.say("step", text, cycles=cycles)

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
            if turn.sign * (target_mm - turn.stood_mm) < LEAST_MM:
                turn.by_limit = True
                break
        turn.target_mm, turn.known = target_mm, True

    def _ramp(self, turn: _Turn, target_mm: float) -> None:
        """Make one ramp and stand for the dwell, until all is read that was sampled in the ramp."""
        acquisition, driver = self._acquisition, self._driver
        self.watch.begin_ramp()
        self._passed_s = None
        speed = self._motion.speed_mm_per_s
        driver.ramp(RampTo(target_mm, speed), self._limit_s, lambda: self._enough(turn, target_mm))
        ended_us = acquisition.device_now_us
        acquisition.renew_status()
        driver.wait(self._motion.DWELL_S)
        while not acquisition.has_read_to(ended_us):
            driver.pump()
        status = acquisition.latest.status
        turn.stood_mm = target_mm if status is None else status.command_mm - driver.commanding.zero_mm
        if turn.sign > 0.0:  # the piston goes on by more than the specimen, never by less
            left_mm = self._motion.stroke_limit_mm - acquisition.latest.values.get("stroke", 0.0)
            self._furthest_mm = min(self._way_mm, turn.stood_mm + left_mm)

    def _enough(self, turn: _Turn, target_mm: float) -> bool:
        """Whether the ramp must be held now, so that the force is not overrun when the hold has come."""
        latest = self._acquisition.latest
        if latest.device_s is not None:
            if self._passed_s is not None:
                self._pass_s = max(latest.device_s - self._passed_s, 0.9 * self._pass_s)
            self._passed_s = latest.device_s
        rate = self.watch.rate_kN_per_s()
        if rate is None:
            return False
        left_s = turn.sign * (target_mm - self.watch.position_mm) / self._motion.speed_mm_per_s
        wire_s = (self._acquisition.age_s or 0.0) + self._driver.command_s
        reaction_s = (1.0 if turn.known else PASSES) * self._pass_s + wire_s + REACTION_S
        ahead_s = min(reaction_s, max(left_s, 0.0))
        then_mm = latest.values.get("stroke", 0.0) + ahead_s * self._motion.speed_mm_per_s
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
