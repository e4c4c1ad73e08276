"""The wait for what a killed program has left: its countdown only counts down."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import pytest

from bufferstand.daq.stand.in_use import FREE_S, LIVES_S, RELEASE_MM_PER_S, RELEASE_MORE_S, await_free
from bufferstand.drivers.interfaces import ControllerStatus, EndReason, MotionState, WriterSeen
from tests.daq.fake_stand import FakeClock

WATCHDOG_S = 2.0
HELD = ControllerStatus(MotionState.HOLDING, 0, 0, EndReason.NONE, 0, 0, 0, 40.0, 30.0, 30.0, 30.0)


class Left:
    """A controller whose program was killed: its watchdog runs out, it unloads, and drops the lock."""

    def __init__(self, clock: Any) -> None:
        self._clock = clock
        self._began_s = clock.wall_s()

    @property
    def _gone_s(self) -> float:
        return float(self._clock.wall_s() - self._began_s)

    def seen_writer(self) -> WriterSeen:
        if self._gone_s >= FREE_S:
            return WriterSeen(0)
        return WriterSeen(4711, "another", None, 7, WATCHDOG_S, max(0.0, WATCHDOG_S - self._gone_s))

    def status(self) -> ControllerStatus:
        if self._gone_s < WATCHDOG_S:
            return HELD
        unloaded_s = WATCHDOG_S + HELD.position_mm / RELEASE_MM_PER_S + RELEASE_MORE_S
        if self._gone_s < unloaded_s:
            return replace(HELD, state=MotionState.RELEASING, fault_code=1)
        return replace(HELD, state=MotionState.OFF, force_kN=0.0, position_mm=0.0)


def test_the_countdown_never_rises_and_ends_with_the_wait() -> None:
    clock = FakeClock()
    shown: list[tuple[float, float]] = []
    said: list[str] = []
    trouble = await_free(
        cast(Any, Left(clock)),
        clock,
        5.0,
        interrupted=lambda: False,
        say=said.append,
        show=lambda _, left_s: shown.append((clock.wall_s(), left_s)),
    )
    assert trouble == ""
    left = [left_s for _, left_s in shown]
    assert left == sorted(left, reverse=True)
    assert left[0] == pytest.approx(FREE_S, abs=2.0)
    assert left[-1] < LIVES_S + 1.0, "so long it was seen whether that program lives"
    assert said[-1].endswith("going on")
