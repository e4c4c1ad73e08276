"""What goes wrong after the first contact is named with its sensor and setting within seconds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bufferstand.daq.guards.trips import Action
from bufferstand.daq.guards.wiring.forces.jumped_channel import farther
from bufferstand.daq.guards.wiring.settings import WiringGuard
from bufferstand.daq.guards.wiring.temperatures.heat import HeatJudge
from bufferstand.daq.scaling import ScaledBlock
from tests.daq.wiring_bench import Case, Signals, exchanged, judge, scaled, signals_of
from tests.daq.wiring_kinds import plain_case
from tests.daq.wiring_later import LATER_ON, judged, rough_alarms

ALWAYS = (
    "force_2 freezes, unloading", "force_2 freezes in a sine", "force +5 kN, loading",
    "force −5 kN in a sine", "force_2 +5 kN, loading", "force half as much at once", "piston 0.5 s late",
    "piston slips by 8 mm, loading", "piston slips by −8 mm, loading", "piston slips by 8 mm, unloading",
    "piston 1.1 times at once, loading", "piston 1.1 times at once, unloading",
    "wire 0.5 s late", "wires 0.3 s late", "wires 0.8 s late",
)  # fmt: skip


@cache
def usual() -> Signals:
    return signals_of(Case(static_mm=40.0, sines=((25.0, 10.0, 1.0, 4),), force_2_Hz=250.0))


def _named(name: str, signals: Signals) -> None:
    later = LATER_ON[name]
    verdict, after_s = judged(later, signals)
    assert verdict.trip is not None
    assert (verdict.trip.sensor, verdict.trip.action) == (later.sensor, Action.STOP), verdict.trip.reason
    assert verdict.trip.doubt in later.doubts
    assert later.key in verdict.trip.setting
    assert 0.0 < after_s < later.within_s + 1.5


@pytest.mark.parametrize("name", ALWAYS)
def test_the_right_sensor_is_named_within_seconds(name: str) -> None:
    _named(name, usual())


@pytest.mark.long
@pytest.mark.parametrize("name", LATER_ON)
@pytest.mark.parametrize("seed", [2, 3, 4])
def test_and_on_stands_at_random(name: str, seed: int) -> None:
    if "sine" in name:
        pytest.skip("which of both jumps where the specimen is lost in each cycle nobody can tell")
    signals = signals_of(replace(plain_case(seed), force_2_Hz=250.0, static_mm_per_s=5.0))
    verdict, _ = judged(LATER_ON[name], signals)
    assert verdict.trip is not None
    assert verdict.trip.sensor == LATER_ON[name].sensor, verdict.trip.reason


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("piston slips by 8 mm, unloading", "leapt by +8.0 mm"),
        ("piston slips by −8 mm, loading", "leapt by -8.0 mm"),
        ("piston 1.1 times at once, loading", "changed to 1.10 times"),
    ],
)
def test_a_position_that_leaps_is_told_with_its_millimetres_and_not_as_late(name: str, words: str) -> None:
    verdict, _ = judged(LATER_ON[name], usual())
    assert verdict.trip is not None
    assert words in verdict.trip.reason
    assert "late" not in verdict.trip.reason
    assert "delay_s" not in verdict.trip.setting


def test_force_and_position_with_each_others_inputs_are_named_once_they_move() -> None:
    signals = signals_of(Case(counted=False))
    trip = judge(exchanged("force", "position")(signals)).trip
    assert trip is not None
    assert (trip.sensor, trip.doubt) == ("force, position", "swapped")
    standing = judge(exchanged("force", "position")(usual())).trip
    assert standing is not None
    assert standing.sensor == "position"
    assert "if it stays so in motion, they are exchanged" in standing.reason


@pytest.mark.parametrize("counted", [True, False])
def test_a_wire_in_inches_is_named_by_its_scale_once_it_moves(counted: bool) -> None:
    trip = judge(scaled("stroke_1", by=25.4)(signals_of(Case(counted=counted)))).trip
    assert trip is not None
    assert (trip.sensor, trip.doubt) == ("stroke_1", "scale")
    assert "inches" in trip.reason


def test_holes_stalls_hum_and_slow_amplifiers_are_no_doubt() -> None:
    assert rough_alarms((23,)) == []


@pytest.mark.long
def test_two_hundred_rough_stands_are_not_doubted() -> None:
    assert rough_alarms(range(200)) == []


@pytest.mark.parametrize(("first", "second", "named"), [(50.0, 100.0, "force"), (100.0, 30.0, "force_2")])
def test_the_curve_names_one_of_two_forces_only_where_it_is_decisive(
    first: float, second: float, named: str
) -> None:
    assert farther(first, second, 100.0) == named
    assert farther(1.4 * first, 1.4 * second, 100.0) in (named, "force, force_2")
    assert farther(0.6 * first, 0.6 * second, 100.0) in (named, "force, force_2")
    assert farther(80.0, 100.0, 100.0) == "force, force_2"


@pytest.mark.parametrize(("own_C", "asked"), [(12.0, 1), (18.5, 0), (35.0, 0)])
def test_a_specimen_colder_than_the_air_is_asked_about_once_and_stops_nothing(
    own_C: float, asked: int
) -> None:
    guard, judge = WiringGuard(specimen=("temperature_1",), ambient=("temperature_3",)), HeatJudge()
    doubts = []
    for second in range(10):
        for name, value in (("temperature_3", 22.0), ("temperature_1", own_C)):
            time_us = np.array([second * 1_000_000])
            block = ScaledBlock(name, second, time_us, {name: np.array([value])}, 0, float(second))
            doubts.append(judge.take(guard, block, value))
    said = [doubt for doubt in doubts if doubt is not None]
    assert len(said) == asked
    assert all(doubt.asks and doubt.sensor == "temperature_1" for doubt in said)
    assert all("12.0 °C at the start, temperature_3 in the air 22.0 °C" in doubt.text for doubt in said)
