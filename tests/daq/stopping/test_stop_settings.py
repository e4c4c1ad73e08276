"""The safe stop by the book: its defaults, its times, what it asks for when, and what it says at the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from bufferstand.daq.motions import safe_stop as module
from bufferstand.daq.motions.safe_stop import SafeStop, SafeStopSettings
from bufferstand.daq.motions.stop_observer import ForceSeen
from bufferstand.drivers import EndReason, MotionState, WriterSeen
from bufferstand.foundation import CommandRejected, DeviceFault, NotInCharge, RampTo, Release
from tests.daq.fake_stand import FakeClock, FakeController, Orders

SETTINGS = SafeStopSettings(release_speed_mm_per_s=20.0, watchdog_s=2.0)


class Eyes:
    """Sees what a test says, and writes down what it is told."""

    def __init__(self, **shown: Any) -> None:
        self.shown = {"goes_on": "", "force": None, "stroke_mm": None, "contact_mm": None} | shown
        self.told_of: list[Any] = []

    def told(self) -> None:
        self.told_of.append("told")

    def done(self, taken_us: int | None) -> None:
        self.told_of.append(("done", taken_us))

    def since(self, tick_us: int | None) -> None:
        self.told_of.append(("since", tick_us))

    def goes_on(self, stopping_s: float = 0.0) -> str:
        self.told_of.append(("goes on", stopping_s))
        return self._of("goes_on")

    def force(self) -> ForceSeen | None:
        return self._of("force")

    def stroke_mm(self) -> float | None:
        return self._of("stroke_mm")

    def contact_mm(self) -> float | None:
        return self._of("contact_mm")

    def _of(self, name: str) -> Any:
        shown = self.shown[name]
        return shown() if callable(shown) else shown


def standing(mm: float = 0.0, orders: Orders | None = None) -> tuple[FakeController, FakeClock]:
    """Return a controller that holds at a stroke, valve on."""
    clock = FakeClock()
    controller = FakeController(clock, orders)
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    if mm:
        controller.start(RampTo(target_mm=mm, speed_mm_per_s=100.0))
        clock.sleep(mm / 100.0 + 0.1)
        controller.feed_watchdog()
    controller.calls.clear()
    return controller, clock


def stop_of(
    controller: FakeController, clock: FakeClock, settings: SafeStopSettings = SETTINGS, **options: Any
) -> SafeStop:
    return SafeStop(controller, clock, settings, options.pop("pump", controller.feed_watchdog), **options)


def commands(controller: FakeController) -> list[str]:
    return [call for call in controller.calls if call in ("hold", "release", "disable")]


def test_its_figures_are_as_they_were_agreed() -> None:
    assert (module.STATUS_REST, module.STATUS_WAIT_S, module.AGREE_S, module.LOOK_S) == (3.0, 0.1, 1.0, 0.02)
    assert module.VALVE_OFF == (MotionState.OFF, MotionState.READY)
    plain = SafeStopSettings(20.0, 2.0)
    assert (plain.zero_force_kN, plain.hold_s, plain.limit_s, plain.stays_where_unloaded) == (
        2.0,
        1.0,
        60.0,
        False,
    )


def test_it_stops_once_until_it_is_armed_anew() -> None:
    controller, clock = standing(10.0)
    stop = stop_of(controller, clock)
    assert stop.report is None
    first = stop.run()
    assert stop.report is first
    controller.calls.clear()
    assert stop.run(emergency=True) is first
    assert controller.calls == []
    stop.arm()
    assert stop.report is None
    again = stop.run()
    assert again is not first
    assert commands(controller) == [], "the valve is off already"
    assert again.problems == ()


def test_what_is_not_this_programs_is_left_alone() -> None:
    controller, clock = standing(10.0)
    stop = stop_of(controller, clock)
    stop.run()
    controller.calls.clear()
    stop.leave("another controller answers")
    assert stop.report is None
    report = stop.run()
    assert controller.calls == []
    assert (report.safe, report.by, report.state, report.duration_s) == (False, "nobody", None, 0.0)
    assert (report.force_kN, report.stroke_mm, report.force_source) == (None, None, "")
    assert (report.line, report.problems) == ("nothing was sent: another controller answers", ())


def test_an_actuator_that_was_on_is_told_to_stop_before_it_is_asked_anything() -> None:
    controller, clock = standing(10.0)
    seen = controller.status()
    controller.calls.clear()
    stop_of(controller, clock, pump=lambda: None).run(seen=seen)
    assert controller.calls[0] == "hold"
    for unsure in (replace(seen, state=MotionState.OFF), replace(seen, fault_code=4), None):
        controller, clock = standing(10.0)
        stop_of(controller, clock, pump=lambda: None).run(seen=unsure)
        assert controller.calls[:2] == ["status", "hold"]


def test_in_an_emergency_and_where_a_hold_takes_several_requests_it_releases_at_once() -> None:
    controller, clock = standing(10.0)
    stop_of(controller, clock).run(emergency=True)
    assert commands(controller) == ["release", "disable"]
    controller, clock = standing(10.0)
    controller.stops_at_once = False  # type: ignore[misc]
    hurried: list[bool] = []
    start = controller.start

    def noted(motion: Any, *, hurry: bool = False) -> int:
        hurried.append(hurry)
        return start(motion, hurry=hurry)

    controller.start = noted  # type: ignore[method-assign]
    stop_of(controller, clock).run()
    assert commands(controller) == ["release", "disable"]
    assert hurried == [True]
    controller, clock = standing(10.0)
    start, hurried[:] = controller.start, []
    controller.start = noted  # type: ignore[method-assign]
    stop_of(controller, clock).run()
    assert hurried == [False, False]


def test_the_eyes_are_told_of_each_command_and_how_long_a_sine_may_slow_down() -> None:
    controller, clock = standing(10.0)
    controller.taken_us = 4711  # type: ignore[misc]
    eyes = Eyes()
    stop_of(controller, clock, eyes=eyes).run(stopping_s=0.25)
    assert eyes.told_of[:2] == ["told", ("done", 4711)]
    assert eyes.told_of.count("told") == 2
    assert ("goes on", 0.0) in eyes.told_of, "a release is no sine"
    controller, clock = standing()
    hold = controller._command

    def slow(name: str, state: MotionState, motion: Callable[[float], tuple[float, bool]]) -> int:
        return hold(name, state, (lambda t_s: (0.0, t_s > 0.1)) if name == "hold" else motion)

    controller._command = slow  # type: ignore[method-assign]
    eyes = Eyes()
    stop_of(controller, clock, eyes=eyes).run(stopping_s=0.25)
    assert ("goes on", 0.25) in eyes.told_of


def test_a_piston_that_goes_on_is_released_in_a_hurry_and_one_that_still_does_is_switched_off() -> None:
    controller, clock = standing(10.0)
    hold = controller._command

    def endless(name: str, state: MotionState, motion: Callable[[float], tuple[float, bool]]) -> int:
        return hold(name, state, lambda _: (controller.mm, False))

    controller._command = endless  # type: ignore[method-assign]
    report = stop_of(controller, clock, eyes=Eyes(goes_on="it went on")).run()
    assert commands(controller) == ["hold", "release", "disable"]
    assert report.problems == (
        "it went on after the hold: released at once",
        "it went on after the release: valve off at once",
    )
    assert report.duration_s < 1.5
    assert not report.safe
    assert report.state is MotionState.OFF


def test_where_it_may_stay_it_stays_only_without_force() -> None:
    by_hand = replace(SETTINGS, stays_where_unloaded=True)
    for mm, expected in ((0.4, ["hold", "disable"]), (0.41, ["hold", "release", "disable"])):
        controller, clock = standing(mm)  # 5 kN/mm: 2.0 and 2.05 kN
        stop_of(controller, clock, by_hand).run()
        assert commands(controller) == expected
    controller, clock = standing(0.2)
    stop_of(controller, clock).run()
    assert commands(controller) == ["hold", "release", "disable"]
    for shown, expected in (
        (ForceSeen(2.0, "force", True), ["hold", "disable"]),
        (ForceSeen(-2.1, "force", True), ["hold", "release", "disable"]),
        (ForceSeen(0.0, "force", True, (("force_2", 9.0),)), ["hold", "release", "disable"]),
    ):
        controller, clock = standing(0.2)
        stop_of(controller, clock, by_hand, eyes=Eyes(force=shown)).run()
        assert commands(controller) == expected


@pytest.mark.parametrize(
    ("force", "safe"),
    [
        (ForceSeen(2.0, "force", True), True),
        (ForceSeen(-2.0, "force", True), True),
        (ForceSeen(2.01, "force", True), False),
        (ForceSeen(0.0, "force", True, (("force_2", 9.0),)), False),
        (ForceSeen(0.0, "force", True, silent=("force_2",)), True),
    ],
)
def test_safe_is_said_of_every_way_to_the_force(force: ForceSeen, safe: bool) -> None:
    controller, clock = standing()
    report = stop_of(controller, clock, eyes=Eyes(force=force, stroke_mm=0.04)).run()
    assert report.safe is safe
    assert ("NOT SAFE: use the stand's emergency stop" in report.line) is not safe
    assert (report.force_kN, report.stroke_mm) == (force.force_kN, 0.04)
    assert report.force_source == force.source
    assert ", stroke 0.0 mm, valve off, after " in report.line


def test_samples_that_show_no_force_at_once_are_not_waited_for_and_others_for_a_second() -> None:
    controller, clock = standing()
    controller.disable()
    began_s = clock.now_s()
    stop_of(controller, clock, eyes=Eyes(force=ForceSeen(0.0, "force", True))).run()
    assert clock.now_s() == began_s
    eyes = Eyes(force=None)
    report = stop_of(controller, clock, eyes=eyes).run()
    assert 1.0 <= report.duration_s <= 1.03
    assert eyes.told_of == [("since", None)]
    assert report.force_source == module.OWN_READING
    for pending in (ForceSeen(0.0, "f", True, silent=("g",)), ForceSeen(5.0, "f", True)):
        assert stop_of(controller, clock, eyes=Eyes(force=pending)).run().duration_s >= 1.0


def test_words_beside_the_force_are_said_and_minus_nothing_is_nothing() -> None:
    controller, clock = standing()
    seen = ForceSeen(-0.04, "force", True, beside="both ways differ")
    line = stop_of(controller, clock, eyes=Eyes(force=seen, stroke_mm=-0.04)).run().line
    assert line.startswith(
        "safe stop: force 0.0 kN (channel force, zero taken off), stroke 0.0 mm, valve off"
    )
    assert line.endswith("; both ways differ")


def test_its_own_reading_is_named_once_or_where_only_the_stroke_is_read() -> None:
    controller, clock = standing()
    plain = stop_of(controller, clock).run().line
    assert plain.count(module.OWN_READING) == 1
    controller, clock = standing()
    line = stop_of(controller, clock, eyes=Eyes(force=ForceSeen(0.0, "force", True))).run().line
    assert f"stroke 0.0 mm ({module.OWN_READING})" in line


class Lost(FakeController):
    """A controller that this program is no longer in charge of."""

    in_charge = False
    writer = WriterSeen(4711, "a program")

    def seen_writer(self) -> WriterSeen:
        if self.writer.number == -1:
            raise DeviceFault("no answer")
        return self.writer


@pytest.mark.parametrize(
    ("number", "state", "safe", "words"),
    [
        (
            4711,
            MotionState.OFF,
            False,
            "nothing was sent: another program has the stand: a program; last seen: force",
        ),
        (0, MotionState.OFF, True, "safe stop: force 0.0 kN"),
        (
            0,
            MotionState.HOLDING,
            False,
            "nothing was sent: no program has the right to give it commands, this one",
        ),
        (
            -1,
            MotionState.OFF,
            False,
            "nothing was sent: another program may have the stand (no answer); last seen",
        ),
    ],
)
def test_another_programs_stand_is_looked_at_only(
    number: int, state: MotionState, safe: bool, words: str
) -> None:
    clock = FakeClock()
    controller = Lost(clock)
    controller.state, controller.writer = state, WriterSeen(number, "a program" if number else "")
    report = stop_of(controller, clock, pump=lambda: None).run()
    assert commands(controller) == []
    assert (report.by, report.safe) == ("nobody", safe)
    assert report.line.startswith(words)
    if not safe:
        assert report.line.endswith(
            "; NOT SAFE: it is not this program's to stop; look at the stand, which has its emergency stop"
        )


def test_a_right_that_is_lost_meanwhile_ends_it() -> None:
    controller, clock = standing(40.0, Orders(lock_lost_at_s=0.8, writer=4711))
    report = stop_of(controller, clock, pump=lambda: None).run()
    assert report.by == "nobody"
    assert "another program has the stand" in report.line
    assert not report.safe


def test_a_request_that_fails_is_made_again_each_tenth_of_a_second_until_the_watchdog_has_acted() -> None:
    controller, clock = standing()
    controller.orders.wire_down = lambda _: True
    began_s = clock.now_s()
    report = stop_of(controller, clock, pump=lambda: None).run()
    assert (report.by, report.safe, report.state) == ("watchdog", False, None)
    assert report.line.startswith(
        "safe stop: the controller does not answer; its own watchdog (2 s) has to ramp"
    )
    assert (report.force_kN, report.stroke_mm, report.force_source) == (None, None, "")
    took_s = clock.now_s() - began_s
    assert 3.0 < took_s < 3.5, "the watchdog's time and a second"
    assert len(controller.calls) == pytest.approx(took_s / 0.1, abs=4)


def test_a_refused_request_and_a_lost_right_are_made_once() -> None:
    for refusal in (CommandRejected("not now"), NotInCharge("taken")):
        controller, clock = standing()
        asked: list[float] = []

        def refused(
            refusal: Exception = refusal, asked: list[float] = asked, clock: FakeClock = clock
        ) -> None:
            asked.append(clock.now_s())
            raise refusal

        controller.disable = refused  # type: ignore[method-assign]
        report = stop_of(controller, clock).run()
        assert len(asked) == 1
        assert any(str(refusal) in problem for problem in report.problems)
        assert "VALVE NOT OFF (state holding)" in report.line
        assert not report.safe


def test_the_same_trouble_is_noted_once() -> None:
    controller, clock = standing()

    def broken() -> None:
        raise ValueError("torn")

    report = stop_of(controller, clock, pump=broken).run()
    assert report.problems == ("acquisition failed during the stop: ValueError('torn')",)
    assert "feed_watchdog" in controller.calls
    controller, clock = standing()

    def unfed() -> None:
        raise DeviceFault("no way")

    controller.feed_watchdog = unfed  # type: ignore[method-assign]
    report = stop_of(controller, clock, pump=broken).run()
    assert report.problems[1:] == ("watchdog not fed: no way",)
    assert report.line.endswith(
        "(acquisition failed during the stop: ValueError('torn'); watchdog not fed: no way)"
    )


def test_a_release_of_a_wrong_force_ends_where_nothing_touches() -> None:
    controller, clock = standing()
    start = controller.start

    def farther(motion: Any, *, hurry: bool = False) -> int:
        number = start(motion, hurry=hurry)
        if isinstance(motion, Release):
            controller._motion = lambda t_s: (-50.0 * t_s, False)
        return number

    controller.start = farther  # type: ignore[method-assign]
    wrong = ForceSeen(3.0, "force", True)
    report = stop_of(controller, clock, eyes=Eyes(force=wrong, contact_mm=1.5)).run()
    assert any("though the stand has let go" in problem for problem in report.problems)
    assert -7.0 < controller.mm < -5.0
    assert commands(controller)[-1] == "disable"


def test_a_controller_that_falls_back_by_itself_is_waited_for_until_no_force_is_left() -> None:
    controller, clock = standing(40.0)
    controller._fault(4, EndReason.DEVICE_LIMIT, clock.now_s())
    controller.fault_code = 4
    report = stop_of(controller, clock, pump=lambda: None).run()
    assert commands(controller) == ["disable"]
    assert (report.by, report.safe, report.state) == ("controller", True, MotionState.FAULT)
    assert report.line.startswith("safe stop by the controller itself: force 0.0 kN")
    assert 0.7 < report.duration_s < 1.2, "40 mm at its own 50 mm/s"
