"""Reading all that was sampled before now: as long as it takes while samples come, and no longer."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from bufferstand.daq.acquisition.catching_up import CATCH_UP_S, catch_up
from bufferstand.daq.acquisition.loop import Acquisition
from tests.daq.fake_stand import FakeClock

PASS_S = 0.5


class Reader:
    """An acquisition that is behind: each pass takes ``PASS_S`` and reads so much of the device's time."""

    def __init__(self, behind_s: float, reads_s: float, until_s: float = float("inf")) -> None:
        self.clock = FakeClock()
        self.passes = 0
        self.continuity = SimpleNamespace(is_cut_off=False)
        self.device_now_us = round(behind_s * 1e6)
        self.latest = SimpleNamespace(device_s=0.0)
        self._reads_s, self._until_s = reads_s, until_s

    def renew_status(self) -> None:
        assert self.passes == 0, "the status is asked for before the first pass"

    def tick(self) -> None:
        self.passes += 1
        self.clock.sleep(PASS_S)
        self.latest.device_s = min(self.latest.device_s + self._reads_s, self._until_s)

    def has_read_to(self, device_us: int) -> bool:
        return bool(self.latest.device_s * 1e6 >= device_us)


def caught_up(reader: Reader, trips_after: float = float("inf")) -> bool:
    return catch_up(cast(Acquisition, reader), reader.tick, lambda: reader.passes >= trips_after)


def test_it_ends_when_all_is_read_that_was_sampled_before() -> None:
    reader = Reader(behind_s=1.0, reads_s=0.25)
    assert caught_up(reader)
    assert reader.passes == 4


def test_a_slow_reader_has_the_time_that_it_needs() -> None:
    reader = Reader(behind_s=10.0, reads_s=0.01)
    assert caught_up(reader)
    assert reader.clock.wall_s() > 10 * CATCH_UP_S


@pytest.mark.parametrize("until_s", [0.0, 0.5])
def test_one_that_reads_nothing_more_is_told(until_s: float) -> None:
    reader = Reader(behind_s=1.0, reads_s=0.1, until_s=until_s)
    assert not caught_up(reader)
    assert reader.clock.wall_s() == pytest.approx(CATCH_UP_S + until_s / 0.1 * PASS_S, abs=2 * PASS_S)


def test_a_trip_ends_it() -> None:
    reader = Reader(behind_s=10.0, reads_s=0.01)
    assert caught_up(reader, trips_after=3)
    assert reader.passes == 3
