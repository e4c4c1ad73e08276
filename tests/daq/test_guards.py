"""Every guard trips at the right sample, remembers nothing it should not, and says why."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.guards.kinds.agreement import AgreementGuard, AgreementMemory, evaluate_agreement
from bufferstand.daq.guards.kinds.channel import ChannelGuard, ChannelMemory, evaluate_channel
from bufferstand.daq.guards.kinds.controller import (
    ControllerGuard,
    ControllerMemory,
    evaluate_controller_silence,
    evaluate_gap,
    evaluate_status,
)
from bufferstand.daq.guards.kinds.temperature import (
    TemperatureGuard,
    TemperatureMemory,
    evaluate_fault,
    evaluate_reading,
    evaluate_silence,
)
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock, scale
from bufferstand.drivers.interfaces import (
    ControllerStatus,
    EndReason,
    MotionState,
    SampleBlock,
    SensorFault,
)
from tests.daq.fake_stand import CONTROLLER_FACTS

FORCE = ChannelGuard("force", "force", 600.0, -10.0, "kN", "force (transducer, rod end)")
SLOW = ChannelGuard("following error", "e", 10.0, -10.0, "mm", "following error", hold_s=0.005)
SENSOR = TemperatureGuard("temperature_1", "spring plate 3", 40.0, 30.0, grace_s=5.0)


def block(
    values: list[float] | np.ndarray, signal: str = "force", first: int = 1, stream: str = "controller"
) -> ScaledBlock:
    value = np.asarray(values, dtype=np.float64)
    time_us = (first + np.arange(len(value), dtype=np.int64)) * 1000
    return ScaledBlock(stream, first, time_us, {signal: value}, 0, float(first) / 1e3)


def run(guard: ChannelGuard, values: np.ndarray, sizes: list[int]) -> Trip | None:
    """Return the first trip when a signal comes in blocks of the given sizes."""
    memory, at, trip = ChannelMemory(), 0, None
    for size in sizes:
        memory, new = evaluate_channel(guard, memory, block(values[at : at + size], guard.signal, at + 1))
        trip = trip or new
        at += size
    return trip


def test_the_first_sample_beyond_the_limit_trips_and_is_named() -> None:
    _, trip = evaluate_channel(FORCE, ChannelMemory(), block([0.0, 599.9, 600.0, 612.34, 700.0], first=41))
    assert trip is not None
    assert (trip.sequence, trip.time_us, trip.value, trip.limit) == (44, 44000, 612.34, 600.0)
    assert trip.reason == (
        "force (transducer, rod end) 612.34 kN exceeds the limit of 600.00 kN "
        "(sample 44 at 0.044 s of the device's clock)"
    )
    assert trip.action is Action.STOP
    assert not trip.device_fault


def test_below_the_lower_limit_names_the_lower_limit() -> None:
    _, trip = evaluate_channel(FORCE, ChannelMemory(), block([0.0, -10.5]))
    assert trip is not None
    assert trip.limit == -10.0
    assert "-10.50 kN is below the limit of -10.00 kN" in trip.reason


def test_the_limit_itself_does_not_trip() -> None:
    assert evaluate_channel(FORCE, ChannelMemory(), block([600.0, -10.0]))[1] is None


def test_a_value_that_is_no_number_is_an_excess_without_a_value() -> None:
    _, trip = evaluate_channel(FORCE, ChannelMemory(), block([0.0, np.nan]))
    assert trip is not None
    assert (trip.sequence, trip.value) == (2, None)
    assert "is not a number" in trip.reason


def test_a_sustained_excess_trips_once_it_has_lasted_and_a_shorter_one_never() -> None:
    values = np.zeros(40)
    values[5:10] = 11.0  # 5 samples at 1 kHz last 4 ms from first to last
    assert run(SLOW, values, [40]) is None
    values[5:11] = 11.0
    trip = run(SLOW, values, [40])
    assert trip is not None
    assert trip.sequence == 11
    assert "for 0.005 s" in trip.reason


def test_an_interruption_begins_the_count_anew() -> None:
    values = np.full(20, 11.0)
    values[4] = 0.0
    trip = run(SLOW, values, [20])
    assert trip is not None
    assert trip.sequence == 11  # beyond since sample 6


@given(
    bad=st.lists(st.booleans(), min_size=1, max_size=30),
    cuts=st.lists(st.integers(1, 9), min_size=1, max_size=12),
    hold_ms=st.integers(0, 8),
)
def test_how_the_samples_are_cut_into_blocks_changes_nothing(
    bad: list[bool], cuts: list[int], hold_ms: int
) -> None:
    guard = ChannelGuard("g", "e", 10.0, None, "mm", "e", hold_s=hold_ms / 1e3)
    values = np.where(bad, 11.0, 0.0)
    sizes, left = [], len(values)
    for cut in cuts:
        sizes.append(min(cut, left))
        left -= sizes[-1]
    sizes.append(left)
    whole, cut_up = run(guard, values, [len(values)]), run(guard, values, sizes)
    run_length, expected = 0, None
    for number, is_bad in enumerate(bad, start=1):
        run_length = run_length + 1 if is_bad else 0
        if run_length > hold_ms and expected is None:
            expected = number
    assert (whole and whole.sequence) == (cut_up and cut_up.sequence) == expected


def test_a_block_without_the_signal_keeps_the_memory() -> None:
    memory = ChannelMemory(since_us=7)
    assert evaluate_channel(FORCE, memory, block([1.0], "stroke")) == (memory, None)
    assert evaluate_channel(FORCE, memory, block([])) == (memory, None)


def test_derived_signals_have_the_sign_of_their_names() -> None:
    counts = {"force": 1000, "stroke_1": 1200, "stroke_2": 1000, "position": 900, "command": 1000}
    raw = SampleBlock(
        "controller", 1, np.array([1000]), {k: np.array([v]) for k, v in counts.items()}, 0, 0.0
    )
    values = scale(raw, CONTROLLER_FACTS).values
    assert values["force"] == pytest.approx([1.0])
    assert values["stroke"] == pytest.approx([11.0])
    assert values["tilt"] == pytest.approx([2.0])
    assert values["following_error"] == pytest.approx([1.0])


# --- temperature -------------------------------------------------------------------------------------


def reading(value_C: float, number: int) -> ScaledBlock:
    stamp = np.array([number * 1_000_000], dtype=np.int64)
    return ScaledBlock(
        "temperature_1", number, stamp, {"temperature_1": np.array([value_C])}, 0, float(number)
    )


def hear(*values: float | None, guard: TemperatureGuard = SENSOR) -> tuple[TemperatureMemory, Trip | None]:
    """Give one reading a second (None: silence); return the memory and the first trip of any sort."""
    memory, first = TemperatureMemory(0.0), None
    for second, value in enumerate(values):
        trips = []
        if value is not None:
            memory, trip = evaluate_reading(guard, memory, reading(value, second), float(second))
            trips.append(trip)
        memory, trip = evaluate_silence(guard, memory, float(second), float(second))
        first = first or next((t for t in [*trips, trip] if t), None)
    return memory, first


def test_forty_degrees_reached_is_tripped_and_a_sixteenth_less_is_not() -> None:
    assert hear(39.0, 39.9375)[1] is None
    _, trip = hear(39.0, 39.9375, 40.0)
    assert trip is not None
    assert (trip.value, trip.limit, trip.sequence) == (40.0, 40.0, 2)
    assert trip.reason.startswith(
        "temperature_1 (spring plate 3) 40.00 °C has reached the stop threshold of 40 °C"
    )


def test_silence_trips_after_its_grace_and_names_the_last_true_reading() -> None:
    assert hear(25.0, None, None, None, None, None)[1] is None
    _, trip = hear(25.0, None, None, None, None, None, None)
    assert trip is not None
    assert trip.device_fault
    assert trip.value == pytest.approx(6.0)
    assert "no true reading for 6.0 s (limit 5 s; last true reading 25.00 °C)" in trip.reason


def test_a_sensor_that_never_spoke_trips_as_well() -> None:
    _, trip = hear(*[None] * 8)
    assert trip is not None
    assert "never" in trip.reason


def test_the_power_on_value_is_no_reading_and_trips_by_silence_not_by_heat() -> None:
    assert hear(25.0, 85.0, 85.0, 25.0625, None)[1] is None  # a single slip within the grace
    _, trip = hear(25.0, *[85.0] * 6)
    assert trip is not None
    assert "power-on value" in trip.reason
    assert trip.value == pytest.approx(6.0)


def test_a_true_reading_of_85_degrees_on_the_way_up_is_believed() -> None:
    guard = TemperatureGuard("temperature_1", "", 90.0, 30.0, grace_s=5.0)
    memory, trip = hear(84.0, 85.0, guard=guard)
    assert trip is None
    assert memory.value_C == 85.0


@pytest.mark.parametrize("value", [-55.0625, 127.9375, np.nan])
def test_what_the_sensor_cannot_measure_is_no_reading(value: float) -> None:
    memory, _ = hear(25.0, value)
    assert memory.value_C == 25.0
    _, trip = hear(25.0, *[value] * 6)
    assert trip is not None
    assert "outside the sensor's range" in trip.reason


def test_a_repeated_reading_does_not_end_the_silence() -> None:
    memory, _ = evaluate_reading(SENSOR, TemperatureMemory(0.0), reading(25.0, 1), 1.0)
    memory, _ = evaluate_reading(SENSOR, memory, reading(25.0, 1), 6.5)
    _, trip = evaluate_silence(SENSOR, memory, 6.5, 6.5)
    assert trip is not None
    assert "repeats its reading" in trip.reason


def test_the_drivers_complaint_explains_the_silence() -> None:
    memory = evaluate_fault(
        TemperatureMemory(0.0), SensorFault("temperature_1", 1.0, "CRC wrong: check the cable")
    )
    _, trip = evaluate_silence(SENSOR, memory, 6.0, 6.0)
    assert trip is not None
    assert trip.reason.endswith("CRC wrong: check the cable")


def test_a_reading_that_never_changes_is_noted_once() -> None:
    guard = TemperatureGuard("temperature_1", "", 40.0, 30.0, grace_s=5.0, frozen_s=3.0)
    memory, notes = TemperatureMemory(0.0), []
    for second in range(10):
        memory, _ = evaluate_reading(guard, memory, reading(25.0, second), float(second))
        memory, trip = evaluate_silence(guard, memory, float(second), float(second))
        notes += [trip] if trip else []
    assert [note.action for note in notes] == [Action.NOTE]
    assert "exactly 25.0000 °C for 4 s" in notes[0].reason


# --- the controller and the second way to the force --------------------------------------------------


def snapshot(**changes: object) -> ControllerStatus:
    facts: dict[str, object] = {
        "state": MotionState.WAVEFORM, "fault_code": 0, "done_sequence": 1, "end_reason": EndReason.NONE,
        "cycles_done": 0, "heartbeat": 1, "watchdog_trips": 3, "force_kN": 12.0, "stroke_mm": 3.0,
        "position_mm": 3.0, "command_mm": 3.0,
    }  # fmt: skip
    return ControllerStatus(**(facts | changes))  # type: ignore[arg-type]


def test_few_lost_samples_are_a_note_and_many_a_stop() -> None:
    guard = ControllerGuard(2.0, 0.5, 1000.0)
    few = evaluate_gap(guard, ScaledBlock("controller", 100, np.array([100_000]), {}, 500, 0.1))
    many = evaluate_gap(guard, ScaledBlock("controller", 700, np.array([700_000]), {}, 501, 0.7))
    assert evaluate_gap(guard, block([1.0])) is None
    assert few is not None
    assert many is not None
    assert (few.action, few.device_fault) == (Action.NOTE, False)
    assert (many.action, many.device_fault) == (Action.STOP, True)
    assert "501 samples (501 ms) were lost before sample 700" in many.reason


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"watchdog_trips": 4}, "its watchdog ran out"),
        ({"fault_code": 4, "state": MotionState.FAULT}, "fault 4 (actuator)"),
        ({"state": MotionState.FAULT}, "fault 0"),
        ({"end_reason": EndReason.DEVICE_LIMIT, "done_sequence": 2}, "ended by device limit"),
        ({"end_reason": EndReason.WATCHDOG, "done_sequence": 2}, "ended by watchdog"),
    ],
)
def test_a_controller_that_acts_by_itself_trips(changes: dict[str, object], said: str) -> None:
    memory, calm = evaluate_status(ControllerMemory(0.0, 0.0), snapshot(), 0.0, 0.0)
    assert calm is None
    _, trip = evaluate_status(memory, snapshot(**changes), 1.0, 1.0)
    assert trip is not None
    assert said in trip.reason
    assert (trip.action, trip.device_fault) == (Action.EMERGENCY, True)


def test_trips_and_ends_from_before_we_came_are_not_ours() -> None:
    old = snapshot(end_reason=EndReason.WATCHDOG, watchdog_trips=9)
    memory, first = evaluate_status(ControllerMemory(0.0, 0.0), old, 0.0, 0.0)
    assert first is None
    assert evaluate_status(memory, old, 1.0, 1.0)[1] is None


def test_a_fault_from_before_is_forgiven_until_it_is_switched_on_or_becomes_another() -> None:
    old = snapshot(fault_code=2, state=MotionState.FAULT, force_kN=0.4)
    memory, first = evaluate_status(ControllerMemory(0.0, 0.0), old, 0.0, 0.0)
    assert first is not None
    assert first.action is Action.NOTE
    assert "shows fault 2 (force limit of the device) from before this start" in first.reason
    assert evaluate_status(memory, old, 1.0, 1.0)[1] is None
    other = snapshot(fault_code=4, state=MotionState.FAULT, force_kN=0.4)
    became = evaluate_status(memory, other, 1.0, 1.0)[1]
    assert became is not None
    assert became.action is Action.EMERGENCY
    gone, none = evaluate_status(memory, snapshot(), 1.0, 1.0)
    assert none is None
    again = evaluate_status(gone, old, 2.0, 2.0)[1]
    assert again is not None
    assert "it reports fault 2" in again.reason
    stays = evaluate_status(replace(memory, forgiven=None), old, 2.0, 2.0)[1]
    assert stays is not None, "switching on should have reset it"


@pytest.mark.parametrize(
    "shown",
    [
        {"state": MotionState.FAULT, "force_kN": 5.1},
        {"state": MotionState.FAULT, "force_kN": math.nan},
        {"state": MotionState.RELEASING, "force_kN": 1.0},
    ],
)
def test_a_fault_from_before_with_force_or_valve_on_refuses(shown: dict[str, object]) -> None:
    _, trip = evaluate_status(ControllerMemory(0.0, 0.0), snapshot(fault_code=2, **shown), 0.0, 0.0)
    assert trip is not None
    assert (trip.action, trip.device_fault) == (Action.EMERGENCY, True)
    assert "see that the specimen is unloaded, then start again" in trip.reason


def test_a_heartbeat_that_stands_and_samples_that_stop_are_silence() -> None:
    guard = ControllerGuard(2.0, 0.5, 1000.0)
    memory, _ = evaluate_status(ControllerMemory(0.0, 0.0), snapshot(), 0.0, 0.0)
    memory, _ = evaluate_status(memory, snapshot(), 2.5, 2.5)
    beats = ControllerMemory(2.5, memory.heartbeat_s, 1)
    trip = evaluate_controller_silence(guard, beats, 2.5, 2.5)
    assert trip is not None
    assert "does not count its heartbeat for 2.5 s" in trip.reason
    trip = evaluate_controller_silence(guard, ControllerMemory(0.0, 2.5), 2.5, 2.5)
    assert trip is not None
    assert "delivers no new samples for 2.5 s" in trip.reason
    assert evaluate_controller_silence(guard, ControllerMemory(1.0, 1.0), 2.5, 2.5) is None


def agree(
    differences_kN: list[float], *, latency_s: float = 0.0, force_kN: float = 100.0, sweep_kN: float = 0.0
) -> list[Trip]:
    """Give both streams for windows of 2 s, one difference each; the device's clock began 1000 s later."""
    guard = AgreementGuard(6.0, window_s=2.0, windows=3)
    memory, trips = AgreementMemory(), []
    for tenth in range(20 * len(differences_kN) + 1):
        time_s = tenth / 10 + np.arange(10) / 100
        force = force_kN + sweep_kN * np.sin(2 * np.pi * 1.7 * time_s)
        wrong = differences_kN[min(len(differences_kN) - 1, tenth // 20)]
        late_s = time_s + latency_s
        blocks = (
            ScaledBlock("controller", tenth, np.round((time_s - 1000) * 1e6).astype(np.int64),
                        {"force": force + wrong}, 0, float(time_s[-1])),
            ScaledBlock("amplifier", tenth, np.round(late_s * 1e6).astype(np.int64), {"force_2": force}, 0,
                        float(late_s[-1])),
        )  # fmt: skip
        for scaled in blocks:
            memory, trip = evaluate_agreement(
                guard, memory, scaled, device_clock=scaled.stream == "controller"
            )
            trips += [trip] if trip else []
    return trips


def test_two_forces_that_disagree_for_long_are_a_note_with_the_sign() -> None:
    assert agree([5.9] * 8) == []
    assert agree([6.1] * 2 + [0.0] + [6.1] * 2) == []  # never three in a row
    first = agree([6.1] * 3)[0]
    assert first.action is Action.NOTE
    assert "differ by +6.10 kN in the mean of 2 s, 3 times in a row" in first.reason
    assert "differ by -7.00 kN" in agree([-7.0] * 3)[0].reason
    assert len(agree([7.0] * 7)) == 2  # said again, not at every window


def test_differences_that_change_their_sign_are_the_clocks_not_the_calibration() -> None:
    assert agree([9.0, -9.0] * 6) == []


def test_the_latency_of_the_wire_is_no_disagreement() -> None:
    assert agree([0.0] * 8, latency_s=0.02, sweep_kN=200.0) == []
    assert len(agree([15.0] * 4, latency_s=0.02, sweep_kN=200.0)) == 1


def test_a_window_in_which_one_of_them_is_missing_says_nothing() -> None:
    guard = AgreementGuard(1.0, window_s=1.0, windows=1)
    memory = AgreementMemory()
    for second in range(1, 6):
        scaled = block([500.0], first=second * 1000)
        memory, trip = evaluate_agreement(guard, memory, scaled, device_clock=True)
        assert trip is None
    for second in range(100):
        memory, _ = evaluate_agreement(guard, memory, block([1.0], first=second * 1000), device_clock=True)
    assert len(memory.sums["force"]) <= 8  # and is not waited for for ever
