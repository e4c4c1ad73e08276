"""A fast stand waits for whoever reads it; one at the wall's speed does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.profile import load_profile
from drivers.simulated.pace import AHEAD, READING_S, Pace
from drivers.simulated.register_bank import RegisterBank
from drivers.simulated.ring import SampleRing
from drivers.simulated.server import CATCH_UP, Options, StandServer
from tests.drivers.simulated.standing import device, stand_file

PERIOD_S = 0.001
RING = load_profile("ring")
MODEL = Path(__file__).parents[3] / "sample_runs/models/category-a-elastomer.toml"


class FastHandClock:
    """A clock moved by hand, whose stand time is ``speed`` times the wall's."""

    def __init__(self, speed: float) -> None:
        self.speed = speed
        self.wall = 0.0

    def now_s(self) -> float:
        return self.wall * self.speed

    def wall_s(self) -> float:
        return self.wall

    def sleep(self, duration_s: float) -> None:
        self.wall += duration_s / self.speed


class Stand:
    """A ring that is filled as far as the pace allows."""

    def __init__(self, speed: float) -> None:
        self.clock = FastHandClock(speed)
        self.ring = SampleRing()
        self.pace = Pace(self.clock, speed, self.ring, PERIOD_S)

    def pass_wall(self, wall_s: float) -> int:
        """Let wall time pass; return how many samples have been made."""
        self.clock.wall += wall_s
        before = self.ring.total
        self.ring.total = int(self.pace.now_s() / PERIOD_S + 1e-6)
        return self.ring.total - before

    def acknowledge(self, sequence: int) -> None:
        self.ring.acknowledge(sequence % 2**32)


def test_at_the_walls_speed_nothing_waits() -> None:
    stand = Stand(1.0)
    for _ in range(50):
        stand.acknowledge(0)
        assert stand.pass_wall(1.9) == pytest.approx(1900, abs=1)
    assert stand.ring.total == 95_000  # and the reader at 0 has lost samples, as with a real device


def test_unread_a_fast_stand_does_not_wait() -> None:
    stand = Stand(10.0)
    for _ in range(20):
        stand.pass_wall(1.0)
    assert stand.ring.total == 200_000


def test_a_fast_stand_waits_for_its_reader_and_goes_on_from_where_it_is() -> None:
    stand = Stand(10.0)
    stand.acknowledge(0)
    for _ in range(10):
        stand.pass_wall(1.0)
        stand.acknowledge(0)  # it asks for the same again and again
    assert stand.ring.total == AHEAD
    stand.acknowledge(1500)
    assert stand.pass_wall(0.001) == 10  # at its speed: the seconds that it waited are not made up in a burst
    assert stand.pass_wall(0.05) == 500
    assert stand.pass_wall(1.0) == 1500 - 510
    stand.acknowledge(stand.ring.total)
    assert stand.pass_wall(0.5) == 5000


def test_a_reader_that_has_gone_is_not_waited_for() -> None:
    stand = Stand(10.0)
    stand.acknowledge(0)
    stand.pass_wall(0.1)
    while stand.ring.total < AHEAD:
        stand.pass_wall(0.1)
        stand.acknowledge(0)
    stand.pass_wall(0.1)
    assert stand.pass_wall(READING_S - 0.2) == 0
    stand.pass_wall(0.2)
    assert stand.pass_wall(1.0) == 10_000


def test_a_reader_who_begins_far_behind_gains_on_a_stand_that_still_counts() -> None:
    """It finds a full ring: the stand must not stand still until all that is read, nor run away."""
    stand = Stand(10.0)
    stand.pass_wall(20.0)
    stand.acknowledge(0)  # as the driver begins; the answer says where the ring begins
    at = stand.ring.oldest
    lags = []
    while stand.ring.total - at > AHEAD:
        stand.pass_wall(0.01)
        at += 15
        stand.acknowledge(at)
        made = stand.pass_wall(0.01)
        assert 0 <= made <= 15 // 2 + 1
        assert at >= stand.ring.oldest
        lags.append(stand.ring.total - at)
    assert np.all(np.diff(lags) < 0)
    assert stand.ring.total > 215_000


def test_a_second_reader_from_the_beginning_does_not_stop_the_stand_for_good() -> None:
    stand = Stand(10.0)
    stand.acknowledge(0)
    for _ in range(30):
        stand.pass_wall(1.0)
        stand.acknowledge(stand.ring.total)
    stand.acknowledge(0)
    at = stand.ring.oldest
    assert stand.pass_wall(0.1) == 0  # … but waits for the new one
    made = 0
    for _ in range(20):
        at += 15
        stand.acknowledge(at)
        made += stand.pass_wall(0.1)
    assert made == 20 * (15 // 2)
    assert at >= stand.ring.oldest


@given(
    steps=st.lists(st.tuples(st.floats(0.0, 3.0), st.integers(0, 3000), st.booleans()), max_size=60),
    speed=st.sampled_from([1.0, 1.5, 10.0, 50.0]),
)
def test_time_never_steps_back_nor_runs_faster_than_the_clock(
    steps: list[tuple[float, int, bool]], speed: float
) -> None:
    stand = Stand(speed)
    for wall_s, read, reads in steps:
        if reads:
            stand.acknowledge(min(stand.ring.total, max(stand.ring.acknowledged, stand.ring.oldest) + read))
        made = stand.pass_wall(wall_s)
        assert 0 <= made <= wall_s * speed / PERIOD_S + 1.001


def test_acknowledgements_reach_the_ring_through_the_register(tmp_path: Path) -> None:
    stand = device(tmp_path)
    stand.ring.total = 2**32 + 5000
    RegisterBank(stand, RING).write(256, RING.encode("ring_acknowledge", 4000))
    assert (stand.ring.acknowledged, stand.ring.acknowledgements) == (2**32 + 4000, 1)


def served(folder: Path, speed: float) -> tuple[StandServer, FastHandClock]:
    clock = FastHandClock(speed)
    return StandServer(stand_file(folder), Options(model=MODEL, speed=speed), clock), clock


def test_a_starved_stand_makes_up_little_with_each_request(tmp_path: Path) -> None:
    server, clock = served(tmp_path, 10.0)
    clock.wall = 1.0
    for number, acting in enumerate((True, False, True), start=1):
        assert server.catch_up(acting) == 10_000 - number * CATCH_UP
        assert server.device.ring.total == number * CATCH_UP
    while server.catch_up():
        pass
    assert server.device.ring.total == 10_000  # and drops none
    clock.wall += 0.001
    assert server.catch_up(False) == 0
    assert server.device.ring.total == 10_000  # fresh enough for a reader …
    server.catch_up(True)
    assert server.device.ring.total == 10_010  # … not for a command


def test_a_fast_stand_loses_nothing_to_a_slow_reader(tmp_path: Path) -> None:
    """As the wire does it: each window a second of wall time late, at ten times the speed."""
    server, clock = served(tmp_path, 10.0)
    bank = RegisterBank(server.device, RING)
    at = 0
    for _ in range(12):
        clock.wall += 1.0
        bank.write(256, RING.encode("ring_acknowledge", at))
        while server.catch_up():
            pass
        header = RING.ring_header.decode(bank.read(260, 121)[:9])
        assert (header["first_sequence"], header["overruns"]) == (at, 0)
        at += int(header["count"])
    assert server.device.ring.total <= at + AHEAD
    assert at == 12 * 14
