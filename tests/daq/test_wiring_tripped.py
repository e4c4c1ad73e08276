"""A limit's trip is explained where the wiring has led to it, and stands as it is where it has not."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.guards.wiring.doubt import SignalDoubt
from bufferstand.daq.guards.wiring.sample_stretch import Floats, SampleStretch
from bufferstand.daq.guards.wiring.settings import ForceCurve, WiringGuard
from bufferstand.daq.guards.wiring.trip_reason import tripped_by
from tests.daq.wiring_bench import Case, judge, scaled, signals_of

RATE_HZ, SECOND_BEHIND_S = 200.0, 0.02
TIME = np.arange(0.0, 4.0, 1.0 / RATE_HZ)
SPEED, SPRING = 25.0, 2.0
"""Of the piston from 2 s on [mm/s], and of the specimen [kN/mm]."""

CURVE = ForceCurve((0.0, 100.0), (0.0, 200.0), (0.0, 200.0), 21.0, 41.0, 1.1, "spring model")
GUARD = WiringGuard(frame_kN_per_mm=150.0, curve=CURVE)


def right() -> dict[str, Floats]:
    random = np.random.default_rng(5)
    way = SPEED * np.maximum(TIME - 2.0, 0.0)
    force = SPRING * way
    stroke = way - force / 150.0
    values = {"command": way, "position": way, "stroke_1": stroke, "stroke_2": stroke, "force": force}
    noise = {"command": 0.0, "force": 0.1}
    return {
        name: value + noise.get(name, 0.01) * random.standard_normal(len(TIME))
        for name, value in values.items()
    }


def asked(
    guard: str, values: Mapping[str, Floats], until: int, second: Floats | None = None
) -> SignalDoubt | None:
    rows = slice(0, until)
    own = {name: value[rows] for name, value in values.items()}
    behind = until - round(SECOND_BEHIND_S * RATE_HZ)
    beside = (TIME[:0], TIME[:0]) if second is None else (TIME[:behind], second[:behind])
    value = float(own["force"][-1]) if guard == "force" else float(own["stroke_1"][-1] - own["stroke_2"][-1])
    trip = Trip(guard, Action.STOP, "it exceeds its limit", 1.0, value=value)
    return tripped_by(GUARD, trip, SampleStretch(TIME[rows], own, *beside), {}, None)


def until_apart(values: Mapping[str, Floats], mm: float = 5.0) -> int:
    return int(np.argmax(np.abs(values["stroke_1"] - values["stroke_2"]) > mm)) + 10


def moved(by_s: float) -> dict[str, Floats]:
    values = right()
    values["stroke_2"] = np.interp(TIME - by_s, TIME, values["stroke_2"])
    return values


@pytest.mark.parametrize(("late_s", "kind"), [(0.25, "delay"), (0.7, "still")])
def test_a_tilt_is_explained_by_a_wire_that_is_late(late_s: float, kind: str) -> None:
    values = moved(late_s)
    doubt = asked("tilt", values, until_apart(values) + 20)
    assert doubt is not None
    assert (doubt.sensor, doubt.kind) == ("stroke_2", kind), doubt.text
    assert "delay_s" in doubt.setting


@pytest.mark.parametrize(("by", "kind"), [(-1.0, "sign"), (0.5, "scale"), (0.03, "still"), (2.0, "scale")])
def test_a_tilt_is_explained_by_sign_scale_and_standstill_of_a_wire(by: float, kind: str) -> None:
    values = right()
    values["stroke_1"] = by * values["stroke_1"]
    doubt = asked("tilt", values, until_apart(values))
    assert doubt is not None
    assert (doubt.sensor, doubt.kind) == ("stroke_1", kind), doubt.text


@pytest.mark.parametrize("share", [0.15, 0.3, -0.3])
def test_a_plate_that_tilts_about_its_middle_stays_a_tilt(share: float) -> None:
    values = right()
    values["stroke_1"], values["stroke_2"] = (
        (1.0 + share) * right()["stroke_1"],
        (1.0 - share) * values["stroke_2"],
    )
    assert asked("tilt", values, until_apart(values)) is None


@pytest.mark.parametrize("hinge", ["slowly", "at once"])
def test_a_plate_that_gives_way_at_one_side_stays_a_tilt(hinge: str) -> None:
    values = right()
    gone = np.maximum(TIME - 2.6, 0.0)
    values["stroke_2"] = values["stroke_2"] - (
        8.0 * gone if hinge == "slowly" else 6.0 * np.minimum(gone / 0.1, 1.0)
    )
    assert asked("tilt", values, until_apart(values)) is None


def test_a_tilt_by_exchanged_inputs_is_explained_before_the_second_force_comes() -> None:
    values = right()
    force = np.minimum(120.0 * values["position"], 11.0 + SPRING * values["position"])  # a preload of 11 kN
    values["force"], values["stroke_1"] = values["stroke_1"], force
    doubt = asked("tilt", values, until_apart(values), force)
    assert doubt is not None
    assert (doubt.sensor, doubt.kind) == ("force, stroke_1", "swapped")


@pytest.mark.parametrize(("by", "kind"), [(-1.0, "sign"), (10.0, "scale")])
def test_a_force_that_turns_or_leaps_in_motion_is_explained_by_the_second_one(by: float, kind: str) -> None:
    values = right()
    at = int(3.0 * RATE_HZ)
    second = values["force"].copy()
    values["force"] = np.where(np.arange(len(TIME)) < at, second, by * second)
    doubt = asked("force", values, at + 3, second)
    assert doubt is not None
    assert (doubt.sensor, doubt.kind) == ("force", kind), doubt.text
    assert f"force_2 reads {np.mean(second[at - 4 : at - 1]):+.1f} kN" in doubt.text


@pytest.mark.parametrize("stiff_kN_per_mm", [2.0, 60.0, 150.0])
def test_a_force_that_both_show_stays_a_force(stiff_kN_per_mm: float) -> None:
    values = right()
    hit = np.maximum(values["command"] - 20.0, 0.0)
    values["force"] = values["force"] + stiff_kN_per_mm * hit  # the specimen blocks
    until = int(np.argmax(values["force"] > 60.0)) + 1
    assert asked("force", values, until, values["force"]) is None


@pytest.mark.parametrize("counted", [True, False])
def test_a_stroke_that_a_force_ten_times_too_large_turns_back_early_is_doubted(counted: bool) -> None:
    signals = signals_of(Case(static_mm=2.8, sines=(), second=False, counted=counted))
    trip = judge(scaled("force", by=10.0)(signals)).trip
    assert trip is not None
    assert (trip.sensor, trip.doubt, "turns back" in trip.reason) == ("force", "scale", True), trip.reason
    assert judge(signals).trip is None
    stiffer = signals_of(Case(static_mm=2.8, sines=(), second=False, counted=counted, factor=1.4))
    assert judge(stiffer).trip is None
