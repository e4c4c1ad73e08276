"""The controller's single-writer lock: who may give commands."""

from __future__ import annotations

from collections.abc import Callable

HELD_S = 10.0
"""Wall time after the last heartbeat or claim at which the lock falls free [s]."""


class SingleWriterLock:
    """Register ``writer``: a number that nobody else can replace while it is held.

    Parameters
    ----------
    wall_s : callable
        Monotonic wall time [s].
    """

    def __init__(self, wall_s: Callable[[], float]) -> None:
        self._wall_s = wall_s
        self._number = 0
        self._alive_s = 0.0

    @property
    def number(self) -> int:
        """Who holds it, 0 for nobody."""
        if self._number and self._wall_s() - self._alive_s > HELD_S:
            self._number = 0
        return self._number

    def write(self, number: int) -> bool:
        """Take, keep or give back the lock; return whether that may be."""
        holder = self.number
        if number not in (0, holder) and holder:
            return False
        self._number = number
        self._alive_s = self._wall_s()
        return True

    def keep(self) -> None:
        """Take a sign of life of the holder: the watchdog was fed. A lock that fell free stays free."""
        if self.number:
            self._alive_s = self._wall_s()
