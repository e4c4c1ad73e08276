"""Motions by hand: the dead-man, the low limits, the end; readings; and the zero file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.motions.motion_runner import Halt
from bufferstand.daq.motions.stop_observer import ForceSeen, SampleObserver
from bufferstand.daq.operator.dead_man_switch import LET_GO_S, DeadManSwitch
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.daq.stand.manual import SPEED_MAX_MM_PER_S, ManualLimits, by_hand, watchdog_s
from bufferstand.daq.stand.readings import StandReader
from bufferstand.daq.zero.file import store_zero, stored_path, stored_zero
from bufferstand.daq.zero.limits import BEYOND_MM
from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.interfaces import ControllerStatus, MotionState, SampleBlock, Sensor, SensorFault
from bufferstand.drivers.serial_line.port_errors import is_held
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.drivers.simulated.machine.commands import ControllerFault
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.channels.zero import ChannelZero, Zero
from bufferstand.foundation.errors import BadInput, DeviceFault
from tests.contract.stand.backends import write_stand

LIMITS = ManualLimits(20.0, 100.0)


@pytest.fixture
def made(tmp_path: Path) -> tuple[InProcessStand, StandFile]:
    file = load_stand(write_stand(tmp_path, (("seed = 1", "seed = 1\ngap_mm = 30.0"),)))
    return open_in_process(file), file


def test_the_piston_moves_while_it_is_held_and_stops_when_let_go(
    made: tuple[InProcessStand, StandFile],
) -> None:
    stand, file = made
    passes = 0

    def held() -> bool:
        nonlocal passes
        passes += 1
        return passes < 50

    with by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lambda _: None) as hand:
        assert not hand.jog(20.0, 2.0, held)
        let_go_mm = stand.device.actuator.position_mm
        assert 0.7 < let_go_mm < 3.0, "fifty passes of 20 ms at 2 mm/s"
        hand.driver.wait(1.0)
        assert stand.device.actuator.position_mm == pytest.approx(let_go_mm, abs=0.05)
        assert hand.jog(5.0, SPEED_MAX_MM_PER_S, lambda: True)
        assert stand.device.actuator.position_mm == pytest.approx(5.0, abs=0.1)
    assert stand.device.controller.state in (MotionState.OFF, MotionState.READY)
    assert stand.device.actuator.position_mm == pytest.approx(5.0, abs=0.1), "unloaded, it stays"


def test_a_force_stops_it_and_it_is_unloaded(made: tuple[InProcessStand, StandFile]) -> None:
    stand, file = made
    lines: list[str] = []
    with (
        pytest.raises(Halt),
        by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lines.append) as hand,
    ):
        hand.jog(60.0, SPEED_MAX_MM_PER_S, lambda: True)
    truth = stand.truth.arrays()["force_kN"]
    assert 15.0 < float(np.max(truth)) < 30.0
    assert abs(float(truth[-1])) < 2.0
    assert any(line.startswith("safe stop") and "valve off" in line for line in lines)


def until_it_ends(stand: InProcessStand, file: StandFile, lines: list[str]) -> Halt:
    """Jog into the specimen until something ends it; return what."""
    with (
        pytest.raises(Halt) as caught,
        by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lines.append) as hand,
    ):
        hand.jog(60.0, SPEED_MAX_MM_PER_S, lambda: True)
    return caught.value


def test_the_guard_stops_it_before_the_devices_own_limit(made: tuple[InProcessStand, StandFile]) -> None:
    stand, file = made
    lines: list[str] = []
    halt = until_it_ends(stand, file, lines)
    assert (halt.trip.guard, halt.trip.device_fault) == ("force", False)
    assert stand.device.controller.fault is ControllerFault.NONE
    assert stand.device.controller.force_limit_kN == pytest.approx(24.0)
    assert not any("reset" in line for line in lines)


def test_where_the_device_was_quicker_its_fault_is_reset_at_the_end(
    made: tuple[InProcessStand, StandFile], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As with a stiff specimen: the device stops below the guard here, whatever the guard."""
    stand, file = made
    lines: list[str] = []
    monkeypatch.setattr(ManualLimits, "device_force_kN", lambda *_: 15.0)
    halt = until_it_ends(stand, file, lines)
    assert "it reports fault 2 (force limit of the device)" in halt.trip.reason
    assert not halt.trip.device_fault, "the limit that was set is an ordinary end"
    assert "fault 2 (force limit of the device) of the controller was reset: the specimen is" in lines[-1]
    assert lines[-2].startswith("safe stop by the controller itself")
    assert stand.device.controller.fault is ControllerFault.NONE
    assert stand.device.controller.state in (MotionState.OFF, MotionState.READY)
    assert not stand.device.controller.valve_on
    assert abs(stand.device.measured_force_kN) < 2.0


def test_another_fault_stays_for_the_next_command_to_name_and_reset(
    made: tuple[InProcessStand, StandFile],
) -> None:
    stand, file = made
    lines: list[str] = []

    def fail() -> bool:
        stand.device.controller.fail(ControllerFault.ACTUATOR)
        return True

    with (
        pytest.raises(Halt) as caught,
        by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lines.append) as hand,
    ):
        hand.jog(5.0, 1.0, fail)
    assert caught.value.trip.device_fault
    assert stand.device.controller.fault is ControllerFault.ACTUATOR
    lines.clear()
    with by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lines.append) as hand:
        assert stand.device.controller.valve_on
        assert hand.jog(1.0, 1.0, lambda: True)
    assert lines[0].startswith("note: the controller shows fault 4 (actuator) from before this start")
    assert lines[1] == "fault 4 (actuator) of the controller was reset"


def test_no_fault_is_reset_with_force_on_the_specimen(
    made: tuple[InProcessStand, StandFile], monkeypatch: pytest.MonkeyPatch
) -> None:
    stand, file = made
    stand.device.controller.fail(ControllerFault.ACTUATOR)
    monkeypatch.setattr(RingController, "status", _with_force(30.0))
    with (
        pytest.raises(
            Halt, match=r"shows fault 4 \(actuator\) from before .* the force is 30.0 kN"
        ) as caught,
        by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lambda _: None),
    ):
        pytest.fail("it was switched on")
    assert caught.value.trip.device_fault
    assert stand.device.controller.fault is ControllerFault.ACTUATOR
    stand.device.measured_force_kN = 30.0
    for switch in (
        stand.stand.controller.reset_fault,
        lambda: stand.stand.controller.enable(force_limit_kN=20.0, stroke_limit_mm=50.0, watchdog_ms=2000),
    ):
        with pytest.raises(DeviceFault, match=r"fault 4 \(actuator\) was not reset: the force is 30.0 kN"):
            switch()
    assert stand.device.controller.fault is ControllerFault.ACTUATOR
    assert not stand.device.controller.valve_on


def _with_force(force_kN: float) -> Callable[..., ControllerStatus]:
    shown = RingController.status

    def altered(self: RingController) -> ControllerStatus:
        return replace(shown(self), force_kN=force_kN)

    return altered


def test_a_command_that_is_killed_is_stopped_by_the_shortest_watchdog(
    made: tuple[InProcessStand, StandFile],
) -> None:
    stand, file = made
    with by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lambda _: None) as hand:
        assert stand.device.controller.watchdog.time_ms == 1000
        assert hand.jog(1.0, 1.0, lambda: True)
    slow = file.controller.model_copy(update={"timeout_s": 0.8, "watchdog_s": 5.0})
    assert watchdog_s(file.model_copy(update={"controller": slow})) == pytest.approx(1.6)


def test_a_piston_far_out_may_come_back_within_wider_limits(made: tuple[InProcessStand, StandFile]) -> None:
    """As after a jog to 20 mm: a touch by hand sets 8 mm, and its first motion is the way back."""
    stand, file = made
    with by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lambda _: None) as hand:
        assert hand.jog(20.0, SPEED_MAX_MM_PER_S, lambda: True)
    narrow = ManualLimits(20.0, 8.0)
    with by_hand(stand.stand, file, stand.clock, narrow, StopRequest(), lambda _: None) as hand:
        assert stand.device.controller.stroke_limit_mm == pytest.approx(20.0 + BEYOND_MM, abs=0.1)
        assert hand.jog(0.0, SPEED_MAX_MM_PER_S, lambda: True)
        hand.set_limits()
        assert stand.device.controller.stroke_limit_mm == pytest.approx(8.0)
        assert stand.device.controller.fault is ControllerFault.NONE


def test_a_stop_that_was_not_seen_to_be_safe_is_a_fault_whatever_demanded_it(
    made: tuple[InProcessStand, StandFile], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where the force reads 6 kN with nothing on it: nobody can tell."""
    stand, file = made
    monkeypatch.setattr(SampleObserver, "force", lambda _: ForceSeen(6.0, "force", tared=False))
    with (
        pytest.raises(DeviceFault, match=r"^by the operator; safe stop: .*NOT SAFE"),
        by_hand(stand.stand, file, stand.clock, LIMITS, StopRequest(), lambda _: None),
    ):
        raise Halt(Trip("operator", Action.STOP, "by the operator", 0.0, device_fault=False))


def test_ctrl_c_stops_it(made: tuple[InProcessStand, StandFile]) -> None:
    stand, file = made
    request = StopRequest()
    with (
        pytest.raises(Halt, match="stopped by the operator: Ctrl-C"),
        by_hand(stand.stand, file, stand.clock, LIMITS, request, lambda _: None) as hand,
    ):
        hand.jog(
            60.0,
            1.0,
            lambda: request.ask(StopLevel.NOW, "Ctrl-C") or True,  # type: ignore[func-returns-value]
        )
    assert stand.device.controller.state in (MotionState.OFF, MotionState.READY)


def test_a_key_counts_as_held_only_while_it_is_repeated() -> None:
    now_s = 100.0
    dead_man = DeadManSwitch(lambda: now_s)
    assert not dead_man.held()
    dead_man.press("m")
    now_s += 0.9 * LET_GO_S
    assert dead_man.held()
    dead_man.press("m")
    now_s += 0.9 * LET_GO_S
    assert dead_man.held()
    now_s += 0.2 * LET_GO_S
    assert not dead_man.held()
    dead_man.press("m")
    dead_man.press("q")
    assert dead_man.quit
    assert not dead_man.held()
    now_s += 1000.0
    assert dead_man.idle()


def test_readings_are_means_and_noise_in_counts_and_units(made: tuple[InProcessStand, StandFile]) -> None:
    stand, _ = made
    stand.stand.controller.connect()
    one = ChannelZero(name="stroke_1", unit="mm", value=0.5, u=0.01)
    zero = Zero(how="tare", found=datetime.now(UTC), channel=(one,))
    readings = {one.name: one for one in StandReader(stand.stand, stand.clock).read(2.0, zero)}
    force = readings["force"]
    assert force.samples > 1500
    assert force.value == pytest.approx(0.0, abs=0.02)
    assert force.noise == pytest.approx(0.15, rel=0.1)
    assert force.noise_counts == pytest.approx(0.15 / 9.5367431640625e-05, rel=0.1)
    assert force.from_zero is None
    stroke = readings["stroke_1"]
    assert stroke.counts == pytest.approx(50.0 / 0.00762939453125, abs=2.0)
    assert stroke.from_zero == pytest.approx(-0.5, abs=0.01)
    assert readings["temperature_1"].value == pytest.approx(21.0, abs=0.2)
    assert readings["temperature_1"].age_s is not None


class HeldSensor:
    """A sensor on a port that another program holds."""

    def __init__(self, sensor: Sensor) -> None:
        self.facts = sensor.facts

    def start(self) -> None:
        raise DeviceFault("amplifier at /dev/x: cannot be opened (Could not exclusively lock port)")

    def drain(self) -> list[SampleBlock | SensorFault]:
        return []

    def close(self) -> None:
        pass


def test_what_another_program_holds_is_named_and_the_rest_is_read(
    made: tuple[InProcessStand, StandFile],
) -> None:
    stand, _ = made
    sensors = [HeldSensor(one) if one.facts.name == "amplifier" else one for one in stand.stand.sensors]
    reader = StandReader(replace(stand.stand, sensors=tuple(sensors)), stand.clock)
    (unopened,) = reader.begin()
    assert is_held(unopened)
    readings = {one.name: one for one in reader.read(2.0)}
    assert readings["force"].samples > 1500
    assert readings["temperature_1"].samples > 0
    assert readings["force_2"].samples == 0
    assert readings["force_2"].value is None


@given(
    st.floats(-10.0, 10.0), st.floats(0.0, 1.0), st.text(max_size=20).filter(lambda text: text.isprintable())
)
def test_a_zero_is_read_back_as_it_was_stored(
    tmp_path_factory: pytest.TempPathFactory, value: float, u: float, specimen: str
) -> None:
    stand = tmp_path_factory.mktemp("zero") / "stand.toml"
    one = ChannelZero(name="stroke_1", unit="mm", value=value, u=u)
    zero = Zero(how="tare", found=datetime.now(UTC), specimen=specimen, channel=(one,))
    assert store_zero(stand, zero) == stored_path(stand)
    assert stored_zero(stand) == zero


def test_without_a_file_there_is_no_zero_and_a_wrong_one_is_refused(tmp_path: Path) -> None:
    stand = tmp_path / "stand.toml"
    assert stored_zero(stand) is None
    stored_path(stand).write_text('how = "guess"\n', encoding="utf-8")
    with pytest.raises(BadInput) as caught:
        stored_zero(stand)
    assert str(stored_path(stand)) in str(caught.value)
