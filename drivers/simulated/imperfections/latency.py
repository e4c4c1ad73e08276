"""The time that requests and replies are on their way between a computer and a simulated controller.

A round trip is ``latency + e1 + e2``: a floor that wire and controller always take, and on each way an
exponential excess of half the jitter in the mean, as switches and operating systems add it. It counts in
stand time, as everything that belongs to the stand's world.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from random import Random

LEAST_WAIT_S = 5e-5
"""Less than this a computer does not wait well [s of the wall]: such a way takes no time."""


class Latency:
    """Draws how long ways take.

    Parameters
    ----------
    latency_s : float
        Least round trip [s].
    jitter_s : float
        Mean of what comes on top [s].
    seed : int
    """

    def __init__(self, latency_s: float, jitter_s: float, seed: int) -> None:
        self._least_s = 0.5 * latency_s
        self._more_s = 0.5 * jitter_s
        self._random = Random(f"latency {seed}")

    def way_s(self) -> float:
        """Return how long the next request or reply is on its way [s of stand time]."""
        if self._more_s == 0.0:
            return self._least_s
        return self._least_s + self._random.expovariate(1.0 / self._more_s)


class DelayedConnection:
    """One direction of a connection in a running event loop: everything arrives later, in its order.

    Parameters
    ----------
    way_s : callable
        Gives the time that the next thing is on its way [s of the wall].
    """

    def __init__(self, way_s: Callable[[], float]) -> None:
        self._way_s = way_s
        self._last_s = 0.0
        self._under_way = 0

    def send(self, arrive: Callable[[], object]) -> None:
        """Call ``arrive`` when it has arrived; at once where ways take no time and nothing is before it."""
        way_s = self._way_s()
        if way_s < LEAST_WAIT_S and not self._under_way:
            arrive()
            return
        loop = asyncio.get_running_loop()
        # No two at one instant: a heap of timers does not keep the order of such.
        self._last_s = max(math.nextafter(self._last_s, math.inf), loop.time() + way_s)
        self._under_way += 1
        loop.call_at(self._last_s, self._arrived, arrive)

    def _arrived(self, arrive: Callable[[], object]) -> None:
        self._under_way -= 1
        arrive()
