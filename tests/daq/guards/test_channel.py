"""A signal between two limits: at the limit, beyond it, for how long, and what is said of it."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bufferstand.daq.guards.kinds.channel import (
    DEFAULT_TILT_MM,
    ChannelGuard,
    ChannelMemory,
    evaluate_channel,
)
from bufferstand.daq.guards.margin import Peaks
from bufferstand.daq.guards.sights import PassOver, Phase, Samples
from bufferstand.daq.guards.trips import Action, Trip

from .beside import Around, block

GUARD = ChannelGuard("force", "force", 600.0, -10.0, "kN", "force", Action.EMERGENCY)
LASTING = replace(GUARD, hold_s=0.002)


def judged(
    *values: float, guard: ChannelGuard = GUARD, memory: ChannelMemory | None = None, **more: Any
) -> Any:
    return evaluate_channel(guard, memory or ChannelMemory(), block({"force": values}, **more))


def test_the_limits_themselves_are_no_excess() -> None:
    for value in (600.0, -10.0, 0.0):
        assert judged(value)[1] is None
    for value in (math.nextafter(600.0, 1e9), math.nextafter(-10.0, -1e9), math.nan, math.inf, -math.inf):
        assert judged(value)[1] is not None


def test_a_trip_says_sample_value_and_limit() -> None:
    memory, trip = judged(0.0, 601.0, 700.0, first=70, at_us=2_000_000)
    assert trip == Trip(
        "force",
        Action.EMERGENCY,
        "force 601.00 kN exceeds the limit of 600.00 kN (sample 71 at 2.001 s of the device's clock)",
        7.5,
        value=601.0,
        limit=600.0,
        unit="kN",
        stream="controller",
        sequence=71,
        time_us=2_001_000,
        believed=True,
    )
    assert memory == ChannelMemory(2_001_000, Peaks(((7, 0.0, 700.0),)))
    _, trip = judged(-11.0, guard=LASTING, at_us=2000, memory=ChannelMemory(0))
    assert trip.reason.startswith(
        "force -11.00 kN is below the limit of -10.00 kN for 0.002 s (sample 0 at 0.002 s"
    )
    assert trip.limit == -10.0
    _, trip = judged(math.nan)
    assert trip.reason.startswith("force is not a number (sample 0 at")
    assert (trip.value, trip.limit) == (None, 600.0)
    _, trip = judged(-11.0, guard=replace(GUARD, upper=None))
    assert trip.limit == -10.0
    _, trip = judged(math.nan, guard=replace(GUARD, upper=None))
    assert trip.limit == -10.0


def test_a_limit_beside_an_excess_is_none_and_times_are_exact() -> None:
    assert judged(-10.0, 700.0)[1].sequence == 1
    assert judged(600.0, 700.0)[1].sequence == 1
    long = replace(GUARD, hold_s=2.0)
    assert judged(700.0, guard=long, memory=ChannelMemory(0), at_us=2_000_000)[1] is not None
    assert judged(700.0, guard=long, memory=ChannelMemory(0), at_us=1_999_999)[1] is None
    assert "at 2000000.000 s" in judged(700.0, at_us=2_000_000_000_000)[1].reason
    known = ChannelMemory(None, Peaks(((7, -10.0, 600.0),)))
    assert judged(-10.0, memory=known)[0] is known
    assert judged(600.0, memory=known)[0] is known


def test_a_side_without_a_limit_bounds_nothing() -> None:
    assert judged(1e9, guard=replace(GUARD, upper=None))[1] is None
    assert judged(-1e9, guard=replace(GUARD, lower=None))[1] is None
    assert judged(1e9, guard=replace(GUARD, lower=None))[1] is not None


def test_an_excess_lasts_from_its_first_sample_through_blocks_until_it_is_interrupted() -> None:
    memory, trip = judged(0.0, 700.0, 700.0, guard=LASTING)
    assert (memory.since_us, trip) == (1000, None)
    memory, trip = judged(700.0, guard=LASTING, memory=memory, at_us=3000, first=3)
    assert (memory.since_us, trip.sequence) == (1000, 3)
    memory, trip = judged(700.0, 0.0, 700.0, guard=LASTING, memory=ChannelMemory(1000), at_us=2000)
    assert (memory.since_us, trip) == (4000, None), "a break begins it anew"
    memory, trip = judged(0.0, 700.0, 700.0, guard=LASTING, memory=ChannelMemory(1000), at_us=3000)
    assert (memory.since_us, trip) == (4000, None)
    memory, trip = judged(700.0, 0.0, guard=LASTING, memory=ChannelMemory(1500), at_us=2000)
    assert (memory.since_us, trip) == (None, None)
    memory, trip = judged(0.0, guard=LASTING, memory=ChannelMemory(1500), at_us=2000)
    assert (memory.since_us, trip) == (None, None)
    _, trip = judged(700.0, 700.0, 700.0, 700.0, guard=LASTING)
    assert trip.sequence == 2
    _, trip = judged(0.0, 700.0, 700.0, 700.0, 0.0, guard=LASTING)
    assert trip.sequence == 3, "also where it is over within the block"


def test_what_changes_nothing_is_remembered_as_it_was() -> None:
    memory = ChannelMemory(None, Peaks(((7, -1.0, 1.0),)))
    assert judged(0.5, memory=memory)[0] is memory
    for other in (block({"stroke": 1.0}), block({"force": ()})):
        assert evaluate_channel(GUARD, memory, other) == (memory, None)
    grown, _ = judged(2.0, -0.5, memory=memory)
    assert grown == ChannelMemory(None, Peaks(((7, -1.0, 2.0),)))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_no_extreme(value: float) -> None:
    assert judged(value)[0].peaks == Peaks()
    assert judged(value, 1.0)[0].peaks == Peaks()


def margin(low: float, high: float, guard: ChannelGuard = GUARD) -> Any:
    return guard.margin(ChannelMemory(None, Peaks(((7, low, high),))), Around())


def test_its_margin_is_that_of_the_extreme_nearest_to_its_limit() -> None:
    assert GUARD.margin(ChannelMemory(), Around()).text == "no value"
    found = margin(-1.0, 150.0)
    assert (found.share, found.text) == (0.25, "150.0 of 600 kN, 450.0 left")
    found = margin(-9.0, 150.0)
    assert (found.share, found.text) == (0.9, "-9.0 of -10 kN, 1.0 left")
    assert margin(-12.0, 0.0).text == "-12.0 of -10 kN, 0.0 left"
    assert margin(-20.0, 0.0).text == "-20.0 of -10 kN, 0.0 left"
    assert margin(0.0, 600.0).text == "600.0 of 600 kN, 0.0 left"
    assert margin(1.0, -5.0).share == 0.0, "away from either limit"
    assert margin(1.0, 2.345, replace(GUARD, upper=None, lower=None)).text == "2.35 kN"
    assert margin(1.0, 2.0, replace(GUARD, upper=None, lower=0.0)).share is None
    assert margin(-5.0, 2.0, replace(GUARD, upper=None)).share == 0.5
    assert found.action is Action.EMERGENCY


def test_it_looks_at_samples_and_not_where_its_signal_means_nothing() -> None:
    memory = ChannelMemory()
    assert GUARD.look(memory, PassOver(), Around()) == (memory, None)
    assert GUARD.look(memory, Samples(block({"force": 700.0})), Around())[1] is not None
    following, tilt, stroke = (replace(GUARD, signal=name) for name in ("following_error", "tilt", "stroke"))
    assert [one.during(Phase.VALVE_OFF) for one in (GUARD, following, tilt, stroke)] == [
        GUARD,
        None,
        tilt,
        stroke,
    ]
    assert [one.during(Phase.FIRST_LOOK) for one in (GUARD, following, tilt, stroke)] == [
        GUARD,
        following,
        None,
        None,
    ]
    assert following.during(Phase.COOLING) is following
    assert (ChannelGuard.of_zero, ChannelGuard.turn, GUARD.key) == (True, 70, "force")
    assert ChannelGuard("a", "b", None, None, "", "").hold_s == 0.0


def site(
    strokes: int, *, tilt_mm: float | None = None, stand_mm: float | None = None, forces: int = 0
) -> Any:
    def channels(quantity: str, number: int) -> list[Any]:
        return [SimpleNamespace(name=f"{quantity}_{at}", quantity=quantity) for at in range(1, number + 1)]

    facts = SimpleNamespace(channels=channels("stroke", strokes) + channels("position", 1))
    return SimpleNamespace(
        table=SimpleNamespace(tilt_max_mm=tilt_mm, force_below_kN=10.0, stroke_below_mm=3.0, tilt_hold_s=0.4),
        limits=SimpleNamespace(following_error_max_mm=8.0, following_error_grace_s=0.3),
        envelope=SimpleNamespace(force_trip_kN=600.0, stroke_trip_mm=110.0),
        stand_tilt_mm=stand_mm,
        acquisition={"t7": SimpleNamespace(channels=channels("force", forces) + channels("stroke", 1))},
        stand=SimpleNamespace(controller=SimpleNamespace(facts=facts)),
        does={"force": Action.EMERGENCY, "stroke": Action.STOP, "tilt": Action.NOTE}.get,
    )


def test_a_stand_has_one_for_each_signal_that_it_shows() -> None:
    made = {one.name: one for one in ChannelGuard.made_for(site(2, forces=1))}
    assert list(made) == ["force", "force_1 of the acquisition device", "stroke", "tilt", "following error"]
    rows = {
        name: (one.signal, one.upper, one.lower, one.unit, one.action, one.hold_s)
        for name, one in made.items()
    }
    assert rows == {
        "force": ("force", 600.0, -10.0, "kN", Action.EMERGENCY, 0.0),
        "force_1 of the acquisition device": ("force_1", 600.0, -10.0, "kN", Action.EMERGENCY, 0.0),
        "stroke": ("stroke", 110.0, -3.0, "mm", Action.STOP, 0.0),
        "tilt": ("tilt", 5.0, -5.0, "mm", Action.NOTE, 0.4),
        "following error": ("following_error", 8.0, -8.0, "mm", None, 0.3),
    }
    assert "stroke_1 − stroke_2" in made["tilt"].label


def test_the_tilt_is_the_campaigns_else_the_stands_else_the_usual_one() -> None:
    assert DEFAULT_TILT_MM == 5.0

    def tilt(**stated: float) -> ChannelGuard:
        return next(one for one in ChannelGuard.made_for(site(3, **stated)) if one.name == "tilt")

    assert [tilt(tilt_mm=2.0, stand_mm=4.0).upper, tilt(stand_mm=4.0).upper, tilt().upper] == [2.0, 4.0, 5.0]
    assert "largest difference of two draw wires" in tilt().label
    assert "tilt" not in {one.name for one in ChannelGuard.made_for(site(1))}


def test_how_a_block_is_cut_changes_no_trip() -> None:
    values = np.array([0.0, 700.0, 0.0, 700.0, 700.0, 700.0, 0.0])
    for cut in range(1, len(values)):
        memory, first = judged(*values[:cut], guard=LASTING)
        _, second = judged(*values[cut:], guard=LASTING, memory=memory, at_us=1000 * cut, first=cut)
        (found,) = [one for one in (first, second) if one is not None]
        assert found.sequence == 5
