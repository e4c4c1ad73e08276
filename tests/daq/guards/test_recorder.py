"""The recorder's guard: what failed, what waits for the disk and how long, by a clock of the test."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from bufferstand.daq.guards.kinds.recorder import DiskGuard, RecorderGuard
from bufferstand.daq.guards.sights import NewZero, PassOver, Recorded, RunBegun
from bufferstand.daq.guards.trips import Action, Trip

from .beside import Around


class Steady:
    def __init__(self) -> None:
        self.now_s = 50.0

    def __call__(self) -> float:
        return self.now_s


def state(written: int = 0, durable: int = 0, **more: Any) -> Any:
    plain = {"failure": None, "disk_warning": None, "renewals": ()}
    return SimpleNamespace(written=written, durable=durable, **plain | more)


def watching() -> tuple[RecorderGuard, Steady]:
    steady = Steady()
    return RecorderGuard(10.0, steady), steady


def test_a_recorder_that_takes_all_says_nothing() -> None:
    guard, steady = watching()
    assert guard.late_s == 0.0
    for _ in range(3):
        steady.now_s += 100.0
        assert guard.look(state(5, 5), 1.0) == []
        assert guard.late_s == 0.0


def test_a_failure_stops_and_goes_before_a_full_disk() -> None:
    guard, _ = watching()
    (trip,) = guard.look(state(failure=OSError("gone"), disk_warning="no room"), 1.5)
    assert trip == Trip(
        "recorder",
        Action.STOP,
        "recording failed: gone; what was on the disk before is kept",
        1.5,
        device_fault=True,
    )
    (trip,) = guard.look(state(disk_warning="no room"), 1.5)
    assert trip == Trip("recorder", Action.STOP, "the disk is nearly full: no room", 1.5, device_fault=True)


def test_each_file_that_was_given_up_is_noted_once() -> None:
    guard, _ = watching()
    assert [one.action for one in guard.look(state(renewals=("a",)), 1.0)] == [Action.NOTE]
    said = guard.look(state(renewals=("a", "b", "c")), 1.0)
    assert [one.reason.rpartition(": ")[2] for one in said] == ["b", "c"]
    assert guard.look(state(renewals=("a", "b", "c")), 1.0) == []
    guard.begin()
    assert len(guard.look(state(renewals=("a",)), 1.0)) == 1, "of another run"


def late(guard: RecorderGuard, steady: Steady, by_s: float, written: int = 9, durable: int = 5) -> list[Trip]:
    steady.now_s += by_s
    return guard.look(state(written, durable), 3.0)


def test_what_waits_for_a_fifth_of_the_limit_is_noted_once_and_for_longer_than_the_limit_stops() -> None:
    guard, steady = watching()
    assert late(guard, steady, 7.0) == [], "it began to wait no earlier than now"
    assert late(guard, steady, 2.0) == []
    assert guard.late_s == 2.0
    (note,) = late(guard, steady, 0.5)
    assert note == Trip(
        "recorder",
        Action.NOTE,
        "the disk is slow: 4 samples have waited for it for 2.5 s (stop at 10 s); nothing is lost yet",
        3.0,
        value=2.5,
        limit=10.0,
        unit="s",
    )
    assert late(guard, steady, 7.5) == [], "just the limit"
    (stop,) = late(guard, steady, 0.5)
    assert (stop.action, stop.device_fault) == (Action.STOP, True)
    assert stop.reason.startswith("the disk is slow: 4 samples have waited for it for 10.5 s")


def test_a_disk_that_moves_or_has_all_is_not_late() -> None:
    guard, steady = watching()
    late(guard, steady, 0.0)
    assert len(late(guard, steady, 3.0)) == 1
    assert late(guard, steady, 3.0, durable=6) == [], "it has moved"
    assert late(guard, steady, 2.0, durable=6) == []
    assert len(late(guard, steady, 0.5, durable=6)) == 1, "and is noted anew"
    assert late(guard, steady, 3.0, written=6, durable=6) == []
    assert late(guard, steady, 3.0, written=9, durable=6) == [], "what is written now has waited since now"
    assert late(guard, steady, 2.0, written=9, durable=6) == []


def test_of_another_run_nothing_waits() -> None:
    guard, steady = watching()
    late(guard, steady, 0.0)
    late(guard, steady, 3.0)
    steady.now_s += 5.0
    guard.begin()
    assert guard.late_s == 0.0
    steady.now_s += 5.0
    assert guard.look(state(9, 5), 3.0) == []
    assert guard.late_s == 0.0
    assert late(guard, steady, 1.0) == []
    assert guard.late_s == 1.0
    fresh, steady = watching()
    assert fresh.look(state(9, -1), 3.0) == [], "the first look knows of no wait"
    fresh.begin()
    steady.now_s += 9.0
    assert fresh.look(state(9, -1), 3.0) == []


def test_the_guard_of_a_campaign_hands_the_recorder_on() -> None:
    guard = DiskGuard(4.0)
    memory = guard.begin(0.0)
    memory._steady_s = steady = Steady()
    memory.begin()
    assert guard.look(memory, PassOver(), Around()) == (memory, None)
    _, found = guard.look(memory, Recorded(state(failure=OSError("x"))), Around(at_s=2.0))
    assert [one.at_s for one in found] == [2.0]  # type: ignore[union-attr]
    guard.look(memory, Recorded(state(9, 5)), Around())
    steady.now_s += 1.0
    guard.look(memory, Recorded(state(9, 5)), Around())
    margin = guard.margin(memory, Around())
    assert (margin.share, margin.text, margin.action) == (0.25, "1.0 s behind, trips after 4 s", Action.STOP)
    assert guard.after(memory, NewZero(counted=True)) is memory
    assert memory.late_s == 1.0
    assert guard.after(memory, RunBegun()) is memory
    assert memory.late_s == 0.0
    assert (guard.facts(), DiskGuard().stop_s, DiskGuard.standing, DiskGuard.in_journal) == (
        4.0,
        10.0,
        True,
        False,
    )
    assert DiskGuard.turn == 140
    site: Any = SimpleNamespace(table=SimpleNamespace(disk_stop_s=6.0))
    assert list(DiskGuard.made_for(site)) == [DiskGuard(6.0)]
