"""What a stop sees of the samples: a piston that goes on; the force that is left, its zero taken off."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.daq.motions.safe_stop import SafeStop, SafeStopSettings
from bufferstand.daq.motions.stop_observer import LEAST_MM_PER_S, SETTLE_S, ForceSeen, SampleObserver
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.interfaces import ControllerStatus, Stand
from bufferstand.foundation.channels.zero import ChannelZero, Zero
from bufferstand.foundation.motions import ControllerMotion, RampTo, StandStill
from tests.daq.fake_stand import FakeClock, FakeController, Orders, fake_stand

KN_PER_MM = 20.0


def eyes_on(clock: FakeClock, stand: Stand) -> tuple[SampleObserver, Acquisition]:
    acquisition = Acquisition(
        stand, clock, GuardPanel(GuardSet((), (), ControllerGuard(5.0, 5.0, 1000.0)), wall_s=0.0)
    )
    return SampleObserver(acquisition, 600.0), acquisition


def seen(
    speed_mm_per_s: Callable[[float], float], *, stopping_s: float = 0.0, late_s: float = 0.01
) -> tuple[str, float]:
    """Return what is said of a piston that moves so after a stop at 0 s, and when [s]."""
    clock = FakeClock()
    eyes, _ = eyes_on(clock, fake_stand(clock)[0])
    clock.sleep(0.9 + late_s)
    time_s = np.arange(-0.1, 1.0, 0.001)
    speed = np.array([speed_mm_per_s(t) for t in time_s])
    mm = np.round(30.0 + np.cumsum(speed) * 0.001, 2)
    for row in range(0, len(time_s), 10):
        block = slice(row, row + 10)
        if row == 100:
            eyes.told()
            eyes.done(1_000_000)
        clock.sleep(0.01)
        stamps = np.round((time_s[block] + 1.0) * 1e6).astype(np.int64)
        values = {"position": mm[block], "force": KN_PER_MM * mm[block]}
        received_s = float(time_s[block][-1]) + 1.0 + late_s
        eyes.take(ScaledBlock("controller", row, stamps, values, 0, received_s))
        if row >= 100 and (said := eyes.goes_on(stopping_s)):
            return said, float(time_s[block][-1])
    return "", 1.0


def test_a_piston_that_settles_is_left_alone() -> None:
    assert seen(lambda t: 50.0 if t < 0.0 else 50.0 * math.exp(-t / 0.014)) == ("", 1.0)


def test_one_that_goes_on_is_seen_when_it_should_have_settled() -> None:
    said, at_s = seen(lambda _: 50.0)
    assert said.startswith("the piston went on toward more force (")
    assert SETTLE_S < at_s < SETTLE_S + 0.04


@pytest.mark.parametrize("taken_us", [1_000_000, None])
def test_samples_from_before_the_command_that_come_late_tell_nothing_of_it(taken_us: int | None) -> None:
    """A reader 0.3 s behind reads of a piston that ran until it was told to stop, and stood 40 ms later."""
    clock = FakeClock()
    eyes, acquisition = eyes_on(clock, fake_stand(clock)[0])
    clock.sleep(1.0)
    time_s = np.arange(0.5, 1.5, 0.001)
    mm = 30.0 + 50.0 * np.minimum(time_s, 1.04)
    eyes.told()
    eyes.done(taken_us)
    for row in range(0, len(time_s), 10):
        block = slice(row, row + 10)
        acquisition._up_to_date = bool(time_s[block][-1] > 1.1)
        stamps = np.round(time_s[block] * 1e6).astype(np.int64)
        values = {"position": mm[block], "force": KN_PER_MM * mm[block]}
        eyes.take(ScaledBlock("controller", row, stamps, values, 0, clock.now_s()))
        assert eyes.goes_on() == ""
        clock.sleep(0.003)


def test_the_tick_of_a_command_is_found_where_the_devices_clock_has_wrapped() -> None:
    clock = FakeClock()
    eyes, _ = eyes_on(clock, fake_stand(clock)[0])
    begin_us = 3 * 2**32 - 20_000

    def show(first: int, kN: float) -> None:
        stamps = begin_us + 1000 * np.arange(first, first + 10, dtype=np.int64)
        values = {"position": np.full(10, 1.0), "force": np.full(10, kN)}
        eyes.take(ScaledBlock("controller", first, stamps, values, 0, clock.now_s()))

    show(0, 40.0)
    eyes.since(5_000)  # 25 ms after the first sample
    assert eyes.force() is None
    show(10, 40.0)
    assert eyes.force() is None
    show(20, 1.0)
    found = eyes.force()
    assert found is not None
    assert found.force_kN == pytest.approx(1.0)


def test_one_that_begins_to_move_though_it_stood_is_seen_too() -> None:
    said, _ = seen(lambda t: 0.0 if t < 0.1 else 2.0 * LEAST_MM_PER_S)
    assert said


@pytest.mark.parametrize("speed_mm_per_s", [-50.0, 0.0, 0.5 * LEAST_MM_PER_S])
def test_one_that_draws_back_or_creeps_is_no_runaway(speed_mm_per_s: float) -> None:
    assert seen(lambda _: speed_mm_per_s) == ("", 1.0)


def test_a_sine_may_slow_down_at_its_own_acceleration_and_no_slower() -> None:
    """Speed 63 mm/s of ± 10 mm at 1 Hz goes in 1 / (2 π f) = 0.16 s."""
    stopping_s = 1.0 / (2.0 * math.pi)

    def slowing(t_s: float) -> float:
        return 63.0 * min(1.0, max(0.0, 1.0 - t_s / stopping_s))

    assert seen(slowing, stopping_s=stopping_s) == ("", 1.0)
    assert seen(slowing)[0], "another motion stops at once"
    said, at_s = seen(lambda _: 63.0, stopping_s=stopping_s)
    assert said
    assert at_s < stopping_s


def test_a_sine_behind_its_turn_has_yet_to_reach_the_speed_that_it_stops_from() -> None:
    """A piston 40 ms behind its command stands when that is told to stop, and follows it nevertheless."""
    lag_s, rad_per_s, most_mm_per_s = 0.04, 2.0 * math.pi * 0.85, 80.0
    before = most_mm_per_s * math.sin(rad_per_s * lag_s)

    def commanded(t_s: float) -> float:
        if t_s < 0.0:
            return most_mm_per_s * math.sin(rad_per_s * (t_s + lag_s))
        return max(0.0, before - most_mm_per_s * rad_per_s * t_s)

    assert seen(lambda t: commanded(t - lag_s), stopping_s=1.0 / rad_per_s) == ("", 1.0)
    said, at_s = seen(lambda t: commanded(min(t - lag_s, 0.0)), stopping_s=1.0 / rad_per_s)
    assert said, "one that keeps that speed goes on"
    assert at_s < 1.0 / rad_per_s


def zero(force_kN: float) -> Zero:
    one = ChannelZero(name="force", unit="kN", value=force_kN, u=0.05)
    return Zero(how="tare", found=datetime.now(UTC), channel=(one,))


def test_the_force_that_is_left_is_that_of_the_channel_with_its_zero_taken_off() -> None:
    clock = FakeClock()
    stand, _ = fake_stand(clock, Orders(add={"force": lambda _: 3.0}))
    eyes, acquisition = eyes_on(clock, stand)
    assert eyes.force() is None, "nothing was sampled yet"
    clock.sleep(0.1)
    acquisition.tick()
    found = eyes.force()
    assert found is not None
    assert found.source == "channel force, no zero taken off"
    assert found.force_kN == pytest.approx(3.0)
    acquisition.take_zero(zero(3.0))
    clock.sleep(0.1)
    acquisition.tick()
    found = eyes.force()
    assert found is not None
    assert found.source == "channel force, zero taken off"
    assert found.force_kN == pytest.approx(0.0)
    clock.sleep(1.0)
    assert eyes.force() is None, "of a second ago: it says nothing of now"


def test_the_channel_whose_zero_is_known_best_is_taken_and_one_that_cannot_be_is_named() -> None:
    clock = FakeClock()
    stand, _ = fake_stand(clock)
    eyes, acquisition = eyes_on(clock, stand)
    facts = acquisition.facts["controller"]
    second = facts.channels[0].model_copy(update={"name": "force_2"})
    rough = second.uncertainty.model_copy(update={"zero": 2.0})
    fine = second.uncertainty.model_copy(update={"zero": 0.1})
    acquisition._facts = {
        "controller": replace(facts, channels=(facts.channels[0].model_copy(update={"uncertainty": rough}),)),
        "amplifier": replace(facts, channels=(second.model_copy(update={"uncertainty": fine}),)),
    }

    def show(stream: str, name: str, kN: float) -> None:
        stamps = np.arange(3, dtype=np.int64) * 1000
        eyes.take(ScaledBlock(stream, 0, stamps, {name: np.full(3, kN)}, 0, clock.now_s()))

    show("controller", "force", 0.5)
    show("amplifier", "force_2", 0.1)
    found = eyes.force()
    assert found is not None
    assert (found.channel, found.other_kN) == ("force_2", ())
    assert found.force_kN == pytest.approx(0.1)
    show("controller", "force", 40.0)
    found = eyes.force()
    assert found is not None
    assert found.source == "channel force_2, no zero taken off; force shows 40.0 kN"
    show("amplifier", "force_2", -204800.0)
    found = eyes.force()
    assert found is not None
    assert found.source == "channel force, no zero taken off; force_2 shows what cannot be"


class Off(FakeController):
    """A controller whose own reading of the force is off, as nobody has set its zero."""

    off_kN = 0.0

    def status(self) -> ControllerStatus:
        true = super().status()
        return replace(true, force_kN=true.force_kN + self.off_kN)


def stopped(off_kN: float, orders: Orders | None = None) -> tuple[SafeStop, Acquisition]:
    clock = FakeClock()
    controller = Off(clock, orders)
    controller.off_kN = off_kN
    stand = Stand(controller, ())
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    controller.start(RampTo(target_mm=1.0, speed_mm_per_s=20.0))
    clock.sleep(0.5)
    eyes, acquisition = eyes_on(clock, stand)
    acquisition.tick()
    return SafeStop(
        controller, clock, SafeStopSettings(20.0, 2.0), pump=acquisition.tick, eyes=eyes
    ), acquisition


def test_a_controller_whose_zero_is_off_does_not_make_an_unloaded_stand_unsafe() -> None:
    stop, _ = stopped(off_kN=3.0)
    report = stop.run()
    assert report.safe
    assert report.force_source == "channel force, no zero taken off"
    assert "safe stop: force 0.0 kN (channel force, no zero taken off), stroke" in report.line


def test_nor_a_loaded_one_safe() -> None:
    """5 kN are left, as it refuses to release; its own reading says −1 kN."""
    stop, _ = stopped(off_kN=-6.0, orders=Orders(reject=frozenset({"release"})))
    report = stop.run()
    assert not report.safe
    assert report.force_kN == pytest.approx(5.0, abs=0.01)
    assert "NOT SAFE" in report.line


def test_the_zero_is_taken_off_what_a_stop_judges() -> None:
    stop, acquisition = stopped(off_kN=3.0, orders=Orders(add={"force": lambda _: 3.0}))
    acquisition.take_zero(zero(3.0))
    report = stop.run()
    assert report.safe
    assert report.force_source == "channel force, zero taken off"


def test_the_zero_is_taken_off_the_stroke_that_a_stop_shows() -> None:
    """Wires 1.05 mm off, as the controller's own reading is: a force and a stroke of two zeros mislead."""
    off: dict[str, Callable[[float], float]] = {name: lambda _: 1.05 for name in ("stroke_1", "stroke_2")}
    stop, acquisition = stopped(off_kN=0.0, orders=Orders(add=off))
    channels = (ChannelZero(name=name, unit="mm", value=1.05, u=0.05) for name in off)
    acquisition.take_zero(Zero(how="tare", found=datetime.now(UTC), channel=tuple(channels)))
    report = stop.run()
    assert report.stroke_mm == pytest.approx(0.0, abs=0.02)
    assert "stroke 0.0 mm, valve off" in report.line


class SecondForce:
    """Sees an unloaded stand; a second channel shows the force of a moment ago, for so long after 0.5 s."""

    def __init__(self, clock: FakeClock, late_s: float) -> None:
        self._clock, self._until_s = clock, 0.5 + late_s

    def told(self) -> None:
        pass

    def done(self, taken_us: int | None) -> None:
        pass

    def since(self, tick_us: int | None) -> None:
        pass

    def goes_on(self, stopping_s: float = 0.0) -> str:  # noqa: ARG002 - as Eyes
        return ""

    def force(self) -> ForceSeen:
        late = self._clock.now_s() < self._until_s
        return ForceSeen(0.1, "force", True, (("force_2", 8.0),) if late else ())

    def stroke_mm(self) -> float | None:
        return None

    def contact_mm(self) -> float | None:
        return None


@pytest.mark.parametrize(("late_s", "safe"), [(0.8, True), (100.0, False)])
def test_a_second_channel_whose_samples_come_later_is_waited_for_but_not_for_long(
    late_s: float, safe: bool
) -> None:
    clock = FakeClock()
    controller = FakeController(clock)
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    clock.sleep(0.5)
    report = SafeStop(
        controller, clock, SafeStopSettings(20.0, 2.0), controller.feed_watchdog,
        eyes=SecondForce(clock, late_s),
    ).run()  # fmt: skip
    assert report.safe is safe, report.line
    assert ("force_2 shows 8.0 kN" in report.line) is not safe
    assert report.duration_s < 1.5


class LateForce(SecondForce):
    """The amplifier, whose samples come first, shows no force; the controller, later, shows some."""

    def force(self) -> ForceSeen:
        if self._clock.now_s() < self._until_s:
            return ForceSeen(0.1, "force_2", tared=True, silent=("force",))
        return ForceSeen(8.0, "force", True, (("force_2", 0.1),))


@pytest.mark.parametrize("stays", [False, True])
def test_the_first_channel_to_show_no_force_does_not_decide(stays: bool) -> None:
    clock = FakeClock()
    controller = FakeController(clock)
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    controller.start(RampTo(target_mm=1.0, speed_mm_per_s=20.0))
    clock.sleep(0.5)
    report = SafeStop(
        controller, clock, SafeStopSettings(20.0, 2.0, stays_where_unloaded=stays),
        controller.feed_watchdog, eyes=LateForce(clock, 0.3),
    ).run()  # fmt: skip
    assert not report.safe, report.line
    assert "force 8.0 kN (channel force, zero taken off; force_2 shows 0.1 kN)" in report.line
    assert report.stroke_mm == pytest.approx(0.0, abs=0.02), "it was released, also where it may stay"


def test_a_channel_that_shows_nothing_of_the_present_is_named() -> None:
    clock = FakeClock()
    controller = FakeController(clock)
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    report = SafeStop(
        controller, clock, SafeStopSettings(20.0, 2.0), controller.feed_watchdog,
        eyes=LateForce(clock, 100.0),
    ).run()  # fmt: skip
    assert report.safe, report.line
    assert "(channel force_2, zero taken off; force shows nothing of the present)" in report.line


def test_without_fresh_samples_the_controllers_own_reading_is_judged_and_named() -> None:
    stop, _ = stopped(off_kN=0.0, orders=Orders(silent_from_s=0.1))
    report = stop.run()
    assert report.safe
    assert report.force_source == "the controller's own reading"
    assert report.line.count("the controller's own reading") == 1, "of force and stroke alike"


def test_an_emergency_while_it_holds_ends_the_hold() -> None:
    clock = FakeClock()
    controller = FakeController(clock)
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    controller.start(RampTo(target_mm=40.0, speed_mm_per_s=80.0))
    clock.sleep(0.9)
    controller.feed_watchdog()
    hold = controller.start

    def endless(motion: ControllerMotion, *, hurry: bool = False) -> int:
        number = hold(motion, hurry=hurry)
        if not isinstance(motion, StandStill):
            return number
        controller._motion = lambda _: (controller.mm, False)
        return controller.sequence

    controller.start = endless  # type: ignore[method-assign]
    stop = SafeStop(
        controller,
        clock,
        SafeStopSettings(20.0, 2.0),
        pump=controller.feed_watchdog,
        emergency=lambda: clock.now_s() > 1.0,
    )
    report = stop.run()
    assert report.safe
    assert report.problems == ("a guard demanded an emergency after the hold: released at once",)
    assert report.duration_s < 2.0 + 0.5
