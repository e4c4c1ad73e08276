"""What a guard says: its action, its place among others, and what of it goes into the run file."""

from __future__ import annotations

import math

import pytest

from bufferstand.daq.guards.trips import Action, Trip, run_status


def test_actions_are_numbers_that_the_run_file_and_the_monitor_know() -> None:
    assert {one.name: one.value for one in Action} == {
        "NOTE": 0,
        "STOP_AFTER_CYCLE": 1,
        "STOP": 2,
        "EMERGENCY": 3,
    }


def test_a_trip_blames_no_device_and_rests_on_no_belief_unless_it_says_so() -> None:
    trip = Trip("force", Action.STOP, "why", 1.5)
    assert not trip.device_fault
    assert not trip.believed
    assert trip.facts() == {"guard": "force", "action": "stop"}


def test_all_that_is_known_of_a_trip_goes_into_the_run_file() -> None:
    trip = Trip(
        "tilt", Action.EMERGENCY, "why", 1.5, 7.0, 5.0, "mm", "controller", 0, 12,
        device_fault=True, sensor="stroke_1", setting="scale", doubt="sign",
    )  # fmt: skip
    assert trip.facts() == {
        "guard": "tilt",
        "action": "emergency",
        "value": 7.0,
        "limit": 5.0,
        "sequence": 0,
        "time_us": 12,
        "unit": "mm",
        "stream": "controller",
        "sensor": "stroke_1",
        "setting": "scale",
        "doubt": "sign",
        "device_fault": True,
    }


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_stays_out_of_the_run_file(value: float) -> None:
    assert Trip("force", Action.STOP, "why", 1.5, value, 5.0).facts() == {
        "guard": "force",
        "action": "stop",
        "limit": 5.0,
    }


def test_a_run_whose_last_moment_may_be_missing_has_failed() -> None:
    ends = {
        name: run_status(Trip(name, Action.STOP, "", 0.0)) for name in ("controller", "recorder", "internal")
    }
    assert set(ends.values()) == {"failed"}
    assert run_status(Trip("force", Action.EMERGENCY, "", 0.0)) == "stopped"
