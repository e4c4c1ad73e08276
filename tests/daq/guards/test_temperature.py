"""A thermometer: its stop, its silence, what it cannot mean, a reading that never changes."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from bufferstand.daq.guards.kinds.temperature import DS18B20, TemperatureGuard, TemperatureMemory
from bufferstand.daq.guards.sights import Complaint, MotionOver, PassOver, Phase, Samples
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.drivers import ReadingLimits
from bufferstand.drivers.interfaces import SensorFault

from .beside import Around, block

GUARD = TemperatureGuard("t", "plate", 40.0, 30.0, 5.0)
AIR = TemperatureGuard("t", "", None, None, 5.0, silence_action=Action.NOTE)
BEGUN = TemperatureMemory(100.0)


def read(
    *values: float, memory: TemperatureMemory = BEGUN, guard: TemperatureGuard = GUARD, **more: Any
) -> Any:
    wall_s = more.pop("wall_s", 101.0)
    seen = block(
        {"t": values}, stream="t", first=7, at_us=more.pop("at_us", 2_000_000), step_us=1_000_000, **more
    )
    return guard.look(memory, Samples(seen), Around(wall_s=wall_s))


def quiet(wall_s: float, memory: TemperatureMemory, guard: TemperatureGuard = GUARD) -> Any:
    return guard.look(memory, PassOver(), Around(wall_s=wall_s))


def test_the_stop_that_is_reached_is_tripped_with_all_that_is_known() -> None:
    memory, trip = read(39.99, 40.0, 45.0)
    assert trip == Trip(
        "t",
        Action.STOP,
        "t (plate) 40.00 °C has reached the stop threshold of 40 °C (reading 8 at 3.0 s)",
        7.5,
        value=40.0,
        limit=40.0,
        unit="°C",
        stream="t",
        sequence=8,
        time_us=3_000_000,
    )
    assert memory == TemperatureMemory(101.0, 45.0, 9, 4_000_000, same_since_s=101.0)
    assert read(39.99)[1] is None
    assert read(80.0, guard=AIR)[1] is None


def test_times_are_said_in_seconds_also_after_weeks() -> None:
    weeks_us = 2_000_000_000_000
    assert read(41.0, at_us=weeks_us)[1].reason.endswith("(reading 7 at 2000000.0 s)")
    known = TemperatureMemory(100.0, 25.0, 1, weeks_us)
    assert "its reading of 2000000.0 s" in read(26.0, memory=known, at_us=weeks_us)[0].complaint


def test_only_its_own_stream_is_read() -> None:
    other = Samples(block({"t": 90.0}, stream="other"))
    assert GUARD.look(BEGUN, other, Around()) == (BEGUN, None)
    assert GUARD.look(BEGUN, Samples(block({"x": 90.0}, stream="t")), Around()) == (BEGUN, None)
    assert GUARD.look(BEGUN, MotionOver(), Around(wall_s=1e6)) == (BEGUN, None)
    assert GUARD.look(BEGUN, Complaint(SensorFault("other", 1.0, "x")), Around()) == (BEGUN, None)
    told, nothing = GUARD.look(BEGUN, Complaint(SensorFault("t", 1.0, "CRC wrong")), Around())
    assert (told, nothing) == (replace(BEGUN, complaint="CRC wrong"), None)


@pytest.mark.parametrize("value", [-55.0, 125.0])
def test_the_ends_of_the_range_are_readings(value: float) -> None:
    assert read(value, guard=AIR)[0].value_C == value


@pytest.mark.parametrize("value", [-55.01, 125.01, math.nan, math.inf])
def test_what_lies_beyond_the_range_is_none(value: float) -> None:
    memory, trip = read(value)
    assert (memory.value_C, memory.since_s, trip) == (None, 100.0, None)
    assert memory.complaint == f"its last reading, {value:.2f} °C, is outside the sensor's range"


def test_the_power_on_value_is_believed_only_near_the_reading_before() -> None:
    assert ReadingLimits(-55.0, 125.0, power_on_C=85.0) == DS18B20
    assert read(85.0, guard=AIR)[0].value_C is None
    near = TemperatureMemory(100.0, 80.0, 1, 1_000_000)
    assert read(85.0, memory=near, guard=AIR)[0].value_C == 85.0
    assert read(85.0, memory=replace(near, value_C=90.0), guard=AIR)[0].value_C == 85.0
    memory, _ = read(85.0, memory=replace(near, value_C=79.99), guard=AIR)
    assert memory.value_C == 79.99
    assert (
        memory.complaint
        == "its last reading, exactly 85.0 °C, is the power-on value (supply or conversion failed)"
    )
    assert read(85.0, memory=replace(near, value_C=90.01), guard=AIR)[0].value_C == 90.01
    assert read(84.9, memory=replace(near, value_C=20.0), guard=AIR)[0].value_C == 84.9


def test_a_reading_that_is_not_newer_is_a_repetition() -> None:
    known = TemperatureMemory(100.0, 25.0, 1, 2_000_000)
    for at_us in (2_000_000, 1_999_999):
        memory, _ = read(26.0, memory=known, at_us=at_us)
        assert memory == replace(
            known, complaint="it repeats its reading of 2.0 s instead of taking a new one"
        )
    assert read(26.0, memory=known, at_us=2_000_001)[0].value_C == 26.0


def test_a_bad_reading_does_not_hide_a_good_one_behind_it() -> None:
    memory, trip = read(200.0, 41.0)
    assert (memory.value_C, memory.complaint, trip.value) == (41.0, "", 41.0)


def test_silence_is_longer_than_the_grace() -> None:
    known = TemperatureMemory(100.0, 25.0, 9, 4_000_000)
    assert quiet(105.0, known) == (known, None)
    memory, trip = quiet(105.5, known)
    assert memory == replace(known, silence_said=True)
    assert trip == Trip(
        "t",
        Action.STOP,
        "t (plate) has given no true reading for 5.5 s (limit 5 s; last true reading 25.00 °C): nothing was "
        "received; check the cable and the bus",
        5.0,
        value=5.5,
        limit=5.0,
        unit="s",
        stream="t",
        sequence=9,
        device_fault=True,
    )
    assert quiet(106.0, memory)[1] is not None, "one that stops is said as long as it lasts"
    assert "; never): CRC wrong" in quiet(106.0, replace(BEGUN, complaint="CRC wrong"))[1].reason


def test_silence_that_is_a_note_is_said_once() -> None:
    memory, trip = quiet(105.5, BEGUN, AIR)
    assert (trip.action, memory.silence_said) == (Action.NOTE, True)
    assert quiet(107.0, memory, AIR) == (memory, None)
    assert not read(25.0, memory=memory, guard=AIR)[0].silence_said


def test_the_very_same_reading_for_half_an_hour_is_noted_once() -> None:
    guard = replace(GUARD, frozen_s=60.0)
    memory, _ = read(25.0, wall_s=100.0)
    assert memory.same_since_s == 100.0
    memory, _ = read(25.0, memory=memory, at_us=3_000_000, wall_s=158.0)
    assert (memory.same_since_s, memory.since_s) == (100.0, 158.0)
    assert quiet(160.0, memory, guard) == (memory, None)
    said, trip = quiet(160.5, memory, guard)
    assert said == replace(memory, frozen_said=True)
    assert trip == Trip(
        "t",
        Action.NOTE,
        "t (plate) has reported exactly 25.0000 °C for 60 s: true at rest, else check that it touches the "
        "specimen",
        5.0,
        value=60.5,
        limit=60.0,
        unit="s",
        stream="t",
    )
    unknown = replace(BEGUN, value_C=25.0)
    assert quiet(100.5, unknown, replace(GUARD, frozen_s=0.5)) == (unknown, None)
    assert quiet(161.0, said, guard) == (said, None)
    again, _ = read(25.0, memory=said, at_us=4_000_000, wall_s=161.0)
    assert again.frozen_said
    other, _ = read(25.1, memory=said, at_us=4_000_000, wall_s=161.0)
    assert (other.same_since_s, other.frozen_said) == (161.0, False)
    assert GUARD.frozen_s == 1800.0
    fresh = replace(BEGUN, value_C=25.0)
    assert read(25.0, memory=fresh, wall_s=103.0)[0].same_since_s == 103.0


def margin(value_C: float | None, guard: TemperatureGuard = GUARD, ambient_C: float = 20.0) -> Any:
    return guard.margin(TemperatureMemory(100.0, value_C), Around(wall_s=101.0, ambient_C=ambient_C))


def test_its_margin_is_the_way_from_the_air_to_the_stop() -> None:
    assert (margin(25.0).share, margin(25.0).text) == (0.25, "25.0 of 40 °C, 15.0 left, 1 s old")
    assert margin(45.0).text == "45.0 of 40 °C, 0.0 left, 1 s old"
    assert margin(10.0).share == 0.0
    assert margin(20.0, ambient_C=40.0).share == 0.5, "air as warm as the stop: by the value alone"
    assert margin(20.0, ambient_C=50.0).share == 0.5
    assert (margin(None).share, margin(None).text) == (None, "no reading yet (grace 5 s)")
    assert (margin(25.0, AIR).share, margin(25.0, AIR).text) == (0.2, "25.0 °C, 1 s old")
    assert [margin(25.0).action, margin(25.0, AIR).action] == [Action.STOP, Action.NOTE]
    assert [GUARD.label, AIR.label] == ["t (plate)", "t"]


def test_while_it_cools_heat_is_no_trip_and_thresholds_change_only_where_there_are_some() -> None:
    assert GUARD.during(Phase.COOLING) == replace(GUARD, stop_C=None)
    assert GUARD.during(Phase.VALVE_OFF) is GUARD
    assert GUARD.stopping_at(50.0, 45.0) == replace(GUARD, stop_C=50.0, resume_C=45.0)
    assert AIR.stopping_at(50.0, 45.0) is AIR
    assert (GUARD.key, GUARD.begin(3.0), TemperatureGuard.turn) == ("t", TemperatureMemory(3.0), 20)
    assert (GUARD.jump_K, GUARD.action, GUARD.silence_action) == (5.0, Action.STOP, Action.STOP)
    assert TemperatureMemory(100.0, frozen_said=False, silence_said=False) == BEGUN


def test_its_data_name_what_it_can_show_only_where_that_is_unusual() -> None:
    assert "readings" not in GUARD.facts()
    assert TemperatureGuard.from_facts(GUARD.facts()) == GUARD
    other = replace(GUARD, readings=ReadingLimits(-20.0, 300.0))
    assert other.facts()["readings"]["high_C"] == 300.0
    assert TemperatureGuard.from_facts(other.facts()) == other


def test_each_thermometer_has_one_and_that_of_the_air_only_speaks() -> None:
    def facts(place: str, readings: Any = None) -> Any:
        return SimpleNamespace(
            channels=[SimpleNamespace(place=place), SimpleNamespace(place="?")], readings=readings
        )

    other = ReadingLimits(-20.0, 300.0)
    site: Any = SimpleNamespace(
        thermometers={"a": facts("plate"), "b": facts("hall", other)},
        ambient=("b",),
        limits=SimpleNamespace(temperature_stop_C=40.0, temperature_resume_C=30.0, temperature_stale_s=5.0),
        does={"temperature": Action.EMERGENCY, "ambient_silence": Action.NOTE}.get,
    )
    assert list(TemperatureGuard.made_for(site)) == [
        TemperatureGuard("a", "plate", 40.0, 30.0, 5.0, action=Action.EMERGENCY),
        TemperatureGuard(
            "b", "hall", None, None, 5.0, action=Action.EMERGENCY, silence_action=Action.NOTE, readings=other
        ),
    ]
