"""The clock by which a campaign on a served stand goes: the stand's, whoever is starved."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

from bufferstand.drivers.simulated.serving import clock as stand_clock
from bufferstand.drivers.simulated.serving.clock import DEAD_S, LEAST, ShownTime, StandClock
from bufferstand.drivers.simulated.wires.pace import CREDIT_S
from bufferstand.foundation.errors import DeviceFault


class Wall:
    """The monotonic time of both processes, moved by hand."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, duration_s: float) -> None:
        self.now += duration_s


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> Wall:
    made = Wall()
    monkeypatch.setattr(stand_clock, "time", made)
    return made


@pytest.fixture
def shown(tmp_path: Path, wall: Wall) -> Iterator[ShownTime]:
    made = ShownTime(tmp_path / "deep" / "time", 1.0)
    yield made
    made.close()


def going_at(speed: float, folder: Path) -> StandClock:
    """Return the clock of the stand that shows its time there, as if it had been served at that speed."""
    path = folder / "deep" / "time"
    with path.open("r+b") as file:
        file.seek(16)
        file.write(struct.pack("d", speed))
    return StandClock(path)


def test_it_is_the_stands_time(shown: ShownTime, tmp_path: Path, wall: Wall) -> None:
    clock = going_at(10.0, tmp_path)
    assert clock.now_s() == 0.0
    shown.show(3.5)
    assert clock.now_s() == 3.5
    wall.now += 5.0
    shown.show(3.5)  # it waits for its reader
    assert clock.now_s() == 3.5
    shown.show(2.0)  # which no stand does
    assert clock.now_s() == 3.5


def test_a_wait_takes_as_long_as_stand_time_does(shown: ShownTime, tmp_path: Path, wall: Wall) -> None:
    clock = going_at(10.0, tmp_path)
    began = wall.now
    clock.sleep(30.0)
    assert wall.now - began == pytest.approx(3.0)
    clock.sleep(-1.0)
    assert wall.now - began == pytest.approx(3.0)


def test_a_long_wait_of_its_own_counts_as_lived(shown: ShownTime, tmp_path: Path, wall: Wall) -> None:
    clock = going_at(1.0, tmp_path)
    for turn in range(100):
        clock.sleep(0.1)
        shown.show(0.1 * (turn + 1))
    assert clock.wall_s() == pytest.approx(10.0, abs=0.2)


@pytest.mark.parametrize("speed", [1.0, 6.0, 100.0])
@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_where_the_stand_gets_a_share_of_the_computer_silence_counts_so_much_more_slowly(
    shown: ShownTime, tmp_path: Path, wall: Wall, speed: float, share: float
) -> None:
    """Both live all the time, but the stand makes only a share of its samples, in leaps."""
    clock = going_at(speed, tmp_path)
    stand_s = 0.0
    for turn in range(2000):
        wall.now += 0.01
        if turn % 8 == 7:
            stand_s += share * speed * 0.08
            shown.show(stand_s)
        clock.wall_s()
    assert 20.0 * share - 0.4 <= clock.wall_s() <= 20.0 * min(1.0, share + LEAST) + 0.4


def test_a_stand_that_lives_and_stands_still_holds_nobody_for_ever(
    shown: ShownTime, tmp_path: Path, wall: Wall
) -> None:
    clock = going_at(1.0, tmp_path)
    for _ in range(10_000):
        wall.now += 0.1
        shown.show(1.0)
        clock.wall_s()
    assert clock.wall_s() == pytest.approx(LEAST * 1000.0, abs=1.0)


def test_starved_itself_it_counts_little(shown: ShownTime, tmp_path: Path, wall: Wall) -> None:
    clock = going_at(1.0, tmp_path)
    wall.now += 7.0
    shown.show(0.1)  # the stand lived
    assert clock.wall_s() == pytest.approx(CREDIT_S)


def test_while_the_stand_is_starved_no_silence_counts(shown: ShownTime, tmp_path: Path, wall: Wall) -> None:
    clock = going_at(1.0, tmp_path)
    shown.show(0.1)
    for _ in range(700):  # seven seconds in which the program lives and the stand does not
        wall.now += 0.01
        clock.wall_s()
    assert clock.wall_s() == pytest.approx(CREDIT_S, abs=0.011)
    shown.show(0.2)
    wall.now += 0.1
    assert clock.wall_s() == pytest.approx(CREDIT_S + 0.1, abs=0.011)


def test_without_the_stand_time_goes_on_so_that_nobody_waits_for_ever(
    shown: ShownTime, tmp_path: Path, wall: Wall
) -> None:
    clock = going_at(10.0, tmp_path)
    shown.show(5.0)
    end_s = wall.now + DEAD_S + 2.0
    while wall.now < end_s:
        wall.now += 0.1
        seen_s = clock.now_s()
    assert seen_s == pytest.approx(5.0 + 2.0 * 10.0, abs=1.1)
    assert clock.wall_s() == pytest.approx(2.0 + CREDIT_S, abs=0.2)


def test_a_stand_that_shows_no_time_is_said(tmp_path: Path) -> None:
    with pytest.raises(DeviceFault, match="shows no time"):
        StandClock(tmp_path / "nothing")
    (tmp_path / "empty").touch()
    with pytest.raises(DeviceFault, match="shows no time"):
        StandClock(tmp_path / "empty")


def test_closed_it_leaves_nothing(tmp_path: Path) -> None:
    ShownTime(tmp_path / "time", 1.0).close()
    assert not list(tmp_path.iterdir())
