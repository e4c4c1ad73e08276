"""One cause, one name: a wrong force is not told as a wire or as late; and a motion's end is judged, too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.daq.guards.trips import Trip
from bufferstand.daq.guards.wiring.wiring_watch import WiringWatch
from bufferstand.daq.scaling import ScaledBlock
from tests.daq.wiring_bench import Case, Signals, guard_of, judge, scaled, signals_of
from tests.daq.wiring_kinds import WIRED

UNKNOWN = Case(knows_model=False, second=False, sines=())
"""No model, no second force, one slow stroke."""


@pytest.mark.parametrize("counted", [True, False])
def test_a_force_far_too_large_is_not_told_as_a_wire_where_nothing_else_knows_it(counted: bool) -> None:
    signals = signals_of(replace(UNKNOWN, counted=counted))
    trip = judge(scaled("force", by=10.0)(signals)).trip
    assert trip is not None
    assert (trip.sensor, trip.doubt) == ("force", "scale"), trip.reason
    assert "machine_stiffness_kN_per_mm" in trip.setting
    assert judge(signals).trip is None


@pytest.mark.parametrize("by", [0.1, 0.25])
def test_nor_one_far_too_small_as_wires_that_are_late(by: float) -> None:
    """It is not told at all: the page of the guards says so."""
    assert judge(scaled("force", by=by)(signals_of(UNKNOWN))).trip is None


@pytest.mark.parametrize("by_s", [0.1, 0.2])
def test_wires_that_are_late_are_told_nevertheless(by_s: float) -> None:
    signals = signals_of(UNKNOWN)
    late = {
        name: np.interp(signals.time_s - by_s, signals.time_s, value)
        for name, value in signals.values.items()
        if name.startswith("stroke")
    }
    trip = judge(replace(signals, values={**signals.values, **late})).trip
    assert trip is not None
    assert (trip.sensor, trip.doubt) == ("stroke_1, stroke_2", "delay"), trip.reason


def test_both_wires_of_one_wrong_scale_are_no_wrong_force() -> None:
    trip = judge(scaled("stroke_1", "stroke_2", by=1.2)(signals_of(UNKNOWN))).trip
    assert trip is not None
    assert trip.sensor == "stroke_1, stroke_2", trip.reason


def test_a_force_that_jumps_as_the_specimen_goes_back_is_not_late() -> None:
    signals = signals_of(Case(second=False, sines=()))
    turn_s = float(signals.time_s[int(np.argmax(signals.true_mm))])
    trip = judge(scaled("force", by=3.0, from_s=turn_s + 0.6)(signals)).trip
    assert trip is not None
    assert (trip.sensor, trip.doubt) == ("force", "disagrees"), trip.reason
    assert "late" not in trip.reason


def seen(signals: Signals, end_s: float = np.inf) -> tuple[WiringWatch, list[Trip]]:
    """Return what has judged signals up to a moment, in blocks of 0.03 s, and all that it said."""
    watch, guard, trips = WiringWatch(), guard_of(signals), []
    if signals.case.counted:
        watch.rebase(counted=True)
    end_s = min(end_s, float(signals.time_s[-1]))
    for begin_s in np.arange(0.0, end_s, 0.03):
        for stream, time_s, values in (
            ("controller", signals.time_s, signals.values),
            ("amplifier", signals.second_s, {"force_2": signals.second_kN}),
        ):
            rows = (time_s >= begin_s) & (time_s < min(begin_s + 0.03, end_s))
            if rows.any():
                stamps = np.rint(time_s[rows] * 1e6).astype(np.int64)
                part = {name: value[rows] for name, value in values.items()}
                block = ScaledBlock(stream, 0, stamps, part, 0, begin_s + 0.03)
                of_controller = stream == "controller"
                trips += watch.observe(guard, block, {}, controller=of_controller, device_clock=True)
    return watch, trips


@pytest.mark.dose(3)
@pytest.mark.parametrize("counted", [True, False])
@pytest.mark.parametrize("name", ["force and wire exchanged", "force: 0.8 s late", "force: zero 5 kN off"])
def test_what_is_wrong_with_a_force_is_said_once_and_nothing_else_beside_it(name: str, counted: bool) -> None:
    kind = WIRED[name]
    signals = kind.wrong(signals_of(Case(counted=counted, sines=())))
    trips = seen(signals)[1]
    first = trips[0]
    assert set(kind.sensors[0].split(", ")) <= set(
        first.sensor.split(", ")
    )  # of a zero, both without a touch
    assert [trip.sensor for trip in trips if trip.at_s < first.at_s + 2.0] == [first.sensor]


# --- the end of a motion --------------------------------------------------------------------------------


def told_or_begun(signals: Signals, end_s: float) -> bool:
    """Return whether signals up to a moment are doubted once they are looked at once more, or begin to be."""
    watch, trips = seen(signals, end_s)
    assert not trips
    return bool(watch.look_once_more(guard_of(signals), {}, end_s)) or watch.begun


@pytest.mark.parametrize(("name", "by"), [("force", 3.0), ("force_2", 0.5)])
@pytest.mark.parametrize("before_s", [0.02, 0.06, 0.12])
def test_what_goes_wrong_in_the_last_moment_of_a_motion_is_waited_for(
    name: str, by: float, before_s: float
) -> None:
    right = signals_of(Case(static_mm=40.0, sines=()))
    end_s = float(right.time_s[int(np.argmax(right.true_mm))]) - 0.2
    assert not told_or_begun(right, end_s)
    assert told_or_begun(scaled(name, by=by, from_s=end_s - before_s)(right), end_s)
