"""Virtual time: it passes only while the program waits for it."""

from __future__ import annotations

from collections.abc import Callable

CLOCK_SLICE_S = 0.05
"""Longest stretch that the virtual clock passes at once [s]; the watchdog looks at least as often."""


class VirtualClock:
    """A clock that passes only while somebody waits, and moves the stand as it does.

    Wall time is the same time, so that silence too is judged alike in every repetition.
    """

    def __init__(self) -> None:
        self._now_s = 0.0
        self._listeners: list[Callable[[float], object]] = []

    def listen(self, listener: Callable[[float], object]) -> None:
        """Call ``listener`` with the stand time [s] whenever it has moved."""
        self._listeners.append(listener)

    def now_s(self) -> float:
        """Get the present stand time [s]."""
        return self._now_s

    def sleep(self, duration_s: float) -> None:
        """Let ``duration_s`` of stand time pass."""
        end_s = self._now_s + max(0.0, duration_s)
        while self._now_s < end_s:
            self._now_s = min(end_s, self._now_s + CLOCK_SLICE_S)
            for listener in self._listeners:
                listener(self._now_s)

    def wall_s(self) -> float:
        """Get the present stand time [s]: here it is the wall's."""
        return self._now_s
