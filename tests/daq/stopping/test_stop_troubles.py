"""The safe stop in trouble: commands that fail, the controller's own fallback, slow wires, lost rights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from bufferstand.daq.motions.safe_stop import SafeStopSettings
from bufferstand.daq.motions.stop_observer import ForceSeen
from bufferstand.drivers import EndReason, MotionState
from bufferstand.foundation import DeviceFault, StandStill
from tests.daq.fake_stand import FakeController, Orders

from .test_stop_settings import SETTINGS, Eyes, commands, standing, stop_of


def noted(controller: FakeController, *, fail: str = "") -> list[bool]:
    """Have a controller write down which commands hurry, and fail to hold."""
    hurried: list[bool] = []
    start = controller.start

    def started(motion: Any, *, hurry: bool = False) -> int:
        hurried.append(hurry)
        if fail and isinstance(motion, StandStill):
            raise DeviceFault(fail)
        return start(motion, hurry=hurry)

    controller.start = started  # type: ignore[method-assign]
    return hurried


def test_a_hold_that_gets_no_answer_is_released_in_a_hurry() -> None:
    controller, clock = standing(10.0)
    hurried = noted(controller, fail="no answer")
    report = stop_of(controller, clock).run()
    assert hurried == [False, True]
    assert report.problems == ("hold: no answer; released at once",)
    assert report.safe


def test_behind_a_hold_that_is_refused_the_release_need_not_hurry() -> None:
    controller, clock = standing(10.0, Orders(reject=frozenset({"hold"})))
    hurried = noted(controller)
    assert stop_of(controller, clock).run().safe
    assert hurried == [False, False]


@pytest.mark.parametrize("emergency", [False, True])
def test_a_command_that_is_refused_as_the_controller_has_fallen_back_is_the_last(emergency: bool) -> None:
    controller, clock = standing(40.0)
    seen = controller.status()
    controller._fault(4, EndReason.DEVICE_LIMIT, clock.now_s())
    controller.calls.clear()
    report = stop_of(controller, clock, pump=lambda: None).run(seen=seen, emergency=emergency)
    assert commands(controller) == ["release" if emergency else "hold", "disable"]
    assert (report.by, report.safe) == ("controller", True)


def fallen_back(
    eyes: Eyes, motion: Callable[[float], tuple[float, bool]] | None = None, **changes: Any
) -> Any:
    controller, clock = standing(40.0)
    controller._fault(4, EndReason.DEVICE_LIMIT, clock.now_s())
    if motion is not None:
        controller._motion = motion
    settings = replace(SETTINGS, **changes)
    return stop_of(controller, clock, settings, pump=lambda: None, eyes=eyes).run()


def test_its_own_fallback_is_over_when_it_says_so_and_no_force_is_left() -> None:
    """40 mm at its own 50 mm/s."""
    eyes = Eyes(force=ForceSeen(0.0, "force", True))
    assert fallen_back(eyes).duration_s >= 0.7, "no force is shown, but it still moves"
    assert [one for one in eyes.told_of if one == ("since", None)] == [("since", None)] * 2
    assert fallen_back(Eyes(force=ForceSeen(2.0, "force", True))).duration_s < 1.5
    assert fallen_back(Eyes(force=ForceSeen(2.1, "force", True)), limit_s=4.0).duration_s >= 4.0


def test_its_own_fallback_on_a_wrong_force_ends_where_nothing_touches() -> None:
    report = fallen_back(
        Eyes(force=ForceSeen(3.0, "force", True), contact_mm=1.5), lambda t_s: (40.0 - 50.0 * t_s, False)
    )
    assert any("though the stand has let go" in problem for problem in report.problems)
    assert report.duration_s < 3.0


def test_a_valve_that_is_off_with_force_left_has_not_let_go() -> None:
    controller, clock = standing(40.0)
    controller._fault(4, EndReason.DEVICE_LIMIT, clock.now_s())
    status, asked = controller.status, []

    def then_off() -> Any:
        asked.append(1)
        return replace(
            status(), state=MotionState.RELEASING if len(asked) == 1 else MotionState.OFF, force_kN=9.0
        )

    controller.status = then_off  # type: ignore[method-assign]
    report = stop_of(controller, clock, replace(SETTINGS, limit_s=3.0), pump=lambda: None).run()
    assert report.duration_s >= 3.0
    assert not report.safe


def test_where_it_may_stay_it_decides_as_soon_as_one_way_shows_the_force() -> None:
    by_hand = replace(SETTINGS, stays_where_unloaded=True)
    controller, clock = standing(0.2)
    report = stop_of(controller, clock, by_hand, eyes=Eyes(force=ForceSeen(0.0, "force", True))).run()
    assert report.duration_s < 0.5


def test_samples_are_fetched_before_the_force_is_judged_and_the_limit_itself_is_no_force() -> None:
    controller, clock = standing()
    controller.disable()
    pumped: list[int] = []
    eyes = Eyes(force=lambda: ForceSeen(2.0, "force", True) if pumped else None)
    report = stop_of(controller, clock, pump=lambda: pumped.append(1), eyes=eyes).run()
    assert report.duration_s == 0.0
    assert report.safe


def test_the_force_is_judged_by_samples_from_after_the_last_status() -> None:
    controller, clock = standing()
    status = controller.status
    controller.status = lambda: replace(status(), tick_us=1234)  # type: ignore[method-assign]
    controller.disable()
    eyes = Eyes(force=ForceSeen(0.0, "force", True))
    stop_of(controller, clock, eyes=eyes).run()
    assert eyes.told_of == [("since", 1234)]


def test_a_right_that_is_lost_ends_the_wait_at_once_and_is_said() -> None:
    controller, clock = standing(40.0, Orders(lock_lost_at_s=0.8, writer=4711))
    report = stop_of(controller, clock, pump=lambda: None).run()
    assert report.duration_s < 0.5
    assert "the release did not end in time" in report.problems


def test_on_a_slow_wire_the_samples_come_first() -> None:
    """Each request takes 20 ms: the state is asked for once in four of them, and nobody sleeps between."""
    controller, clock = standing(40.0, Orders(round_trip_s=0.02))
    report = stop_of(controller, clock, SafeStopSettings(20.0, 2.0)).run()
    assert report.safe
    assert 2.0 < report.duration_s < 2.8
    assert controller.calls.count("status") <= report.duration_s / 0.07 + 4
    assert controller.calls.count("feed_watchdog") >= report.duration_s / 0.04


def test_forces_and_strokes_are_said_to_a_tenth() -> None:
    controller, clock = standing()
    seen = ForceSeen(1.26, "force", True)
    line = stop_of(controller, clock, eyes=Eyes(force=seen, stroke_mm=0.46)).run().line
    assert "force 1.3 kN (channel force, zero taken off), stroke 0.5 mm, valve off" in line


def test_a_motion_that_is_no_sine_may_not_go_on() -> None:
    controller, clock = standing()
    command = controller._command

    def slow(name: str, state: MotionState, motion: Callable[[float], tuple[float, bool]]) -> int:
        return command(name, state, (lambda t_s: (0.0, t_s > 0.1)) if name == "hold" else motion)

    controller._command = slow  # type: ignore[method-assign]
    eyes = Eyes()
    stop_of(controller, clock, eyes=eyes).run()
    assert {one for one in eyes.told_of if one[0] == "goes on"} == {("goes on", 0.0)}
