"""The controller's state machine on a simulated stand: motions, judgements, limits, watchdog."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.controllers import cia402
from bufferstand.drivers.interfaces import EndReason, MotionState
from bufferstand.drivers.simulated.machine.commands import (
    Command,
    CommandCode,
    ControllerFault,
    RejectReason,
)
from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.machine.motions import HarmonicMotion, HoldMotion
from tests.drivers.simulated.standing import FrictionSpring, HandClock, LinearSpring, device

ON = 0x000F


@pytest.fixture
def stand(tmp_path: Path) -> SimulatedDevice:
    made = device(tmp_path)
    made.controller.control(ON)
    return made


def give(stand: SimulatedDevice, code: CommandCode, **parameters: float) -> int:
    sequence = stand.controller.echo_sequence + 1
    command = Command(sequence, int(code), **parameters)  # type: ignore[arg-type]
    assert stand.controller.arm(command) is RejectReason.ACCEPTED
    assert stand.controller.execute(sequence) is RejectReason.ACCEPTED
    return sequence


def finish(stand: SimulatedDevice, sequence: int, most: int = 200_000) -> None:
    for _ in range(most // 50):
        stand.advance(50)
        if stand.controller.done_sequence == sequence:
            return
    pytest.fail(f"motion {sequence} has not ended after {most} samples")


def truth(stand: SimulatedDevice) -> dict[str, np.ndarray]:
    assert stand.truth is not None
    return stand.truth.arrays()


def ramp_to(stand: SimulatedDevice, target_mm: float) -> None:
    finish(stand, give(stand, CommandCode.RAMP, target_mm=target_mm, speed_mm_per_s=100.0))


# --- switching ----------------------------------------------------------------------------------------


def test_it_shows_every_state_of_cia_402_on_the_way_to_on(tmp_path: Path) -> None:
    controller = device(tmp_path).controller
    assert cia402.state_name(controller.status_word) == "switch-on disabled"
    for step in cia402.SWITCH_ON:
        controller.control(step.control_word)
        assert step.reached(controller.status_word)
    assert controller.state is MotionState.HOLDING
    controller.control(cia402.SWITCH_OFF)
    assert (controller.state, controller.valve_on) == (MotionState.OFF, False)


def test_switched_off_under_load_it_creeps_to_zero_force(stand: SimulatedDevice) -> None:
    ramp_to(stand, 40.0)
    assert stand.contact.force_kN > 200.0
    stand.controller.control(0)
    stand.advance(60_000)
    assert 0.0 <= stand.contact.force_kN < 100.0
    force = truth(stand)["force_kN"][-60_000:]
    assert np.all(np.diff(force) <= 1e-9)


def test_quick_stop_holds_and_refuses_until_it_is_released(stand: SimulatedDevice) -> None:
    sequence = give(stand, CommandCode.RAMP, target_mm=80.0, speed_mm_per_s=50.0)
    stand.advance(500)
    stand.controller.control(0x000B)
    assert cia402.state_name(stand.controller.status_word) == "quick stop active"
    assert stand.controller.end_reason is EndReason.COMMANDED
    assert stand.controller.done_sequence == sequence
    at = stand.controller.command_mm
    stand.advance(500)
    assert stand.actuator.position_mm == pytest.approx(at, abs=1e-3)
    assert stand.controller.arm(Command(90, CommandCode.HOLD)) is RejectReason.WRONG_STATE
    stand.controller.control(ON)
    assert stand.controller.arm(Command(91, CommandCode.HOLD)) is RejectReason.ACCEPTED


# --- motions ------------------------------------------------------------------------------------------


def test_ramp_moves_at_its_speed_and_ends_where_it_should(stand: SimulatedDevice) -> None:
    sequence = give(stand, CommandCode.RAMP, target_mm=30.0, speed_mm_per_s=20.0)
    stand.advance(500)
    assert stand.controller.state is MotionState.RAMPING
    before = stand.actuator.position_mm
    stand.advance(500)
    assert stand.actuator.position_mm - before == pytest.approx(10.0, abs=0.01)
    finish(stand, sequence)
    assert stand.controller.end_reason is EndReason.REACHED
    assert stand.controller.state is MotionState.HOLDING
    stand.advance(200)
    assert stand.actuator.position_mm == pytest.approx(30.0, abs=1e-4)


@pytest.mark.parametrize(("frequency_Hz", "amplitude_mm"), [(0.32, 20.0), (1.27, 20.0), (2.55, 10.0)])
def test_harmonic_has_its_frequency_amplitude_and_cycles(
    stand: SimulatedDevice, frequency_Hz: float, amplitude_mm: float
) -> None:
    ramp_to(stand, 40.0)
    begin = stand.ring.total
    cycles = 4
    finish(
        stand,
        give(
            stand,
            CommandCode.HARMONIC,
            mean_mm=40.0,
            amplitude_mm=amplitude_mm,
            frequency_Hz=frequency_Hz,
            cycles=cycles,
        ),
    )
    assert stand.controller.cycles_done == cycles
    assert stand.controller.end_reason is EndReason.REACHED
    assert stand.actuator.position_mm == pytest.approx(40.0, abs=0.05)
    stroke = truth(stand)["stroke_mm"][begin:]
    period = 1000.0 / frequency_Hz
    assert stroke.size == pytest.approx((cycles + 2) * period, abs=0.05 * period + 200)
    # A first-harmonic fit over whole cycles at full amplitude.
    full = stroke[round(1.2 * period) : round(1.2 * period) + round(3 * period)]
    phase = 2 * math.pi * frequency_Hz * np.arange(full.size) / 1000.0
    basis = np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=1)
    mean, a, b = np.linalg.lstsq(basis, full, rcond=None)[0]
    # Loop gain of the actuator at this frequency, then the frame's share: F = 15 + 5 s.
    ratio = math.sqrt(1 - 2 * 0.64 + math.sqrt(4 * 0.8**4 - 4 * 0.64 + 2))
    r = frequency_Hz / (15.0 / ratio)
    gain = 1.0 / math.hypot(1 - r**2, 1.6 * r)
    assert math.hypot(a, b) == pytest.approx(amplitude_mm * gain * 150.0 / 155.0, rel=2e-3)
    assert mean == pytest.approx((150.0 * 40.0 - 15.0) / 155.0, abs=0.05)
    residual = full - basis @ (mean, a, b)
    assert np.abs(residual).max() < 0.02 * amplitude_mm


@given(
    cycles=st.integers(1, 3),
    frequency=st.floats(0.4, 2.5),
    amplitude=st.floats(0.5, 40.0),
    excess=st.floats(0, 30),
)
def test_harmonic_command_is_smooth_and_never_leaves_its_range(
    cycles: int, frequency: float, amplitude: float, excess: float
) -> None:
    mean = amplitude + excess
    motion = HarmonicMotion(1, mean, amplitude, frequency, cycles, 0.001)
    command = [mean]
    while motion.end is EndReason.NONE:
        command.append(motion.advance(0.0, command[-1]))
    path = np.array(command)
    assert np.abs(path - mean).max() <= amplitude * (1 + 1e-12)
    omega = 2 * math.pi * frequency
    speed = np.abs(np.diff(path)).max() / 0.001
    assert speed <= amplitude * omega * 1.2
    assert path[-1] == mean
    assert motion.cycles_done == cycles


@given(phase=st.floats(0.0, 1.0), frequency=st.floats(0.1, 2.5), amplitude=st.floats(1.0, 40.0))
def test_hold_stops_a_sine_inside_its_own_range(phase: float, frequency: float, amplitude: float) -> None:
    omega = 2 * math.pi * frequency
    at = amplitude * math.sin(2 * math.pi * phase)
    rate = amplitude * omega * math.cos(2 * math.pi * phase) * 0.001
    motion = HoldMotion(1, at, rate, amplitude * omega**2 * 1e-6)
    while motion.end is EndReason.NONE:
        at = motion.advance(0.0, at)
        assert abs(at) <= amplitude * (1 + 1e-9)


@pytest.mark.parametrize("code", [CommandCode.HOLD, CommandCode.RELEASE])
def test_a_harmonic_can_be_ended_at_any_time(stand: SimulatedDevice, code: CommandCode) -> None:
    ramp_to(stand, 40.0)
    running = give(stand, CommandCode.HARMONIC, mean_mm=40.0, amplitude_mm=30.0, frequency_Hz=1.0, cycles=50)
    stand.advance(3210)
    assert stand.controller.cycles_done == 2
    sequence = give(stand, code, speed_mm_per_s=50.0)
    assert stand.controller.done_sequence == running
    assert stand.controller.end_reason is EndReason.COMMANDED
    finish(stand, sequence)
    assert stand.controller.state is MotionState.HOLDING
    position = stand.actuator.position_mm
    assert position == pytest.approx(0.0, abs=0.05) if code is CommandCode.RELEASE else 9.0 < position < 71.0
    if code is CommandCode.RELEASE:
        assert stand.contact.force_kN < 0.2


def test_static_turns_at_its_force_with_less_than_1_percent_overshoot(tmp_path: Path) -> None:
    stand = device(tmp_path, FrictionSpring(5.5, 70.0, 2.0))
    stand.controller.control(ON)
    finish(
        stand,
        give(
            stand,
            CommandCode.STATIC,
            speed_mm_per_s=20.0,
            turning_force_kN=600.0,
            turning_stroke_mm=150.0,
            cycles=2,
            pause_s=1.5,
        ),
    )
    assert stand.controller.end_reason is EndReason.FORCE_LIMIT
    assert (stand.controller.cycles_done, stand.controller.fault) == (2, ControllerFault.NONE)
    log = truth(stand)
    assert 600.0 <= log["force_kN"].max() < 606.0
    peaks = np.flatnonzero(log["force_kN"] > 599.0)
    assert np.count_nonzero(np.diff(peaks) > 1000) == 1  # two peaks
    # Constant speed while loading: the piston's 20 mm/s less what the frame takes up.
    loading = slice(1000, 2000)
    speed = np.diff(log["stroke_mm"][loading]) * 1000.0
    assert speed.mean() == pytest.approx(20.0 * 150.0 / 155.5, rel=0.01)
    # Between the cycles the force is gone for the whole pause, and ∮F dx is what friction takes.
    between = log["force_kN"][peaks[0] : peaks[-1]]
    assert np.count_nonzero(between < 0.2) >= 1500
    end_of_first = peaks[0] + int(np.argmax(between < 0.2))
    loop_J = log["work_J"][end_of_first]
    top_mm = log["stroke_mm"].max()
    assert loop_J == pytest.approx(2 * 70.0 * (top_mm - 2.0), rel=0.03)


def test_static_turns_at_the_stroke_if_that_comes_first(stand: SimulatedDevice) -> None:
    finish(
        stand,
        give(
            stand,
            CommandCode.STATIC,
            speed_mm_per_s=50.0,
            turning_force_kN=600.0,
            turning_stroke_mm=25.0,
            cycles=1,
            pause_s=0.0,
        ),
    )
    assert stand.controller.end_reason is EndReason.REACHED
    assert truth(stand)["force_kN"].max() == pytest.approx(15 + 5 * (150 * 25 - 15) / 155, rel=0.03)


def test_release_of_a_piston_that_stands_clear_leaves_it_there(stand: SimulatedDevice) -> None:
    ramp_to(stand, -5.0)
    finish(stand, give(stand, CommandCode.RELEASE, speed_mm_per_s=50.0), 1000)
    assert stand.actuator.position_mm == pytest.approx(-5.0, abs=0.01)


# --- judgements ---------------------------------------------------------------------------------------

HARMONIC = Command(1, CommandCode.HARMONIC, mean_mm=40.0, amplitude_mm=20.0, frequency_Hz=1.0, cycles=3)
STATIC = Command(
    1,
    CommandCode.STATIC,
    speed_mm_per_s=5.0,
    turning_force_kN=600.0,
    turning_stroke_mm=105.0,
    cycles=3,
    pause_s=60.0,
)
RAMP = Command(1, CommandCode.RAMP, target_mm=40.0, speed_mm_per_s=50.0)


@pytest.mark.parametrize(
    ("command", "verdict"),
    [
        (Command(1, 9), RejectReason.UNKNOWN_COMMAND),
        (Command(1, 0), RejectReason.UNKNOWN_COMMAND),
        (replace(RAMP, sequence=0), RejectReason.WRONG_STATE),
        (RAMP, RejectReason.ACCEPTED),
        (replace(RAMP, target_mm=300.0), RejectReason.OUT_OF_RANGE),
        (replace(RAMP, target_mm=math.nan), RejectReason.OUT_OF_RANGE),
        (replace(RAMP, speed_mm_per_s=0.0), RejectReason.OUT_OF_RANGE),
        (replace(RAMP, speed_mm_per_s=801.0), RejectReason.OUT_OF_RANGE),
        (replace(RAMP, speed_mm_per_s=float(np.float32(800.0000001))), RejectReason.ACCEPTED),
        (STATIC, RejectReason.ACCEPTED),
        (replace(STATIC, turning_force_kN=600.1), RejectReason.OUT_OF_RANGE),
        (replace(STATIC, turning_stroke_mm=251.0), RejectReason.OUT_OF_RANGE),
        (replace(STATIC, cycles=0), RejectReason.OUT_OF_RANGE),
        (replace(STATIC, pause_s=-1.0), RejectReason.OUT_OF_RANGE),
        (HARMONIC, RejectReason.WRONG_STATE),  # it does not stand at the mean
        (replace(HARMONIC, mean_mm=0.4, amplitude_mm=0.4), RejectReason.ACCEPTED),
        (replace(HARMONIC, amplitude_mm=41.0), RejectReason.OUT_OF_RANGE),  # would leave the specimen
        (replace(HARMONIC, mean_mm=240.0), RejectReason.OUT_OF_RANGE),
        (replace(HARMONIC, frequency_Hz=2.56), RejectReason.OUT_OF_RANGE),
        (
            replace(HARMONIC, mean_mm=90.0, amplitude_mm=60.0, frequency_Hz=2.5),
            RejectReason.OUT_OF_RANGE,
        ),  # speed
        (Command(1, CommandCode.HOLD), RejectReason.ACCEPTED),
        (Command(1, CommandCode.RELEASE), RejectReason.OUT_OF_RANGE),
    ],
)
def test_commands_are_judged(stand: SimulatedDevice, command: Command, verdict: RejectReason) -> None:
    assert stand.controller.arm(command) is verdict
    assert (stand.controller.echo_sequence, stand.controller.reject) == (command.sequence, verdict)
    assert (stand.controller.execute(command.sequence) is RejectReason.ACCEPTED) == (
        verdict is RejectReason.ACCEPTED
    )


def test_what_is_not_armed_is_not_executed(stand: SimulatedDevice) -> None:
    controller = stand.controller
    assert controller.execute(5) is RejectReason.NOT_ARMED
    controller.arm(replace(RAMP, sequence=6))
    assert controller.execute(5) is RejectReason.NOT_ARMED
    assert controller.execute(6) is RejectReason.ACCEPTED


def test_repeated_requests_change_nothing(stand: SimulatedDevice) -> None:
    controller = stand.controller
    command = replace(RAMP, sequence=7)
    give_twice = [controller.arm(command), controller.arm(command), controller.execute(7)]
    stand.advance(300)
    at = controller.command_mm
    give_twice += [controller.execute(7), controller.arm(command), controller.execute(7)]
    assert set(give_twice) == {RejectReason.ACCEPTED}
    assert controller.command_mm == at
    finish(stand, 7)
    assert controller.execute(7) is RejectReason.ACCEPTED
    assert controller.state is MotionState.HOLDING


def test_a_number_that_an_earlier_user_has_finished_does_not_look_done(stand: SimulatedDevice) -> None:
    ramp_to(stand, 10.0)
    done = stand.controller.done_sequence
    stand.controller.arm(replace(RAMP, sequence=done))
    stand.controller.execute(done)
    assert stand.controller.done_sequence != done
    finish(stand, done)


def test_a_hold_of_a_piston_that_stands_is_over_at_once(stand: SimulatedDevice) -> None:
    sequence = give(stand, CommandCode.HOLD)
    controller = stand.controller
    assert (controller.done_sequence, controller.end_reason) == (sequence, EndReason.REACHED)
    assert controller.state is MotionState.HOLDING
    give(stand, CommandCode.RAMP, target_mm=80.0, speed_mm_per_s=10.0)
    stand.advance(100)
    sequence = give(stand, CommandCode.HOLD)
    assert (controller.done_sequence, controller.end_reason) == (sequence - 1, EndReason.COMMANDED)
    finish(stand, sequence)
    assert controller.end_reason is EndReason.REACHED


def test_motion_in_progress_is_not_replaced_by_another(stand: SimulatedDevice) -> None:
    give(stand, CommandCode.RAMP, target_mm=80.0, speed_mm_per_s=10.0)
    stand.advance(100)
    assert stand.controller.arm(replace(RAMP, sequence=9)) is RejectReason.WRONG_STATE


def test_nothing_is_accepted_while_off(tmp_path: Path) -> None:
    assert device(tmp_path).controller.arm(RAMP) is RejectReason.WRONG_STATE


# --- limits -------------------------------------------------------------------------------------------


def test_force_limit_of_the_device_releases_and_faults(stand: SimulatedDevice) -> None:
    assert stand.controller.set_force_limit(200.0)
    sequence = give(stand, CommandCode.RAMP, target_mm=100.0, speed_mm_per_s=20.0)
    finish(stand, sequence)
    assert stand.controller.end_reason is EndReason.DEVICE_LIMIT
    assert (stand.controller.fault, stand.controller.state) == (
        ControllerFault.FORCE_LIMIT,
        MotionState.RELEASING,
    )
    assert cia402.state_name(stand.controller.status_word) == "reacting to a fault"
    stand.advance(4000)
    assert stand.controller.state is MotionState.FAULT
    assert cia402.state_name(stand.controller.status_word) == "fault"
    assert not stand.controller.valve_on
    assert stand.contact.force_kN < 0.2
    assert truth(stand)["force_kN"].max() < 200.0 * 1.03


def test_stroke_limit_of_the_device_releases_and_faults(stand: SimulatedDevice) -> None:
    ramp_to(stand, 30.0)
    assert stand.controller.set_stroke_limit(25.0)
    stand.advance(10)
    assert stand.controller.fault is ControllerFault.STROKE_LIMIT
    stand.advance(4000)
    assert stand.controller.state is MotionState.FAULT
    assert stand.contact.force_kN < 0.2


@pytest.mark.parametrize("limit", [0.0, -1.0, 601.0, math.nan, math.inf])
def test_limits_beyond_the_stand_are_not_taken(stand: SimulatedDevice, limit: float) -> None:
    assert not stand.controller.set_force_limit(limit)
    assert stand.controller.force_limit_kN == 600.0


def test_fault_needs_a_reset_edge_before_it_can_be_on_again(stand: SimulatedDevice) -> None:
    ramp_to(stand, 30.0)
    stand.controller.set_stroke_limit(25.0)
    stand.advance(4000)
    stand.controller.control(ON)
    assert not stand.controller.valve_on
    stand.controller.control(0x0000)
    stand.controller.control(0x0080)
    assert (stand.controller.fault, stand.controller.state) == (ControllerFault.NONE, MotionState.OFF)
    stand.controller.control(ON)
    assert stand.controller.valve_on


# --- watchdog -----------------------------------------------------------------------------------------


def test_watchdog_runs_on_wall_time_and_falls_back_to_zero_force(tmp_path: Path) -> None:
    wall = HandClock()
    stand = device(tmp_path, LinearSpring(), wall)
    controller = stand.controller
    controller.watchdog.set_time(500)
    controller.control(ON)
    ramp_to(stand, 60.0)  # seconds of stand time, no wall time
    assert controller.fault is ControllerFault.NONE
    sequence = give(
        stand, CommandCode.HARMONIC, mean_mm=60.0, amplitude_mm=10.0, frequency_Hz=1.0, cycles=100
    )
    beat = 0
    for _ in range(20):  # fed: 4 s of the wall
        wall.now_s += 0.2
        beat += 1
        controller.watchdog.feed(beat)
        stand.advance(100)
    assert (controller.fault, controller.state) == (ControllerFault.NONE, MotionState.WAVEFORM)
    for _ in range(3):  # the same value does not feed
        wall.now_s += 0.2
        controller.watchdog.feed(beat)
        stand.advance(1)
    assert (controller.fault, controller.state) == (ControllerFault.WATCHDOG, MotionState.RELEASING)
    assert (controller.watchdog.trips, controller.watchdog.remaining_ms) == (1, 0)
    assert (controller.done_sequence, controller.end_reason) == (sequence, EndReason.WATCHDOG)
    stand.advance(6000)
    assert (controller.state, controller.valve_on) == (MotionState.FAULT, False)
    assert (controller.done_sequence, controller.end_reason) == (sequence, EndReason.WATCHDOG)
    assert stand.contact.force_kN < 0.2
    assert stand.actuator.position_mm == pytest.approx(0.0, abs=0.1)


def test_a_starved_device_does_not_blame_its_user(tmp_path: Path) -> None:
    wall = HandClock()
    stand = device(tmp_path, LinearSpring(), wall)
    stand.controller.watchdog.set_time(500)
    stand.controller.control(ON)
    wall.now_s += 30.0  # the whole process stood still
    stand.advance(10)
    assert stand.controller.fault is ControllerFault.NONE
    assert stand.controller.watchdog.remaining_ms == 250


def test_watchdog_of_time_zero_never_trips(tmp_path: Path) -> None:
    wall = HandClock()
    stand = device(tmp_path, LinearSpring(), wall)
    stand.controller.control(ON)
    for _ in range(100):
        wall.now_s += 0.2
        stand.advance(1)
    assert stand.controller.fault is ControllerFault.NONE


# --- changing a running sine ----------------------------------------------------------------------------


def adjust(stand: SimulatedDevice, mean_mm: float, amplitude_mm: float) -> RejectReason:
    sequence = stand.controller.echo_sequence + 1
    command = Command(sequence, int(CommandCode.ADJUST), mean_mm=mean_mm, amplitude_mm=amplitude_mm)
    verdict = stand.controller.arm(command)
    return verdict if verdict is not RejectReason.ACCEPTED else stand.controller.execute(sequence)


def test_a_running_sine_goes_over_to_another_mean_and_amplitude_in_one_cycle(stand: SimulatedDevice) -> None:
    ramp_to(stand, 20.0)
    number = give(stand, CommandCode.HARMONIC, mean_mm=20.0, amplitude_mm=10.0, frequency_Hz=2.0, cycles=6)
    stand.advance(1200)  # one cycle in, 1.4 at full amplitude
    assert adjust(stand, 20.4, 10.6) is RejectReason.ACCEPTED
    assert stand.controller.done_sequence != number, "a change is no motion"
    stand.advance(500)
    before = len(truth(stand)["sequence"])
    finish(stand, number)
    assert (stand.controller.end_reason, stand.controller.cycles_done) == (EndReason.REACHED, 6)
    assert stand.controller.command_mm == pytest.approx(20.4), "it ends at its new mean"
    position = command_of(stand)[before : before + 500]
    assert 0.5 * (position.max() + position.min()) == pytest.approx(20.4, abs=0.01)
    assert 0.5 * (position.max() - position.min()) == pytest.approx(10.6, abs=0.01)


def command_of(stand: SimulatedDevice) -> np.ndarray:
    """The set point as it is sampled [mm]."""
    _, columns = stand.ring.window(stand.ring.oldest, stand.ring.capacity)
    return np.asarray(columns["command"] * 0.01)


@given(
    cycles=st.integers(2, 6),
    at=st.floats(1.0, 5.0),
    mean=st.floats(-3.0, 3.0),
    amplitude=st.floats(-3.0, 3.0),
)
def test_a_change_never_jumps_nor_leaves_what_it_bridges(
    cycles: int, at: float, mean: float, amplitude: float
) -> None:
    sine = HarmonicMotion(1, 30.0, 10.0, 1.0, cycles, 1e-3)
    most = sine.peak_speed_mm_per_s(30.0 + mean, 10.0 + amplitude) * 1e-3
    commands = [30.0]
    while sine.cycles_done < cycles or commands[-1] != sine.command_mm:
        if len(commands) == round(1000 * at) and sine.adjustable:
            sine.adjust(30.0 + mean, 10.0 + amplitude)
            assert not sine.adjustable, "one after the other"
        commands.append(sine.advance(0.0, 30.0))
        if len(commands) > 1000 * (cycles + 2):
            break
    path = np.array(commands)
    assert np.abs(np.diff(path)).max() <= most * (1.0 + 1e-9)
    # (m + A sin)'' = m'' + A'' sin + 2 A' ω cos − A ω² sin; each bridge is A at most, in one cycle
    omega, largest = 2.0 * math.pi, 10.0 + abs(amplitude)
    bound = largest * (omega**2 + math.pi * omega + 0.5 * math.pi**2) + 0.5 * math.pi**2 * abs(mean)
    assert np.abs(np.diff(path, 2)).max() <= bound * 1e-6 * 1.01
    assert path.max() <= max(40.0, 40.0 + mean, 40.0 + mean + amplitude, 40.0 + amplitude) + 1e-9
    assert path.min() >= min(20.0, 20.0 + mean, 20.0 + mean - amplitude, 20.0 - amplitude) - 1e-9


def test_a_change_is_refused_unless_a_sine_runs_at_full_amplitude(stand: SimulatedDevice) -> None:
    assert adjust(stand, 20.0, 5.0) is RejectReason.WRONG_STATE, "nothing runs"
    ramp_to(stand, 20.0)
    number = give(stand, CommandCode.HARMONIC, mean_mm=20.0, amplitude_mm=10.0, frequency_Hz=2.0, cycles=3)
    stand.advance(400)
    assert adjust(stand, 20.0, 10.1) is RejectReason.WRONG_STATE, "the amplitude still grows"
    stand.advance(200)
    assert adjust(stand, 20.0, 10.1) is RejectReason.ACCEPTED
    assert adjust(stand, 20.0, 10.2) is RejectReason.WRONG_STATE, "one is under way"
    stand.advance(600)
    assert adjust(stand, 20.0, 10.2) is RejectReason.ACCEPTED
    stand.advance(400)
    assert adjust(stand, 20.0, 10.3) is RejectReason.WRONG_STATE, "no full cycle is left for it"
    finish(stand, number)


@pytest.mark.parametrize(
    ("mean_mm", "amplitude_mm"),
    [(20.0, 20.1), (20.0, 0.0), (245.0, 10.0), (100.0, 90.0), (float("nan"), 5.0)],
)
def test_a_change_is_refused_beyond_what_a_sine_may_be(
    stand: SimulatedDevice, mean_mm: float, amplitude_mm: float
) -> None:
    ramp_to(stand, 20.0)
    give(stand, CommandCode.HARMONIC, mean_mm=20.0, amplitude_mm=10.0, frequency_Hz=2.0, cycles=5)
    stand.advance(700)
    assert adjust(stand, mean_mm, amplitude_mm) is RejectReason.OUT_OF_RANGE
    stand.advance(500)
    assert command_of(stand)[-500:].max() == pytest.approx(30.0, abs=0.01), "it goes on as it was"


def test_a_change_that_is_sent_twice_is_done_once(stand: SimulatedDevice) -> None:
    ramp_to(stand, 20.0)
    give(stand, CommandCode.HARMONIC, mean_mm=20.0, amplitude_mm=10.0, frequency_Hz=2.0, cycles=5)
    stand.advance(700)
    sequence = stand.controller.echo_sequence + 1
    command = Command(sequence, int(CommandCode.ADJUST), mean_mm=20.0, amplitude_mm=11.0)
    for _ in range(2):
        assert stand.controller.arm(command) is RejectReason.ACCEPTED
        assert stand.controller.execute(sequence) is RejectReason.ACCEPTED
        stand.advance(100)
    stand.advance(900)
    assert command_of(stand)[-500:].max() == pytest.approx(31.0, abs=0.01)


def test_a_hold_stops_an_adjusted_sine_within_its_range(stand: SimulatedDevice) -> None:
    ramp_to(stand, 20.0)
    give(stand, CommandCode.HARMONIC, mean_mm=20.0, amplitude_mm=10.0, frequency_Hz=2.0, cycles=5)
    stand.advance(700)
    assert adjust(stand, 20.0, 11.0) is RejectReason.ACCEPTED
    stand.advance(560)  # on the way through the mean
    finish(stand, give(stand, CommandCode.HOLD))
    assert 9.0 <= stand.controller.command_mm <= 31.0


def test_a_device_of_edition_2_does_not_know_the_command(tmp_path: Path) -> None:
    made = device(tmp_path)
    made.controller.capabilities = replace(made.controller.capabilities, adjusts=False)
    made.controller.control(ON)
    ramp_to(made, 20.0)
    give(made, CommandCode.HARMONIC, mean_mm=20.0, amplitude_mm=10.0, frequency_Hz=2.0, cycles=5)
    made.advance(700)
    assert adjust(made, 20.0, 10.1) is RejectReason.UNKNOWN_COMMAND
