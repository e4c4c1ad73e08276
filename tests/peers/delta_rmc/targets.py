"""Where the axis shall be: moves of limited speed and acceleration, sines with ramps (p. 718, 777–784)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

START_ANGLES = {1: 0.0, 2: 90.0, 3: 180.0, 4: 270.0}
"""Start Location → angle [°]: Mid-Pos, Pos Peak, Mid-Neg, Neg Peak (p. 777, 828)."""
WRAP = 10_000_000
"""Cycles after which the count of an endless sine begins anew (p. 779)."""


class RefusedError(ValueError):
    """A command that the controller does not take."""


class Target(Protocol):
    """A target generator: a place and whether it is done."""

    done: bool

    def step(self, dt_s: float) -> float:
        """Advance by a loop and give the target [mm]."""
        ...


class Hold:
    """A place that stays."""

    done = True

    def __init__(self, place_mm: float) -> None:
        self._place_mm = place_mm

    def step(self, dt_s: float) -> float:  # noqa: ARG002
        """Give the place."""
        return self._place_mm


class Move:
    """A move with trapezoidal speed: Move Absolute (20), Move Relative (21), and a stop (6) as its end.

    Parameters
    ----------
    place_mm, speed_mm_per_s : float
        Where the target is and how fast, with its sign.
    end_mm, cruise_mm_per_s, rise_mm_per_s2, fall_mm_per_s2 : float
        Requested position, speed, acceleration, deceleration.
    """

    def __init__(
        self,
        place_mm: float,
        speed_mm_per_s: float,
        end_mm: float,
        cruise_mm_per_s: float,
        rise_mm_per_s2: float,
        fall_mm_per_s2: float,
    ) -> None:
        if not (cruise_mm_per_s > 0.0 and rise_mm_per_s2 > 0.0 and fall_mm_per_s2 > 0.0):
            raise RefusedError("speed and rates are to be above zero")
        self.done = False
        self._place, self._speed, self._end = place_mm, speed_mm_per_s, end_mm
        self._cruise, self._rise, self._fall = cruise_mm_per_s, rise_mm_per_s2, fall_mm_per_s2

    def step(self, dt_s: float) -> float:
        """Advance by a loop."""
        if self.done:
            return self._end
        left = self._end - self._place
        side = math.copysign(1.0, left)
        # The speed from which the rest of the way is just enough to stop.
        wanted = side * min(self._cruise, math.sqrt(2.0 * self._fall * abs(left)))
        rate = self._rise if abs(wanted) > abs(self._speed) else 2.0 * self._fall
        change = wanted - self._speed
        self._speed += math.copysign(min(abs(change), rate * dt_s), change)
        self._place += self._speed * dt_s
        # At the end when the next loop would go past it.
        if (
            abs(self._end - self._place) <= max(abs(self._speed) * dt_s, 1e-6)
            and abs(self._speed) <= 4.0 * self._fall * dt_s
        ):
            self._place, self._speed, self.done = self._end, 0.0, True
        return self._place


class Stop:
    """A ramp of the speed to zero: Stop (Closed Loop) (6)."""

    def __init__(self, place_mm: float, speed_mm_per_s: float, fall_mm_per_s2: float) -> None:
        if not fall_mm_per_s2 > 0.0:
            raise RefusedError("the rate of a stop is to be above zero")
        self.done = speed_mm_per_s == 0.0
        self._place, self._speed, self._fall = place_mm, speed_mm_per_s, fall_mm_per_s2

    def step(self, dt_s: float) -> float:
        """Advance by a loop."""
        less = min(abs(self._speed), self._fall * dt_s)
        self._speed -= math.copysign(less, self._speed)
        self._place += self._speed * dt_s
        self.done = self._speed == 0.0
        return self._place


@dataclass
class Ramp:
    """A parameter on its way to a value: evenly per second or per cycle, or by equal ratios."""

    name: str
    goal: float
    kind: str
    amount: float
    start: float
    gone: float = 0.0

    def step(self, dt_s: float, cycles: float) -> tuple[float, bool]:
        """Give the value after a loop in which so many cycles went by, and whether it is there."""
        if self.kind == "rate":
            self.gone += dt_s * self.amount
            span = self.goal - self.start
            done = self.gone >= abs(span)
            return (self.goal if done else self.start + math.copysign(self.gone, span)), done
        self.gone += cycles if self.kind.startswith("cycles") else dt_s
        share = 1.0 if self.amount <= 0.0 else min(self.gone / self.amount, 1.0)
        if self.kind.endswith("log") and self.start > 0.0 and self.goal > 0.0:
            return self.start * (self.goal / self.start) ** share, share >= 1.0
        return self.start + share * (self.goal - self.start), share >= 1.0


@dataclass
class Sine:
    """Sine Start (72): offset, amplitude, frequency, cycles in quarters, start location (p. 777–779).

    Parameters
    ----------
    offset, amplitude, frequency, cycles : float
        mm, mm (half the range), Hz; 0 cycles repeat without an end.
    angle_deg : float
        Where it starts.
    """

    offset: float
    amplitude: float
    frequency: float
    cycles: float
    angle_deg: float
    done: bool = False
    gone: float = 0.0
    ramps: dict[str, Ramp] = field(default_factory=dict)
    _begins_mid: bool = field(init=False)

    def __post_init__(self) -> None:
        if self.amplitude < 0.0 or self.frequency < 0.0 or self.cycles < 0.0:
            raise RefusedError("amplitude, frequency and cycles are not below zero")
        if not float(self.cycles * 4.0).is_integer():
            raise RefusedError("cycles come in quarters")
        self._start_deg = self.angle_deg
        self._begins_mid = self.angle_deg in (0.0, 180.0)

    @property
    def angle(self) -> float:
        """Mathematical angle [°], from 0 up to but not including 360 (p. 779)."""
        return (self._start_deg + 360.0 * self.gone) % 360.0

    def _ends_mid(self) -> bool:
        end = (self._start_deg + 360.0 * self.cycles) % 360.0
        return self.cycles > 0.0 and min(end % 180.0, 180.0 - end % 180.0) < 1e-6

    def _frequency_now(self) -> float:
        """Give the frequency, ramped in a first or last quarter that touches the middle (p. 777)."""
        quarter = self.gone * 4.0
        if self._begins_mid and quarter < 1.0:
            # Growing with the square root of the angle, which is evenly in time.
            return self.frequency * max(math.sqrt(quarter), 0.02)
        left = (self.cycles - self.gone) * 4.0
        if self._ends_mid() and left < 1.0:
            return self.frequency * max(math.sqrt(max(left, 0.0)), 0.02)
        return self.frequency

    def ramped(self) -> bool:
        """Say whether it is in a first or last quarter, where a change of frequency is ignored (p. 784)."""
        return (self._begins_mid and self.gone < 0.25) or (
            self._ends_mid() and self.cycles - self.gone < 0.25
        )

    def step(self, dt_s: float) -> float:
        """Advance by a loop."""
        if not self.done:
            cycles = self._frequency_now() * dt_s
            for name, ramp in list(self.ramps.items()):
                value, there = ramp.step(dt_s, cycles)
                setattr(self, name, value)
                if there:
                    del self.ramps[name]
            self.gone += cycles
            if 0.0 < self.cycles <= self.gone + 1e-9:
                self.gone, self.done = self.cycles, True
        return self.offset + self.amplitude * math.sin(math.radians(self._start_deg + 360.0 * self.gone))

    def change(self, name: str, value: float, kind: str, amount: float) -> None:
        """Change Target Parameter (80) (p. 784)."""
        if name == "cycles":
            self.cycles = max(value, self._next_end(value))
            return
        if name == "frequency" and self.ramped():
            return
        if name in ("frequency", "amplitude") and value < 0.0:
            raise RefusedError(f"a {name} below zero")
        self.ramps[name] = Ramp(name, value, kind, amount, start=getattr(self, name))

    def _next_end(self, value: float) -> float:
        """Give the first count that is not behind us and ends where `value` would (p. 836)."""
        return value if value >= self.gone else value + math.ceil(self.gone - value)

    def stop_at(self, location: int) -> None:
        """Sine Stop (73): next cycle, middle, positive or negative peak, next peak (p. 833)."""
        if location == 0:
            self.cycles = max(math.ceil(self.gone - 1e-9), 1)
            return
        angles = {1: (0.0, 180.0), 2: (90.0,), 3: (270.0,), 4: (90.0, 270.0)}.get(location)
        if angles is None:
            raise RefusedError(f"stop location {location}")
        quarter = math.ceil(self.gone * 4.0 - 1e-9)
        while (self._start_deg + 90.0 * quarter) % 360.0 not in angles:
            quarter += 1
        if location == 1 and quarter / 4.0 - self.gone < 0.25:
            quarter += 2  # on the way back to the middle: half a cycle more (p. 833)
        self.cycles = quarter / 4.0

    def status(self) -> tuple[float, ...]:
        """Give the six registers of the status block (p. 779)."""
        whole = math.floor(self.gone + 1e-9)
        count = whole if self.cycles > 0.0 else whole % WRAP
        return (
            float(count),
            self.gone - whole,
            self.angle,
            self.amplitude,
            self._frequency_now(),
            self.offset,
        )
