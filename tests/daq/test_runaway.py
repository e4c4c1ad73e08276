"""A runaway ends within what two round trips and two blocks explain, at every round trip, either way."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.runaway import (
    KINDS,
    ROUND_TRIPS_S,
    SPEED_MM_PER_S,
    STIFFNESS_KN_PER_MM,
    WHEN,
    When,
    run_away,
)
from bufferstand.daq.guards.trips import Action

KEPT_UP = [(kind, one) for kind in KINDS for one in ROUND_TRIPS_S if KINDS[kind].keeps_up(one)]
FEW = [("ring", one) for one in ROUND_TRIPS_S] + [
    ("ring, FC16 + FC3", 0.005),
    ("ring, command in two", 0.01),
    ("polled", 0.00004),
    ("polled", 0.005),
]
EARLY: list[tuple[str, float, When]] = [
    ("ring", 0.001, "start"),
    ("ring", 0.01, "start"),
    ("ring", 0.01, "adjust"),
    ("ring, FC16 + FC3", 0.005, "start"),
    ("ring, FC16 + FC3", 0.005, "adjust"),
    ("ring, command in two", 0.01, "start"),
    ("ring, command in two", 0.01, "adjust"),
    ("polled", 0.005, "start"),
]
KN_PER_S = STIFFNESS_KN_PER_MM * SPEED_MM_PER_S


def bounded(kind: str, round_trip_s: float, action: Action, trips: int, when: When = "late") -> None:
    found = run_away(round_trip_s, action, trips, seed=3, kind=kind, when=when)
    assert np.all(found.above_kN > 0.0), "the sample that trips is in the record"
    assert found.above_kN.max() <= found.bound_kN
    assert found.safe
    assert found.problems == ()


@pytest.mark.dose(6)
@pytest.mark.parametrize("action", [Action.EMERGENCY, Action.STOP])
@pytest.mark.parametrize(("kind", "round_trip_s"), FEW)
def test_the_peak_above_the_trip_is_explained_by_two_round_trips_and_two_blocks(
    kind: str, round_trip_s: float, action: Action
) -> None:
    bounded(kind, round_trip_s, action, 2)


@pytest.mark.dose(3)
@pytest.mark.parametrize(("kind", "round_trip_s", "when"), EARLY)
def test_so_it_is_soon_after_a_start_and_after_an_adjust(kind: str, round_trip_s: float, when: When) -> None:
    bounded(kind, round_trip_s, Action.STOP, 4, when)


@pytest.mark.long
@pytest.mark.parametrize("action", [Action.EMERGENCY, Action.STOP])
@pytest.mark.parametrize("when", WHEN)
@pytest.mark.parametrize(("kind", "round_trip_s"), KEPT_UP)
def test_so_it_is_with_every_kind_of_controller_forty_times(
    kind: str, round_trip_s: float, when: When, action: Action
) -> None:
    if when == "adjust" and not KINDS[kind].adjusts:
        return
    bounded(kind, round_trip_s, action, 40, when)


def test_the_bound_is_two_round_trips_and_two_blocks() -> None:
    assert KINDS["ring"].explained_s(0.005, 1000.0, 0.018) == pytest.approx(0.010 + 0.028)
    assert KINDS["polled"].explained_s(0.005, 50.0, 0.018) == pytest.approx(0.020 + 0.040 + 0.018)
    assert not KINDS["ring, FC16 + FC3"].keeps_up(0.01)


def test_a_hold_whose_reply_is_lost_has_held_and_the_release_follows() -> None:
    found = run_away(0.005, Action.STOP, 2, fault="the reply to the hold is lost")
    assert found.above_kN.max() <= found.bound_kN
    assert found.safe
    assert all("hold (command 1" in said and said.endswith("released at once") for said in found.problems)
    assert len(found.problems) == 2


def test_a_hold_that_is_lost_costs_the_patience_of_a_hurry_and_becomes_a_release() -> None:
    found = run_away(0.005, Action.STOP, 2, fault="the request with the hold is lost")
    assert found.above_kN.max() <= found.bound_kN + 0.1 * KN_PER_S
    assert found.safe
    assert len(found.problems) == 2


@pytest.mark.parametrize("kind", ["ring", "polled"])
def test_a_hold_that_is_acknowledged_and_not_followed_becomes_an_emergency_release(kind: str) -> None:
    found = run_away(0.001, Action.STOP, 2, kind=kind, fault="it acknowledges the hold and goes on")
    # settling and the window to see it in (45 ms), with a look or two (40 ms)
    assert found.above_kN.max() <= found.bound_kN + 0.085 * KN_PER_S
    assert found.safe
    assert all(said.startswith("the piston went on toward more force (") for said in found.problems)
    assert all(said.endswith("after the hold: released at once") for said in found.problems)
    assert len(found.problems) == 2


def test_where_the_release_is_not_followed_either_the_valve_goes_off_and_the_stop_says_what_is_left() -> None:
    found = run_away(0.001, Action.STOP, 1, fault="it acknowledges hold and release and goes on")
    assert found.above_kN.max() <= found.bound_kN + 0.17 * KN_PER_S
    assert not found.safe
    assert [said.rpartition(" after the ")[2] for said in found.problems] == [
        "hold: released at once",
        "release: valve off at once",
    ]
