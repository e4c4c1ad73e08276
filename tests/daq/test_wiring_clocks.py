"""A computer too busy to read the controller's ring in time makes no delay of the force."""

from __future__ import annotations

import pytest

from bufferstand.daq.guards.wiring.clock_offset import KEPT_S, ClockOffset
from tests.daq.wiring_bench import Case, judge, late, signals_of


@pytest.mark.parametrize("by_s", [0.3, 0.7, 1.2])
def test_blocks_that_are_all_read_late_for_seconds_are_no_late_force(by_s: float) -> None:
    case = Case(sines=((30.0, 15.0, 1.0, 12),), static_mm=40.0, read_late=(22.0, 30.0, by_s))
    assert judge(signals_of(case)).trip is None


def test_a_force_that_is_late_is_told_beside_it() -> None:
    case = Case(sines=((30.0, 15.0, 1.0, 12),), static_mm=40.0, read_late=(22.0, 30.0, 0.7))
    trip = judge(late("force", by_s=0.3)(signals_of(case))).trip
    assert trip is not None
    assert (trip.sensor, trip.doubt) == ("force", "delay"), trip.reason


def test_the_quickest_block_counts_as_long_as_it_is_kept() -> None:
    clock = ClockOffset()
    assert clock.value_s == 0.0
    assert clock.take(100.010, 0.0) == pytest.approx(100.010)
    assert clock.take(101.002, 1.0) == pytest.approx(100.002)
    assert clock.take(102.700, 2.0) == pytest.approx(100.002)
    at_s = 102.7 + KEPT_S
    assert clock.take(at_s, at_s - 100.050) == pytest.approx(100.050), "its quickest is forgotten by now"
