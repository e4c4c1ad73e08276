"""The safe stop ends at zero force with the valve off from every state, once, in time, whatever breaks."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from dataclasses import replace

import pytest

from bufferstand.daq.motions.safe_stop import SafeStop, SafeStopSettings
from bufferstand.daq.operator.stop_request import (
    STOP_SIGNALS,
    StopLevel,
    StopRequest,
    signals_held_back,
    stop_on_signals,
)
from bufferstand.drivers.interfaces import EndReason, MotionState
from bufferstand.foundation.motions import Harmonic, RampTo, Release, StandStill, StaticCycles
from tests.daq.fake_stand import FakeClock, FakeController, Orders

SETTINGS = SafeStopSettings(release_speed_mm_per_s=20.0, watchdog_s=2.0)


def enabled(orders: Orders | None = None) -> tuple[FakeController, FakeClock]:
    clock = FakeClock()
    controller = FakeController(clock, orders)
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    return controller, clock


def loaded(orders: Orders | None = None) -> tuple[FakeController, FakeClock]:
    """Return a controller that holds 200 kN at 40 mm after one second."""
    controller, clock = enabled(orders)
    controller.start(RampTo(target_mm=40.0, speed_mm_per_s=80.0))
    clock.sleep(0.9)
    controller.feed_watchdog()
    return controller, clock


def stop_of(controller: FakeController, clock: FakeClock, **options: object) -> SafeStop:
    settings = options.pop("settings", SETTINGS)
    pump = options.pop("pump", controller.feed_watchdog)
    assert not options
    return SafeStop(controller, clock, settings, pump)  # type: ignore[arg-type]


START: dict[str, Callable[[FakeController], object]] = {
    "holding": lambda c: c.start(StandStill()),
    "ramping": lambda c: c.start(RampTo(target_mm=60.0, speed_mm_per_s=5.0)),
    "harmonic": lambda c: c.start(Harmonic(mean_mm=40.0, amplitude_mm=5.0, frequency_Hz=1.0, cycles=100)),
    "static": lambda c: c.start(
        StaticCycles(speed_mm_per_s=5.0, force_limit_kN=300.0, stroke_limit_mm=80.0, cycles=9, pause_s=0.0)
    ),
    "releasing": lambda c: c.start(Release(speed_mm_per_s=5.0)),
}


@pytest.mark.parametrize("emergency", [False, True])
@pytest.mark.parametrize("state", START)
def test_from_every_state(state: str, emergency: bool) -> None:
    controller, clock = loaded()
    START[state](controller)
    clock.sleep(0.5)
    controller.calls.clear()
    report = stop_of(controller, clock).run(emergency=emergency)
    assert report.safe
    assert (report.by, report.state) == ("commands", MotionState.OFF)
    assert report.force_kN == pytest.approx(0.0, abs=2.0)
    assert report.problems == ()
    motions = [call for call in controller.calls if call in ("hold", "release", "disable")]
    assert motions == (["release", "disable"] if emergency else ["hold", "release", "disable"])
    assert report.line.startswith(
        "safe stop: force 0.0 kN (the controller's own reading), stroke 0.0 mm, valve off, after "
    )
    assert report.duration_s < 40.0 / 20.0 + 1.0  # 40 mm at 20 mm/s


@pytest.mark.parametrize("state", [MotionState.OFF, MotionState.READY])
def test_a_valve_that_is_off_stays_off_and_is_told_nothing(state: MotionState) -> None:
    clock = FakeClock()
    controller = FakeController(clock)
    controller.state = state
    report = stop_of(controller, clock).run()
    assert report.safe
    assert set(controller.calls) == {"status"}


@pytest.mark.parametrize("emergency", [False, True])
def test_a_fault_that_switching_on_has_reset_is_no_fault_of_now(emergency: bool) -> None:
    """The newest status may be older than the reset: nothing was sent for 60 s then, with the valve on."""
    controller, clock = loaded()
    stale = replace(controller.status(), state=MotionState.FAULT, fault_code=1)
    controller.calls.clear()
    report = stop_of(controller, clock).run(emergency=emergency, seen=stale)
    motions = [call for call in controller.calls if call in ("hold", "release", "disable")]
    assert motions == (["release", "disable"] if emergency else ["hold", "release", "disable"])
    assert (report.safe, report.by) == (True, "commands")
    assert report.duration_s < 40.0 / 20.0 + 1.0


def test_a_second_call_does_nothing_and_arming_makes_it_stop_again() -> None:
    controller, clock = loaded()
    stop = stop_of(controller, clock)
    assert stop.report is None
    first = stop.run()
    controller.calls.clear()
    assert stop.run() is first
    assert controller.calls == []
    stop.arm()
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    assert stop.run() is not first
    assert "disable" in controller.calls


@pytest.mark.parametrize("code", [1, 2, 4])
def test_a_controller_that_falls_back_by_itself_is_waited_for(code: int) -> None:
    controller, clock = loaded(Orders(fault_at_s=1.0, fault_code=code))
    clock.sleep(0.2)
    report = stop_of(controller, clock).run()
    assert report.safe
    assert (report.by, report.state) == ("controller", MotionState.FAULT)
    assert "hold" not in controller.calls
    assert report.line.startswith("safe stop by the controller itself: force 0.0 kN")


def test_a_fault_during_the_release_is_waited_for_too() -> None:
    controller, clock = loaded(Orders(fault_at_s=1.5))
    report = stop_of(controller, clock).run()
    assert report.safe
    assert report.by == "controller"


@pytest.mark.parametrize("refused", ["hold", "release"])
def test_a_refused_command_is_noted_and_the_next_is_tried(refused: str) -> None:
    controller, clock = loaded(Orders(reject=frozenset({refused})))
    report = stop_of(controller, clock).run()
    assert report.state is MotionState.OFF
    assert any(f"{refused} rejected" in problem for problem in report.problems)
    if refused == "release":
        assert not report.safe  # the valve is off, but the force is still there: it must not say safe
        assert "NOT SAFE: use the stand's emergency stop" in report.line
    else:
        assert report.safe


def test_a_release_that_never_ends_is_limited_in_time_and_the_valve_goes_off() -> None:
    controller, clock = loaded()
    slow = SafeStopSettings(release_speed_mm_per_s=0.1, watchdog_s=2.0, limit_s=10.0)
    report = stop_of(controller, clock, settings=slow).run()
    assert not report.safe
    assert report.state is MotionState.OFF
    assert report.duration_s < 11.0
    assert "the release did not end in time" in report.line


def test_a_lost_wire_is_given_up_in_time_and_the_watchdog_named() -> None:
    controller, clock = loaded(Orders(wire_down=lambda now_s: now_s >= 1.0))
    clock.sleep(0.2)
    report = stop_of(controller, clock).run()
    assert (report.safe, report.by) == (False, "watchdog")
    assert "its own watchdog (2 s) has to ramp to zero force and switch the valve off" in report.line
    assert "NOT SEEN" in report.line
    assert report.duration_s < 5.0
    clock.sleep(5.0)
    controller._live()
    assert controller.state is MotionState.FAULT  # and so it did
    assert controller.mm == pytest.approx(0.0)


def test_a_wire_that_comes_back_is_used() -> None:
    controller, clock = loaded(Orders(wire_down=lambda now_s: 1.0 <= now_s < 2.2))
    clock.sleep(0.2)
    report = stop_of(controller, clock).run()
    assert report.safe
    assert any("no answer" in problem for problem in report.problems)


def test_an_acquisition_that_fails_during_the_stop_cannot_break_it() -> None:
    controller, clock = loaded()

    def broken() -> None:
        raise ZeroDivisionError

    slow = SafeStopSettings(release_speed_mm_per_s=10.0, watchdog_s=2.0)
    report = stop_of(controller, clock, settings=slow, pump=broken).run()
    assert report.safe
    assert report.by == "commands"  # the watchdog was fed in the loop's place through four seconds
    assert any("ZeroDivisionError" in problem for problem in report.problems)


def test_a_driver_with_a_bug_is_a_lost_wire() -> None:
    controller, clock = loaded(Orders(explode_at_s=1.0))
    clock.sleep(0.2)
    report = stop_of(controller, clock).run()
    assert (report.safe, report.by) == (False, "watchdog")
    assert any("a bug in the driver" in problem for problem in report.problems)


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_signal_during_the_stop_waits_until_it_is_over(number: signal.Signals) -> None:
    controller, clock = loaded()
    sent = []

    def pump() -> None:
        controller.feed_watchdog()
        if not sent:
            sent.append(os.kill(os.getpid(), number))

    request = StopRequest()
    with stop_on_signals(request):
        report = stop_of(controller, clock, pump=pump).run()
        assert report.safe
        assert request.level is StopLevel.NOW  # delivered afterwards, not lost


def test_ctrl_c_without_our_handlers_comes_after_the_stop() -> None:
    controller, clock = loaded()

    def pump() -> None:
        controller.feed_watchdog()
        os.kill(os.getpid(), signal.SIGINT)

    stop = stop_of(controller, clock, pump=pump)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # whatever other tests have left
    try:
        with pytest.raises(KeyboardInterrupt):
            stop.run()
    finally:
        signal.signal(signal.SIGINT, before)
    assert controller.state is MotionState.OFF
    assert controller.mm == pytest.approx(0.0)


def test_signals_only_set_a_flag_and_the_handlers_before_come_back() -> None:
    before = [signal.getsignal(number) for number in STOP_SIGNALS]
    request = StopRequest()
    with stop_on_signals(request):
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
    assert request.level is StopLevel.NOW
    assert request.reason == "SIGTERM"  # the first
    with signals_held_back():
        pass
    assert [signal.getsignal(number) for number in STOP_SIGNALS] == before


def test_a_wish_is_raised_never_lowered() -> None:
    request = StopRequest()
    request.ask(StopLevel.AFTER_CYCLE, "first")
    request.ask(StopLevel.AFTER_STEP, "weaker")
    assert (request.level, request.reason) == (StopLevel.AFTER_CYCLE, "first")
    request.ask(StopLevel.NOW, "stronger")
    assert (request.level, request.reason) == (StopLevel.NOW, "stronger")


def test_the_fake_watchdog_is_a_real_one() -> None:
    controller, clock = loaded()
    clock.sleep(10.0)
    status = controller.status()
    assert (status.state, status.fault_code, status.end_reason) == (MotionState.FAULT, 1, EndReason.WATCHDOG)
