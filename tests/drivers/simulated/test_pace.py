"""A stand that waits does so for whoever reads it, at every speed; one as a real device waits for nobody."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.register_maps.profile import load_profile
from bufferstand.drivers.simulated.machine.ring import SampleRing
from bufferstand.drivers.simulated.serving.server import CATCH_UP, ServerOptions, StandServer
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.drivers.simulated.wires.pace import AHEAD, PATIENCE_S, READING_S, StandPace
from tests.drivers.simulated.standing import device, stand_file

PERIOD_S = 0.001
BLOCK = 14
LOOK_S = 0.005
RING = load_profile("ring")
POLLING = load_profile("polling")
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


class Client:
    """A connection that can be closed."""

    is_open = True


class Stand:
    """A ring that is filled as far as the pace allows."""

    def __init__(self, speed: float, *, waits: bool = True) -> None:
        self.clock = FastHandClock(speed)
        self.ring = SampleRing()
        self.client: Client | None = None
        self.at = 0
        self.pace = StandPace(self.clock, speed, waits=waits)
        self.pace.watch(self.ring, PERIOD_S, BLOCK, lambda: self.client)

    def look(self, wall_s: float) -> int:
        """Let wall time pass, look once, and return how many samples have been made."""
        self.clock.wall += wall_s
        before = self.ring.total
        self.ring.total = int(self.pace.now_s() / PERIOD_S + 1e-6)
        return self.ring.total - before

    def live(self, wall_s: float) -> int:
        """Let wall time pass with a look every 5 ms of it, as a server does that is not starved."""
        return sum(self.look(LOOK_S) for _ in range(round(wall_s / LOOK_S)))

    def acknowledge(self, sequence: int) -> None:
        self.ring.acknowledge(sequence % 2**32)

    def read(self) -> int:
        """Acknowledge what was read and read the next block, as one request does; return its samples."""
        self.acknowledge(self.at)
        count = min(BLOCK, self.ring.total - self.at)
        self.at += count
        return count


@pytest.mark.parametrize("waits", [False, True])
def test_unread_it_runs_by_the_clock(waits: bool) -> None:
    for speed in (1.0, 10.0):
        stand = Stand(speed, waits=waits)
        assert stand.live(5.0) == pytest.approx(5000 * speed, abs=1)


def test_one_that_does_not_wait_loses_what_is_not_read() -> None:
    stand = Stand(1.0, waits=False)
    for _ in range(50):
        stand.acknowledge(0)
        assert stand.look(1.9) == pytest.approx(1900, abs=1)
    assert stand.ring.total == 95_000  # the reader at 0 has lost samples, as with a real device


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0, 100.0])
def test_it_waits_for_its_reader_and_goes_on_from_where_it_is(speed: float) -> None:
    stand = Stand(speed)
    stand.acknowledge(0)
    stand.live(1.0)
    for _ in range(10):
        stand.live(1.0)
        stand.acknowledge(0)  # it asks for the same again and again
    assert stand.ring.total == AHEAD
    stand.acknowledge(AHEAD)  # it has seen all that there is
    assert stand.look(10 * PERIOD_S / speed) == 10  # the seconds that it waited are not made up in a burst
    stand.live(1.5)
    assert stand.ring.total == 2 * AHEAD


def test_whatever_the_speed_the_reader_comes_to_the_end_again_and_again() -> None:
    """Else a loop that reads until nothing is left would never come out, and guards see the past."""
    stand = Stand(1000.0)
    stand.acknowledge(0)
    short = 0
    for _ in range(20_000):
        stand.look(0.001)  # as many as it may, between any two requests
        short += stand.read() < BLOCK
        assert stand.ring.total - stand.ring.acknowledged <= 2 * AHEAD
    assert short > 400
    assert stand.ring.total > 150_000


def test_a_starved_stand_is_never_far_behind_its_own_time() -> None:
    stand = Stand(10.0)
    stand.live(1.0)
    assert stand.look(60.0) == AHEAD  # what it could not make is no debt
    assert stand.live(1.0) == 10_000


def test_its_watchdog_counts_what_it_has_lived() -> None:
    stand = Stand(10.0)
    stand.client = Client()
    stand.acknowledge(0)
    stand.live(10.0)
    assert stand.pace.lived_s() == pytest.approx(AHEAD * PERIOD_S / 10.0)
    real = Stand(1.0, waits=False)
    real.live(10.0)
    assert real.pace.lived_s() == pytest.approx(10.0)


def gone_after(stand: Stand) -> float:
    """Return after how long [s of the wall] the stand goes on without its reader."""
    stand.acknowledge(0)
    stand.live(1.0)
    began = stand.clock.wall
    while not stand.look(LOOK_S):
        pass
    return stand.clock.wall - began


def test_a_reader_that_has_gone_is_not_waited_for_one_that_is_starved_is() -> None:
    none, open_, closed = Stand(10.0), Stand(10.0), Stand(10.0)
    open_.client, closed.client = Client(), Client()
    closed.acknowledge(0)
    closed.live(1.0)
    assert closed.client is not None
    closed.client.is_open = False
    assert gone_after(none) == pytest.approx(READING_S - 1.0, abs=0.02)
    assert gone_after(closed) == pytest.approx(READING_S - 1.0, abs=0.02)
    assert gone_after(open_) == pytest.approx(PATIENCE_S - 1.0, abs=0.02)


def test_while_the_stand_is_starved_its_reader_is_not_taken_for_gone() -> None:
    stand = Stand(10.0)
    stand.acknowledge(0)
    stand.live(0.5)
    for _ in range(5):
        assert stand.look(60.0) == 0


def test_a_reader_who_begins_far_behind_gains_on_a_stand_that_still_counts() -> None:
    """It finds a full ring: the stand must not stand still until all that is read, nor run away."""
    stand = Stand(10.0)
    stand.live(20.0)
    stand.acknowledge(0)  # as the driver begins; the answer says where the ring begins
    at = stand.ring.oldest
    lags = []
    while stand.ring.total - at > AHEAD:
        stand.look(0.01)
        at += 15
        stand.acknowledge(at)
        made = stand.look(0.01)
        assert 0 <= made <= 15 // 2 + 1
        assert at >= stand.ring.oldest
        lags.append(stand.ring.total - at)
    assert np.all(np.diff(lags) < 0)
    assert stand.ring.total > 215_000


def test_a_reader_who_skips_a_full_ring_has_not_read_it() -> None:
    """Else the stand may run on by half a ring, half a minute, while the reader's sensors start."""
    stand = Stand(10.0)
    stand.client = Client()
    stand.live(20.0)
    stand.acknowledge(0)
    stand.live(0.02)
    stand.at = stand.ring.total - 200  # as a driver goes on near the newest sample
    stand.read()
    stand.live(5.0)  # it starts its sensors
    assert stand.ring.total - stand.at <= 200 + BLOCK
    ages = []
    for _ in range(200):
        stand.look(0.05)  # a starved reader: a block in 50 ms is far less than ten times real time
        stand.read()
        ages.append(stand.ring.total - stand.at)
    assert max(ages) <= 2 * AHEAD
    assert min(ages) < BLOCK, "and it comes to the end"


def test_a_second_reader_from_the_beginning_does_not_stop_the_stand_for_good() -> None:
    stand = Stand(10.0)
    stand.acknowledge(0)
    for _ in range(30):
        stand.live(1.0)
        stand.acknowledge(stand.ring.total)
    stand.acknowledge(0)
    at = stand.ring.oldest
    assert stand.look(0.1) == 0  # … but waits for the new one
    made = 0
    for _ in range(20):
        at += 15
        stand.acknowledge(at)
        made += stand.look(0.1)
    assert made == 20 * (15 // 2)
    assert at >= stand.ring.oldest


@given(
    steps=st.lists(st.tuples(st.floats(0.0, 3.0), st.integers(0, 3000), st.booleans()), max_size=60),
    speed=st.sampled_from([0.5, 1.0, 1.5, 10.0, 50.0]),
    waits=st.booleans(),
)
def test_time_never_steps_back_nor_runs_faster_than_the_clock(
    steps: list[tuple[float, int, bool]], speed: float, waits: bool
) -> None:
    stand = Stand(speed, waits=waits)
    for wall_s, read, reads in steps:
        if reads:
            stand.acknowledge(min(stand.ring.total, max(stand.ring.acknowledged, stand.ring.oldest) + read))
        made = stand.look(wall_s)
        assert 0 <= made <= wall_s * speed / PERIOD_S + 1.001
        assert stand.pace.lived_s() <= stand.clock.wall + 1e-9


class Polled(Stand):
    """A stand whose reader polls it a hundred times a second, in two requests each."""

    def __init__(self, speed: float, trip_s: float = 0.0) -> None:
        super().__init__(speed)
        self.pace.expect_polls(0.01, lambda: trip_s)
        self.stamps: list[tuple[float, float]] = []

    def poll(self, between_s: float = 2e-4) -> None:
        """Make one poll, ``between_s`` of the wall between its two requests and behind it."""
        parts = []
        for whole in (False, True):
            self.look(0.0)
            parts.append(self.pace.now_s())
            self.ring.poll(whole=whole)
            self.live_fine(between_s)
        self.stamps.append((parts[0], parts[1]))

    def live_fine(self, wall_s: float) -> None:
        for _ in range(4):
            self.look(wall_s / 4)


@pytest.mark.parametrize("speed", [1.0, 6.0, 100.0])
@pytest.mark.parametrize("late_s", [0.0, 0.5])
def test_it_waits_for_one_who_polls_it_so_that_no_poll_is_left_out(speed: float, late_s: float) -> None:
    """The poller is asleep for half a second of the wall between any two polls, or never."""
    stand = Polled(speed)
    stand.poll()
    slot = 0
    for _ in range(50):
        stand.live(late_s)
        for _ in range(2000):  # it wakes when the next one is due, by the stand's own time
            if stand.pace.now_s() >= (slot + 1) * 0.01:
                break
            stand.look(1e-4)
        due = int(stand.pace.now_s() / 0.01 + 1e-9)
        assert 1 <= due - slot <= 5
        slot = due
        stand.poll()
    assert stand.ring.total >= 500


@pytest.mark.parametrize("speed", [1.0, 100.0])
@pytest.mark.parametrize("trip_s", [0.0, 4e-4])
def test_within_a_poll_time_goes_on_by_a_round_trip_of_the_stands_world(speed: float, trip_s: float) -> None:
    stand = Polled(speed, trip_s)
    for _ in range(20):
        stand.poll(between_s=0.003)
        stand.live(0.05)
    apart = [second - first for first, second in stand.stamps]
    assert max(apart) == pytest.approx(trip_s, abs=1e-9)
    assert min(apart) >= 0.0


def test_who_polls_is_given_time_to_stamp_what_he_got() -> None:
    stand = Polled(100.0)
    for _ in range(5):
        stand.poll(between_s=0.004)
        stand.live(0.05)
    before = stand.pace.now_s()
    stand.ring.poll(whole=False)
    stand.live_fine(0.004)
    stand.ring.poll(whole=True)
    stand.live_fine(0.0035)
    assert stand.pace.now_s() == before  # it took him 4 ms to come back with the second request
    stand.live(0.05)
    assert stand.pace.now_s() > before + 0.01


def test_one_who_polls_and_has_gone_is_not_waited_for() -> None:
    stand = Polled(10.0)
    stand.poll()
    stand.live(READING_S + 1.0)
    assert stand.ring.total > 5000


def test_a_poll_is_whole_when_every_converter_was_read(tmp_path: Path) -> None:
    stand = device(tmp_path)
    bank = RegisterBank(stand, POLLING)
    reads = [POLLING.span([f"raw_{name}" for name in read]) for read in POLLING.poll.reads]  # type: ignore[union-attr]
    stand.advance(5)
    seen = []
    for read in (reads[0], reads[0], reads[1], reads[0]):
        bank.read(read.address, read.words, read.table)
        seen.append(stand.ring.polling)
    assert seen == [True, True, False, True]
    assert (stand.ring.acknowledged, stand.ring.acknowledgements) == (5, 4)


def test_acknowledgements_reach_the_ring_through_the_register(tmp_path: Path) -> None:
    stand = device(tmp_path)
    stand.ring.total = 2**32 + 5000
    RegisterBank(stand, RING).write(256, RING.encode("ring_acknowledge", 4000))
    assert (stand.ring.acknowledged, stand.ring.acknowledgements) == (2**32 + 4000, 1)


def served(folder: Path, speed: float) -> tuple[StandServer, FastHandClock]:
    clock = FastHandClock(speed)
    return StandServer(stand_file(folder), ServerOptions(model=MODEL, speed=speed), clock), clock


def test_a_starved_stand_makes_up_little_with_each_request(tmp_path: Path) -> None:
    server, clock = served(tmp_path, 10.0)
    clock.wall = 0.02
    for number, acting in enumerate((True, False), start=1):
        assert server.catch_up(acting) == 200 - number * CATCH_UP
        assert server.device.ring.total == number * CATCH_UP
    clock.wall += 0.001
    assert server.catch_up(False) == 0
    assert server.device.ring.total == 200  # fresh enough for a reader …
    server.catch_up(True)
    assert server.device.ring.total == 210  # … not for a command


@pytest.mark.slow
def test_one_at_the_walls_speed_drops_nothing_that_it_was_too_late_for(tmp_path: Path) -> None:
    server, clock = served(tmp_path, 1.0)
    clock.wall = 10.0
    while server.catch_up():
        pass
    assert server.device.ring.total == 10_000


@pytest.mark.slow
def test_a_fast_stand_loses_nothing_to_a_slow_reader(tmp_path: Path) -> None:
    """As the wire does it: each window a second of wall time late, at ten times the speed."""
    server, clock = served(tmp_path, 10.0)
    bank = RegisterBank(server.device, RING)
    at = 0
    for _ in range(40):
        clock.wall += 1.0
        bank.write(256, RING.encode("ring_acknowledge", at))
        while server.catch_up():
            pass
        header = RING.ring_header.decode(bank.read(260, 121)[:9])
        assert (header["first_sequence"], header["overruns"]) == (at, 0)
        at += int(header["count"])
        assert server.device.ring.total <= at + 2 * AHEAD
    assert at > 30 * 14
