"""A clock that the test moves."""

from __future__ import annotations


class HandClock:
    def __init__(self) -> None:
        self.stand_s = 0.0
        self.real_s = 0.0

    def now_s(self) -> float:
        return self.stand_s

    def wall_s(self) -> float:
        return self.real_s

    def sleep(self, duration_s: float) -> None:
        self.advance(duration_s)

    def advance(self, duration_s: float) -> None:
        self.stand_s += duration_s
        self.real_s += duration_s
