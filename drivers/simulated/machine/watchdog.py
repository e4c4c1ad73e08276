"""The controller's watchdog: without a heartbeat in time it has the stand fall back to zero force."""

from __future__ import annotations

from collections.abc import Callable


class Watchdog:
    """Counts the wall time since the last feed, as far as the device was alive to be fed.

    Parameters
    ----------
    wall_s : callable
        Monotonic wall time [s].
    credit_s : float
        Longest time that counts between two looks: while the device itself is not served by its computer,
        nobody could have fed it.
    """

    def __init__(self, wall_s: Callable[[], float], credit_s: float = 0.25) -> None:
        self._wall_s = wall_s
        self._credit_s = credit_s
        self._last_look_s = wall_s()
        self._remaining_s = 0.0
        self._last_value: int | None = None
        self.time_ms = 0
        self.trips = 0

    def set_time(self, time_ms: int) -> None:
        """Set the time after which it trips [ms]; 0 switches it off."""
        self.time_ms = time_ms
        self.restart()

    def restart(self) -> None:
        """Begin a full period."""
        self._last_look_s = self._wall_s()
        self._remaining_s = self.time_ms / 1000.0

    def feed(self, value: int) -> None:
        """Take a heartbeat: any changed value."""
        if value != self._last_value:
            self._last_value = value
            self.restart()

    def expire(self) -> None:
        """Let the time be over, whoever fed it (a simulated fault)."""
        self._remaining_s = 0.0

    def look(self) -> bool:
        """Let the time since the last look count; return whether it has run out."""
        now = self._wall_s()
        self._remaining_s -= min(self._credit_s, now - self._last_look_s)
        self._last_look_s = now
        return self.time_ms > 0 and self._remaining_s <= 0.0

    @property
    def remaining_ms(self) -> int:
        """Wall time left [ms], 0 where it is off."""
        return max(0, min(self.time_ms, round(self._remaining_s * 1000.0))) if self.time_ms else 0
