"""An axis under a position loop, with its status and error bits (p. 864–870)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tests.peers.delta_rmc.targets import START_ANGLES, Hold, Move, RefusedError, Sine, Stop, Target
from tests.peers.delta_rmc.unsaid import Unsaid

IN_POSITION, OPEN_LOOP, STOPPED, ENABLE_OUTPUT, TARGET_DONE, DIRECT_OUTPUT, ENABLED, EXTERNAL_HALT, HALTED = (
    0,
    2,
    6,
    8,
    9,
    12,
    13,
    14,
    15,
)
"""Bits of the Status Bits register (p. 864; help page “Status Bits Register”)."""
FOLLOWING_ERROR, OUTPUT_SATURATED, NO_TRANSDUCER = 0, 2, 6
"""Bits of the Error Bits register (p. 870)."""


@dataclass(frozen=True)
class AxisFacts:
    """A hydraulic axis.

    Parameters
    ----------
    lag_s : float
        How late the piston follows its target (first order).
    speed_max_mm_per_s : float
        What the valve lets through.
    travel_mm : (float, float)
        Negative and positive travel limit: a requested position beyond is cut to it (p. 899).
    following_error_mm : float
        Position Error Tolerance.
    start_mm : float
        Where the piston stands at first; 0 is first contact.
    leak_mm_per_s : float
        Creep towards the start while no loop is closed and a force pushes.
    """

    lag_s: float = 0.006
    speed_max_mm_per_s: float = 800.0
    travel_mm: tuple[float, float] = (-20.0, 120.0)
    following_error_mm: float = 20.0
    start_mm: float = -5.0
    leak_mm_per_s: float = 0.5


class Axis:
    """One closed-loop position axis: it is not enabled until a command enables it."""

    def __init__(self, facts: AxisFacts, unsaid: Unsaid) -> None:
        self._facts, self._unsaid = facts, unsaid
        self.position_mm = self.target_mm = self.command_mm = facts.start_mm
        self.speed_mm_per_s = self.target_speed_mm_per_s = 0.0
        self.enabled = self.closed = self.halted = False
        self.errors = 0
        self.last_error = 0
        self._target: Target = Hold(facts.start_mm)
        self.sine: Sine | None = None
        self.sine_block: int | None = None

    @property
    def status(self) -> int:
        """The Status Bits register."""
        bits = 0
        done = self._target.done
        near = abs(self.position_mm - self.command_mm) <= self._unsaid.in_position_mm
        if self.closed and done and near and not isinstance(self._target, (Stop, Sine)) and not self.halted:
            bits |= 1 << IN_POSITION
        bits |= (0 if self.closed else 1) << OPEN_LOOP
        bits |= (1 if abs(self.speed_mm_per_s) < 0.5 else 0) << STOPPED
        bits |= (1 if self.enabled else 0) << ENABLE_OUTPUT
        bits |= (1 if done else 0) << TARGET_DONE
        bits |= (0 if self.closed else 1) << DIRECT_OUTPUT
        bits |= (1 if self.enabled else 0) << ENABLED
        return bits | (1 if self.halted else 0) << HALTED

    def step(self, dt_s: float, force_kN: float) -> None:
        """Advance by a loop of the controller; a force [kN] pushes back while no loop is closed."""
        before = self.position_mm
        if self.closed:
            target = self._target.step(dt_s)
            self.target_speed_mm_per_s = (target - self.target_mm) / dt_s
            self.target_mm = target
            move = (target - self.position_mm) * -math.expm1(-dt_s / self._facts.lag_s)
            reach = self._facts.speed_max_mm_per_s * dt_s
            self.position_mm += max(-reach, min(reach, move))
            if abs(self.target_mm - self.position_mm) > self._facts.following_error_mm:
                self.fault(FOLLOWING_ERROR)
        else:
            if force_kN > 0.0:
                self.position_mm -= self._facts.leak_mm_per_s * dt_s
            self.target_mm = self.command_mm = self.position_mm
            self.target_speed_mm_per_s = 0.0
        self.speed_mm_per_s = (self.position_mm - before) / dt_s

    def fault(self, bit: int) -> None:
        """Latch an error and halt: an Auto Stop of the kind Direct Output Halt (3)."""
        self.errors |= 1 << bit
        self.direct_output_halt()

    def direct_output_halt(self) -> None:
        """Open the loop; the output is zero."""
        self.closed, self.halted, self.sine = False, True, None
        self._target = Hold(self.position_mm)

    def clear_faults(self) -> None:
        """Clear the errors whose cause is gone (p. 869: so does every motion command)."""
        self.errors, self.halted = 0, False

    def enable(self, on: bool) -> None:
        """Set Enable Output (67), Enable/Disable Axis (97)."""
        self.enabled = on
        if not on:
            self.closed, self.sine = False, None

    def _ready(self) -> None:
        if not self.enabled:
            raise RefusedError("the axis is not enabled")
        self.clear_faults()
        self.closed, self.sine = True, None

    def hold(self) -> None:
        """Hold Current Position (5): target and command are the actual position, without a ramp (p. 718)."""
        self._ready()
        self.command_mm = self.target_mm = self.position_mm
        self._target = Hold(self.position_mm)

    def stop(self, fall_mm_per_s2: float) -> None:
        """Stop (Closed Loop) (6), Closed Loop Halt (1)."""
        speed = self.target_speed_mm_per_s
        self._ready()
        self._target = Stop(self.target_mm, speed, fall_mm_per_s2)

    def move(self, end_mm: float, speed: float, rise: float, fall: float) -> None:
        """Move Absolute (20) (p. 733, 899)."""
        before = self.target_speed_mm_per_s
        low, high = self._facts.travel_mm
        target = Move(self.target_mm, before, min(max(end_mm, low), high), speed, rise, fall)
        self._ready()
        self.command_mm = min(max(end_mm, low), high)
        self._target = target

    def start_sine(
        self, offset: float, amplitude: float, frequency: float, cycles: float, location: int
    ) -> None:
        """Sine Start (72): the target must be where the sine starts (p. 777)."""
        low, high = self._facts.travel_mm
        if offset - amplitude < low or offset + amplitude > high:
            raise RefusedError("the sine leaves the travel limits")
        places = {0.0: offset, 90.0: offset + amplitude, 180.0: offset, 270.0: offset - amplitude}
        if location == 0:
            angles = [angle for angle in (0.0, 90.0, 270.0) if self._at(places[angle])]
        else:
            angles = [angle for angle in (START_ANGLES.get(location),) if angle is not None]
            angles = [angle for angle in angles if self._at(places[angle])]
        if not angles:
            raise RefusedError("the target is not where the sine starts")
        sine = Sine(offset, amplitude, frequency, cycles, angles[0])
        self._ready()
        self._target = self.sine = sine

    def _at(self, place_mm: float) -> bool:
        return abs(self.target_mm - place_mm) <= self._unsaid.settle_mm

    def running_sine(self) -> Sine:
        """Give the sine that runs (73, 80 need one)."""
        if self.sine is None or self.sine.done:
            raise RefusedError("no sine is running")
        return self.sine
