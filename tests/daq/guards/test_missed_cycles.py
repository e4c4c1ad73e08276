"""Cycles that a controller missed: counted over a minute of its clock, at the limit and beyond it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from bufferstand.daq.guards.kinds.missed_cycles import WINDOW_S, MissedGuard, MissedMemory
from bufferstand.daq.guards.sights import PassOver, Samples
from bufferstand.daq.guards.trips import Action, Trip

from .beside import Around, block

GUARD = MissedGuard(3)
MINUTE_US = 60_000_000


def missed(cycles: int, at_us: int, memory: MissedMemory = ()) -> tuple[MissedMemory, Any]:
    return GUARD.look(memory, Samples(block({"force": 1.0}, at_us=at_us, first=70, missed=cycles)), Around())


def test_so_many_as_allowed_are_counted_and_one_more_stops() -> None:
    assert WINDOW_S == 60.0
    memory, trip = missed(3, 1_000_000)
    assert (memory, trip) == (((1_000_000, 3),), None)
    memory, trip = missed(1, 2_500_000, memory)
    assert memory == ((1_000_000, 3), (2_500_000, 1))
    assert trip == Trip(
        "missed cycles",
        Action.STOP,
        "the controller missed 4 cycles of its loop within 60 s, more than 3 (the last before sample 70 at "
        "2.500 s of its clock): look at the load of its loop",
        7.5,
        value=4.0,
        limit=3.0,
        unit="cycles",
        stream="controller",
        sequence=70,
        time_us=2_500_000,
        device_fault=True,
    )


def test_those_of_a_minute_ago_are_forgotten() -> None:
    memory, _ = missed(3, 0)
    assert missed(1, MINUTE_US - 1, memory)[1] is not None
    memory, trip = missed(1, MINUTE_US, memory)
    assert (memory, trip) == (((MINUTE_US, 1),), None)


def test_what_misses_nothing_or_has_no_sample_changes_nothing() -> None:
    memory = ((5, 2),)
    assert missed(0, 10, memory) == (memory, None)
    assert GUARD.look(memory, Samples(block({}, missed=9)), Around()) == (memory, None)
    assert GUARD.look(memory, PassOver(), Around()) == (memory, None)


def test_its_margin_is_full_where_it_trips() -> None:
    margin = GUARD.margin(((5, 1), (7, 1)), Around())
    assert (margin.share, margin.action) == (0.5, Action.STOP)
    assert margin.text == "2 missed within 60 s, trips above 3"
    site: Any = SimpleNamespace(table=SimpleNamespace(missed_cycles_max_per_min=8))
    assert list(MissedGuard.made_for(site)) == [MissedGuard(8)]
    assert MissedGuard.turn == 60
