"""Virtual time: it passes only while the program waits for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from bufferstand.foundation import Clock

CLOCK_SLICE_S = 0.05
"""Longest stretch that the virtual clock passes at once [s]; the watchdog looks at least as often."""
_SOON_S = 1e-9

_Result = TypeVar("_Result")


class VirtualClock:
    """A clock that passes only while somebody waits, and moves the stand as it does.

    Wall time is the same time, so that silence too is judged alike in every repetition. While the program
    waits, a controller without a ring is polled when a poll is due.
    """

    def __init__(self) -> None:
        self._now_s = 0.0
        self._listeners: list[Callable[[float], object]] = []
        self._buses: list[VirtualBus] = []

    def listen(self, listener: Callable[[float], object]) -> None:
        """Call ``listener`` with the stand time [s] whenever it has moved."""
        self._listeners.append(listener)

    def bus(self, poll: Callable[[int], None], period_s: float, _: Clock) -> VirtualBus:
        """Return a bus that polls while this clock is waited for."""
        bus = VirtualBus(poll, period_s, self)
        self._buses.append(bus)
        return bus

    def now_s(self) -> float:
        """Get the present stand time [s]."""
        return self._now_s

    def sleep(self, duration_s: float) -> None:
        """Let ``duration_s`` of stand time pass; longer, if a poll is under way at its end."""
        end_s = self._now_s + max(0.0, duration_s)
        while self._now_s < end_s:
            due_s = min((bus.due_s for bus in self._buses), default=end_s)
            self._pass_to(min(end_s, max(due_s, self._now_s + _SOON_S)))
            for bus in self._buses:
                bus.poll_if_due()

    def advance(self, duration_s: float) -> None:
        """Let time pass in which nobody polls: requests are on their way."""
        self._pass_to(self._now_s + max(0.0, duration_s))

    def _pass_to(self, end_s: float) -> None:
        while self._now_s < end_s:
            self._now_s = min(end_s, self._now_s + CLOCK_SLICE_S)
            for listener in self._listeners:
                listener(self._now_s)

    def pass_by(self, duration_s: float) -> None:
        """Let a little time pass that the stand makes up later: a reply is on its way back."""
        self._now_s += max(0.0, duration_s)

    def wall_s(self) -> float:
        """Get the present stand time [s]: here it is the wall's."""
        return self._now_s


class VirtualBus:
    """Polls and jobs of one bus, all by whoever waits: it has no thread of its own.

    What is asked of the bus is done between two polls, as the thread of
    :mod:`bufferstand.drivers.controllers.bus_thread` does it.

    Parameters
    ----------
    poll : callable
        Makes one poll for a slot, by its number.
    period_s : float
        Time between two slots [s].
    clock : VirtualClock
    """

    def __init__(self, poll: Callable[[int], None], period_s: float, clock: VirtualClock) -> None:
        self._poll, self._period_s, self._clock = poll, period_s, clock
        self._origin_s: float | None = None
        self._slot = 0

    @property
    def due_s(self) -> float:
        """When the next poll is due [s of stand time]."""
        return float("inf") if self._origin_s is None else self._origin_s + self._slot * self._period_s

    def call(self, job: Callable[[], _Result]) -> _Result:
        """Do a job, and the poll that has become due meanwhile."""
        result = job()
        self.poll_if_due()
        return result

    def begin(self) -> None:
        """Poll from now on: slot 0 is due at once."""
        if self._origin_s is None:
            self._origin_s = self._clock.now_s()

    def poll_if_due(self) -> None:
        """Make the newest poll that is due; those before it that nobody had time for are left out."""
        if self._origin_s is None:
            return
        due = int((self._clock.now_s() - self._origin_s) / self._period_s + _SOON_S)
        if due >= self._slot:
            self._slot = due + 1
            self._poll(due)

    def close(self) -> None:
        """Poll no longer."""
        self._origin_s = None
