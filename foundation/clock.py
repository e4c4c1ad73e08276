"""Time as the acquisition sees it: the wall, the wall run faster for a simulated stand, or virtual time."""

from __future__ import annotations

import time
from typing import Protocol

MISSED_CYCLES_MAX_PER_MIN = 60
"""So many cycles a controller may miss in a minute where a campaign states nothing else: 0.1 % of 1 kHz."""

DELAYS_TO_SPEED = 2.0
"""Delays of signals are judged of stands that run no more than so many times as fast as the wall, by which an
amplifier's samples are stamped."""

_STEADY = getattr(time, "CLOCK_BOOTTIME", getattr(time, "CLOCK_MONOTONIC", None))


def steady_s() -> float:
    """Return a time of the wall that nobody sets, and that goes on while the computer is suspended [s].

    A controller's watchdog and its writer's lock count on meanwhile. Python's ``time.monotonic`` stands
    still on a suspended Linux or macOS.
    """
    return time.monotonic() if _STEADY is None else time.clock_gettime(_STEADY)


class Clock(Protocol):
    """Monotonic stand time in seconds; one second of it is one second of the specimen's life."""

    def now_s(self) -> float:
        """Get the present stand time [s]; it never steps back."""
        ...

    def sleep(self, duration_s: float) -> None:
        """Wait for ``duration_s`` of stand time."""
        ...

    def wall_s(self) -> float:
        """Get a monotonic time [s] by which silence is judged: real seconds, however fast the stand runs."""
        ...


class WallClock:
    """Stand time that runs ``speed`` times as fast as the wall (1 for a real stand)."""

    def __init__(self, speed: float = 1.0) -> None:
        if not speed > 0.0:
            raise ValueError(f"speed must be positive, got {speed}")
        self.speed = speed
        self._origin_s = steady_s()

    def now_s(self) -> float:
        """Get the present stand time [s] since the clock was made."""
        return (steady_s() - self._origin_s) * self.speed

    def sleep(self, duration_s: float) -> None:
        """Wait for ``duration_s`` of stand time."""
        time.sleep(max(0.0, duration_s) / self.speed)

    def wall_s(self) -> float:
        """Get real seconds since the clock was made."""
        return steady_s() - self._origin_s
