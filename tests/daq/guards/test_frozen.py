"""A transducer that stands still: how far the command must move, for how long, and what ends it."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from bufferstand.daq.guards.kinds.frozen import FrozenGuard, FrozenMemory
from bufferstand.daq.guards.sights import PassOver, Phase, Samples
from bufferstand.daq.guards.trips import Action, Trip

from .beside import Around, block

GUARD = FrozenGuard("force", travel_mm=3.0, hold_s=0.25)
STILL = FrozenMemory(5.0, 1_000_000, 10.0, 11.0)


def shown(
    force: list[float],
    command: list[float],
    memory: FrozenMemory = STILL,
    *,
    at_us: int = 1_300_000,
    **more: Any,
) -> Any:
    values = {"force": force, "command": command}
    return GUARD.look(memory, Samples(block(values, at_us=at_us, first=70, **more)), Around())


def test_one_value_over_more_than_the_travel_for_the_time_is_a_trip() -> None:
    memory, trip = shown([5.0, 5.0], [12.0, 13.5])
    assert memory == FrozenMemory(5.0, 1_000_000, 10.0, 13.5)
    assert trip == Trip(
        "frozen force",
        Action.STOP,
        "force has shown exactly 5.0000 for 0.30 s while the command moved by 3.5 mm (until sample 71): its "
        "transducer, converter or register stands still; look at its cable and supply",
        7.5,
        value=5.0,
        stream="controller",
        sequence=71,
        time_us=1_301_000,
        device_fault=True,
    )


def test_just_the_travel_is_none_and_just_the_time_is_enough() -> None:
    assert shown([5.0, 5.0], [12.0, 13.0])[1] is None
    assert shown([5.0, 5.0], [12.0, 13.5], at_us=1_249_000)[1] is not None
    assert shown([5.0, 5.0], [12.0, 13.5], at_us=1_248_999)[1] is None
    assert shown([5.0, 5.0], [8.0, 7.5])[1] is not None, "in either direction"
    assert shown([5.0, 5.0], [8.0, 7.5])[0] == FrozenMemory(5.0, 1_000_000, 7.5, 11.0)


def test_another_value_begins_anew() -> None:
    assert shown([5.0, 5.1], [12.0, 20.0]) == (FrozenMemory(5.1, 1_301_000, 20.0, 20.0), None)
    assert shown([6.0, 6.0], [12.0, 20.0]) == (FrozenMemory(6.0, 1_300_000, 12.0, 20.0), None)
    assert shown([5.0, 6.0, 6.0], [12.0, 14.0, 13.0]) == (FrozenMemory(6.0, 1_301_000, 13.0, 14.0), None)
    assert shown([5.0, 6.0, 5.0, 5.0], [12.0, 30.0, 14.0, 13.0]) == (
        FrozenMemory(5.0, 1_302_000, 13.0, 14.0),
        None,
    )
    assert shown([6.0], [20.0]) == (FrozenMemory(6.0, 1_300_000, 20.0, 20.0), None)
    assert shown([5.0], [13.5])[1] is not None, "a single sample, too"


def test_behind_lost_samples_nothing_is_known_of_before() -> None:
    assert shown([5.0, 5.0], [12.0, 13.5], lost=1) == (FrozenMemory(5.0, 1_300_000, 12.0, 13.5), None)


def test_within_one_block_it_is_seen_as_well() -> None:
    steps = 300
    memory, trip = shown([5.0] * steps, [0.02 * at for at in range(steps)], FrozenMemory())
    assert memory == FrozenMemory(5.0, 1_300_000, 0.0, pytest.approx(5.98))
    assert trip is not None


def test_what_is_no_number_is_said_by_another_guard() -> None:
    assert shown([5.0, math.nan], [12.0, 13.5]) == (FrozenMemory(), None)
    assert shown([math.nan, math.nan], [12.0, 13.5]) == (FrozenMemory(), None)
    assert shown([math.nan], [12.0]) == (FrozenMemory(), None)


def test_without_the_channel_the_command_or_samples_nothing_changes() -> None:
    for values in ({"force": 5.0}, {"command": 5.0}, {"force": (), "command": ()}):
        assert GUARD.look(STILL, Samples(block(values)), Around()) == (STILL, None)
    assert GUARD.look(STILL, PassOver(), Around()) == (STILL, None)


def test_it_does_not_look_where_nothing_follows_the_command() -> None:
    looks = {phase: GUARD.during(phase) for phase in Phase}
    assert [phase for phase, one in looks.items() if one is None] == [Phase.VALVE_OFF, Phase.TOUCH]
    assert looks[Phase.COOLING] is GUARD


def test_its_margin_is_the_share_of_the_travel() -> None:
    margin = GUARD.margin(FrozenMemory(5.0, 0, 10.0, 11.5), Around())
    assert (margin.share, margin.name, margin.action) == (0.5, "frozen force", Action.STOP)
    assert margin.text == "stands while the command moved 1.5 of 3 mm"
    assert FrozenMemory() == FrozenMemory(None, 0, 0.0, 0.0)
    plain = FrozenGuard("x")
    assert (plain.travel_mm, plain.hold_s, plain.action, plain.key) == (3.0, 0.25, Action.STOP, "x")
    assert (FrozenGuard.turn, FrozenGuard.of_zero) == (90, True)


def test_each_measured_channel_has_one_in_order() -> None:
    there = [
        ("command", "command"),
        ("position", "position"),
        ("stroke_2", "stroke"),
        ("stroke_1", "stroke"),
        ("f", "force"),
    ]
    channels = [SimpleNamespace(name=name, quantity=quantity) for name, quantity in there]
    site: Any = SimpleNamespace(
        stand=SimpleNamespace(controller=SimpleNamespace(facts=SimpleNamespace(channels=channels))),
        does={"frozen": Action.EMERGENCY}.get,
    )
    made = list(FrozenGuard.made_for(site))
    assert [one.signal for one in made] == ["f", "stroke_1", "stroke_2", "position"]
    assert {one.action for one in made} == {Action.EMERGENCY}
