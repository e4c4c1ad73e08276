"""The panel latches the first trip, lets later ones only make it stronger, and keeps what it saw."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.kinds.temperature import TemperatureGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.interfaces import SensorFault

GUARDS = GuardSet(
    (
        ChannelGuard("force", "force", 600.0, -10.0, "kN", "force", Action.EMERGENCY),
        ChannelGuard("following error", "following_error", 10.0, -10.0, "mm", "following error"),
    ),
    (
        TemperatureGuard("temperature_1", "plate 3", 40.0, 30.0, grace_s=5.0),
        TemperatureGuard("temperature_2", "air", None, None, grace_s=5.0, silence_action=Action.NOTE),
    ),
    ControllerGuard(2.0, 0.5, 1000.0),
)


def panel(guards: GuardSet = GUARDS) -> GuardPanel:
    return GuardPanel(guards, wall_s=0.0)


def samples(at_s: float, **signals: float) -> ScaledBlock:
    time_us = np.array([round(at_s * 1e6)])
    values = {name: np.array([value]) for name, value in signals.items()}
    return ScaledBlock("controller", round(at_s * 1e3), time_us, values, 0, at_s)


def temperature(at_s: float, value_C: float, name: str = "temperature_1") -> ScaledBlock:
    return ScaledBlock(name, round(at_s), np.array([round(at_s * 1e6)]), {name: np.array([value_C])}, 0, at_s)


def test_the_first_trip_is_latched_and_a_later_one_only_makes_the_action_stronger() -> None:
    watched = panel()
    watched.latch(Trip("pressure", Action.STOP_AFTER_CYCLE, "low", 1.0))
    assert watched.action is Action.STOP_AFTER_CYCLE
    watched.observe(samples(2.0, force=700.0), 2.0)
    watched.observe(samples(2.001, force=0.0), 2.001)
    assert watched.trip is not None
    assert watched.trip.guard == "pressure"
    assert watched.action is Action.EMERGENCY
    assert [trip.guard for trip in watched.said()] == ["pressure", "force"]


@pytest.mark.parametrize("stronger", [Action.STOP, Action.EMERGENCY])
def test_a_wish_for_later_gives_way_to_what_stops_the_stand(stronger: Action) -> None:
    watched = panel()
    watched.latch(Trip("operator", Action.STOP_AFTER_CYCLE, "Ada (cycle)", 1.0))
    watched.latch(Trip("operator", Action.STOP_AFTER_CYCLE, "Eve (cycle)", 1.5))
    assert watched.trip is not None
    assert watched.trip.reason == "Ada (cycle)", "as strong: the first one counts"
    watched.latch(Trip("operator", stronger, "Bert (now)", 2.0))
    assert watched.trip.reason == "Bert (now)"
    watched.latch(Trip("lag", stronger, "late", 2.5))
    assert watched.trip.reason == "Bert (now)", "it stops the stand already"


def test_a_guard_that_trips_while_a_cycle_is_waited_for_is_the_reason() -> None:
    watched = panel()
    watched.latch(Trip("operator", Action.STOP_AFTER_CYCLE, "please", 1.0))
    watched.observe(samples(2.0, force=700.0), 2.0)
    assert watched.trip is not None
    assert watched.trip.guard == "force"
    assert watched.action is Action.EMERGENCY
    assert [trip.guard for trip in watched.said()] == ["operator", "force"]


def test_the_same_guard_is_said_once_a_latch_and_again_after_a_reset() -> None:
    watched = panel()
    for sample in range(3):
        watched.observe(samples(sample / 1e3, force=700.0), 0.0)
    assert len(watched.said()) == 1
    watched.reset()
    assert (watched.trip, watched.action) == (None, Action.NOTE)
    watched.observe(samples(0.004, force=700.0), 0.0)
    assert len(watched.said()) == 1


def test_notes_are_said_and_never_latched() -> None:
    watched = panel()
    watched.latch(Trip("ring", Action.NOTE, "a gap", 0.0))
    assert watched.trip is None
    assert [trip.guard for trip in watched.said()] == ["ring"]
    assert watched.said() == []


def test_an_excess_that_began_in_one_block_goes_on_in_the_next() -> None:
    watched = panel(
        GuardSet((ChannelGuard("g", "e", 1.0, None, "mm", "e", hold_s=0.002),), GUARDS.of(ControllerGuard))
    )
    for sample in range(3):
        assert watched.trip is None
        watched.observe(samples(sample / 1e3, e=2.0), 0.0)
    assert watched.trip is not None
    assert watched.trip.sequence == 2


def test_silence_of_the_air_sensor_is_noted_once_and_that_of_the_specimens_stops() -> None:
    watched = panel()
    for second in range(1, 8):
        watched.observe(samples(second, force=0.0), second)
        watched.observe(temperature(second, 25.0), second)
        watched.listen(second, second)
    said = [trip for trip in watched.said() if trip.guard == "temperature_2"]
    assert [trip.action for trip in said] == [Action.NOTE]
    watched.complain(SensorFault("temperature_1", 8.0, "CRC wrong"))
    watched.observe(samples(13.0, force=0.0), 13.0)
    watched.listen(13.0, 13.0)
    assert watched.trip is not None or watched.action is Action.EMERGENCY
    assert any("CRC wrong" in trip.reason for trip in watched.said())


def test_resuming_needs_the_resume_threshold_not_only_the_stop() -> None:
    watched = panel()
    assert "no reading yet" in watched.warmer_than()
    watched.observe(temperature(1.0, 35.0), 1.0)
    assert watched.trip is None
    assert watched.warmer_than() == (
        "temperature_1 (plate 3) is at 35.00 °C, to go on it must be at or below 30 °C"
    )
    assert watched.warmer_than(36.0) == ""
    watched.observe(temperature(2.0, 30.0), 2.0)
    assert watched.warmer_than() == ""


def test_while_cooling_heat_does_not_trip_but_silence_does() -> None:
    watched = panel(GUARDS.cooling())
    watched.observe(temperature(1.0, 45.0), 1.0)
    assert watched.trip is None
    watched.listen(7.0, 7.0)
    assert watched.trip is not None
    assert watched.trip.guard == "temperature_1"


def test_with_the_valve_off_nothing_follows_a_command() -> None:
    watched = panel(GUARDS.valve_off())
    watched.observe(samples(1.0, following_error=50.0, force=0.0), 1.0)
    assert watched.trip is None
    watched.change(GUARDS)
    watched.observe(samples(1.001, following_error=50.0, force=0.0), 1.0)
    assert watched.trip is not None


def test_the_guards_travel_as_plain_data() -> None:
    content = GUARDS.as_dict()
    assert json.loads(json.dumps(content)) == content
    assert content["channels"][0]["action"] == "emergency"
    assert content["temperatures"][1]["silence_action"] == "note"
