"""A computer that sleeps, and a controller that is started anew: in a wait, valve off, and under force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from bufferstand.daq.operator.progress import CampaignProgress
from bufferstand.drivers.interfaces import MotionState
from bufferstand.drivers.register_maps.profile import load_profile
from bufferstand.drivers.simulated.inprocess.register_wire import Lost
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.foundation.errors import ExitStatus, NotInCharge
from tests.daq.cases import Lines
from tests.daq.test_lock import BRIEF, COOLS, ELSEWHERE, FEED, INTRUDER, TwoPrograms

PROFILE = load_profile("ring")
WAITS = "waits for the specimen"
HOLDS = '[[step]]\nkind = "hold"\nstroke_mm = 20.0\nduration_s = 40.0\n'


class Drowsy(Lines):
    """What is shown, by a program that stands still for a while as soon as it is time to."""

    def __init__(self, due: Callable[[], bool], sleep: Callable[[], object]) -> None:
        super().__init__()
        self._due, self._sleep = due, sleep
        self.slept = False

    def update(self, progress: CampaignProgress) -> None:
        super().update(progress)
        self.fall_asleep()

    def fall_asleep(self) -> None:
        if not self.slept and self._due():
            self.slept = True
            self._sleep()


class Sleeper(TwoPrograms):
    """A campaign whose program stands still for a time, between two requests or within one."""

    def __init__(
        self, folder: Path, for_s: float, *, steps: str = COOLS, within: bool = False, touch: bool = False
    ) -> None:
        more = {"zero": ""} if touch else {}
        super().__init__(folder, steps, initial_C=21.0 if steps == HOLDS else 25.06, **more)
        self.within = within
        self.due: Callable[[], bool] = self.waits
        self.began: list[float] = []
        self.shown = self.drowsy = Drowsy(lambda: bool(self.due()), lambda: self.clock.sleep(for_s))
        if within:
            self.drowsy.update = self.drowsy.snapshots.append  # type: ignore[method-assign]

    def waits(self) -> bool:
        off = not self.opened.device.controller.valve_on
        if not self.began and off and any(WAITS in line for line in self.shown.lines):
            self.began.append(self.clock.now_s())
        return bool(self.began) and self.clock.now_s() > self.began[0] + 2.0

    def _seen(self, request: bytes) -> Any:
        if getattr(self, "within", False):
            self.drowsy.fall_asleep()
        return super()._seen(request)

    def said(self, text: str) -> list[str]:
        return [line for line in self.shown.lines if text in line]


@pytest.mark.parametrize(
    ("for_s", "within"),
    [(30.0, True), *(
        pytest.param(for_s, within, marks=pytest.mark.long)
        for for_s, within in [(1.5, False), (5.0, True), (30.0, False), (600.0, True), (600.0, False)]
    )],
)  # fmt: skip
def test_a_computer_that_sleeps_in_a_wait_goes_on_waiting(tmp_path: Path, for_s: float, within: bool) -> None:
    """The lock falls free behind 10 s: it is taken again before anything else is written."""
    two = Sleeper(tmp_path, for_s, within=within)
    outcome = two.run()
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    note = two.said("the computer slept")[0]
    assert f"slept {for_s:.0f} s" in note
    assert "taken again; the wait goes on" in note
    assert not two.said("heartbeat")
    assert not two.said("WARNING: the controller")
    assert two.writer == 0, "given back at the end"
    truth = two.opened.truth.arrays()
    woke = truth["time_us"] >= (two.began[0] + 2.0) * 1e6
    assert np.count_nonzero(woke) > 1000
    assert abs(truth["force_kN"][-1]) < 0.5


def test_a_short_sleep_is_no_silence_wherever_in_a_pass_it_comes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Behind the samples of a pass, and before their silence is judged: nobody has asked for new ones."""
    two = Sleeper(tmp_path, 2.9, within=True)
    two.within = False  # nor within a request
    sensor = two.stand.sensors[0]
    drain = sensor.drain

    def slowly() -> Any:
        two.drowsy.fall_asleep()
        return drain()

    monkeypatch.setattr(sensor, "drain", slowly)
    outcome = two.run()
    assert two.drowsy.slept
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    assert two.said("the computer slept 3 s")


def test_what_another_program_did_meanwhile_is_no_command_without_the_right_to(tmp_path: Path) -> None:
    """It had the lock, moved the piston, and gave both back before this one woke."""
    two = Sleeper(tmp_path, 30.0)
    machine = two.opened.device.controller

    def moved() -> None:
        machine.echo_sequence = 4242

    moved_s = two.at(lambda: two.drowsy.slept and two.writer == 0, moved)
    outcome = two.run()
    assert moved_s
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    assert two.said("taken again; the wait goes on")
    assert machine.echo_sequence > 4242, "it counts on from there"


@pytest.mark.parametrize("lives", [True, pytest.param(False, marks=pytest.mark.long)])
def test_a_stand_that_is_anothers_behind_a_sleep_is_left_to_it(tmp_path: Path, lives: bool) -> None:
    two = Sleeper(tmp_path, 30.0)
    feeds = iter(range(30_000, 60_000))

    def holds(_: float) -> None:
        if two.drowsy.slept and two.writer == INTRUDER and lives:
            two.bank.write(FEED, [next(feeds)])

    two.clock.listen(holds)
    taken = two.at(lambda: two.drowsy.slept and two.writer == 0, two.take_over)
    outcome = two.run()
    if not lives:  # it was killed: the controller drops it, and the wait goes on
        assert outcome.status == "complete", outcome.reason
        return
    assert (outcome.status, outcome.exit_status) == ("failed", ExitStatus.DEVICE_FAULT)
    assert "the computer slept 30 s" in outcome.reason
    assert f"another program gives the controller commands: {ELSEWHERE}" in outcome.reason
    assert "and it lives" in outcome.reason
    assert len(outcome.reason) < 300
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.line == "nothing was sent: it is not this program's to stop"
    assert [request for at_s, request in two.written if at_s > taken[0]] == []
    assert two.writer == INTRUDER


@pytest.mark.parametrize(
    ("for_s", "within", "said"),
    [
        (5.0, False, "its watchdog ran out"),
        pytest.param(30.0, True, "its watchdog ran out", marks=pytest.mark.long),
        pytest.param(5.0, True, "its watchdog ran out", marks=pytest.mark.long),
        pytest.param(30.0, False, "its watchdog ran out", marks=pytest.mark.long),
    ],
)
def test_a_sleep_under_force_ends_and_says_so(tmp_path: Path, for_s: float, within: bool, said: str) -> None:
    two = Sleeper(tmp_path, for_s, steps=HOLDS, within=within)
    two.due = lambda: two.state is MotionState.HOLDING and two.clock.now_s() > 15.0
    outcome = two.run()
    assert two.drowsy.slept
    assert (outcome.status, outcome.exit_status) == ("failed", ExitStatus.DEVICE_FAULT)
    assert outcome.reason.startswith(f"this program stood still for {for_s:.0f}.")
    assert "suspended computer, debugger, overloaded machine" in outcome.reason
    assert said in outcome.reason
    assert not two.opened.device.controller.valve_on
    assert abs(two.opened.truth.arrays()["force_kN"][-1]) < 0.5


def test_a_fault_of_the_controller_behind_a_sleep_is_none_from_before(tmp_path: Path) -> None:
    two = Sleeper(tmp_path, 30.0)
    two.at(lambda: two.drowsy.slept, lambda: two.opened.device.controller.fail(cast(Any, 4)))
    outcome = two.run()
    assert (outcome.status, outcome.exit_status) == ("failed", ExitStatus.DEVICE_FAULT)
    assert "the computer slept 30 s" in outcome.reason
    assert "it reports fault 4 (actuator) since" in outcome.reason


@pytest.mark.parametrize("read_write", [True, False])
def test_behind_a_pause_no_sample_is_taken_from_anothers_ring(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, read_write: bool
) -> None:
    """To read is to acknowledge: the lock is asked for first, with function 23 or without."""
    two = TwoPrograms(tmp_path)
    controller = two.stand.controller
    cast(Any, controller)._link._read_write = read_write
    controller.connect()
    controller.enable(force_limit_kN=200.0, stroke_limit_mm=100.0, watchdog_ms=2000)
    two.clock.sleep(0.1)
    assert controller.read_block() is not None
    two.take_over()
    acknowledged: list[int] = []
    write = two.bank.write
    monkeypatch.setattr(two.bank, "write", lambda at, values: acknowledged.append(at) or write(at, values))
    asleep_s = two.clock.now_s() + 5.0
    cast(Any, controller)._link._wire.now_s = lambda: asleep_s
    with pytest.raises(NotInCharge, match="has taken over"):
        controller.read_block()
    assert acknowledged == []


# --- a controller that is started anew ---------------------------------------------------------------


class Restarted(Sleeper):
    """A campaign whose controller is switched off and on while it waits."""

    def __init__(self, folder: Path, for_s: float, *, serial: int | None = None, touch: bool = True) -> None:
        super().__init__(folder, 0.0, touch=touch, steps=(BRIEF if touch else "") + COOLS)
        self.off_s, self.dead = for_s, False
        thermometers = [one for one in self.stand.sensors if one.facts.name != "amplifier"]
        self.stand = replace(self.stand, sensors=tuple(thermometers))  # that one sees the stand before
        file = self.file
        if serial is not None:
            file = replace_seed(self.file, serial)
        self.fresh = open_in_process(file)
        self.again = self.at(self.waits, self._switch_off)

    def _switch_off(self) -> None:
        self.dead = True
        on_s = self.clock.now_s() + self.off_s
        self.at(lambda: self.clock.now_s() >= on_s, self._switch_on)

    def _switch_on(self) -> None:
        fresh, began_s = self.fresh, self.clock.now_s()
        self.clock.listen(lambda now_s: fresh.clock.sleep(now_s - began_s - fresh.clock.now_s()))
        fresh.clock.sleep(0.05)
        self.opened = fresh
        self.bank = RegisterBank(fresh.device, PROFILE, self.clock.now_s)
        cast(Any, self.stand.controller)._link._wire.responder._bank = self.bank
        self.dead = False

    def _seen(self, request: bytes) -> Lost:
        if getattr(self, "dead", False):
            return "request"
        lost: Lost = super()._seen(request)
        return lost


def replace_seed(file: Any, seed: int) -> Any:
    return file.model_copy(update={"simulation": {**file.simulation, "seed": seed}})


@pytest.mark.parametrize(
    "for_s", [15.0, *(pytest.param(for_s, marks=pytest.mark.long) for for_s in (0.2, 1.5, 300.0))]
)
def test_a_controller_that_is_started_anew_in_a_wait_is_taken_again(tmp_path: Path, for_s: float) -> None:
    """Off for less than a request's second try, and for longer than the watchdog."""
    two = Restarted(tmp_path, for_s)
    outcome = two.run()
    assert two.again
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    assert two.said("the controller was started anew meanwhile; by its serial number it is the same one")
    (limits,) = two.said("its limits are no longer those that were set")
    assert "stroke_limit" in limits
    assert two.said("first contact is touched off anew before the next stroke")
    assert two.writer == 0


def test_another_controller_ends_the_wait(tmp_path: Path) -> None:
    two = Restarted(tmp_path, 15.0, serial=99, touch=False)
    two.written.clear()
    outcome = two.run()
    assert (outcome.status, outcome.exit_status) == ("failed", ExitStatus.DEVICE_FAULT)
    assert "another controller answers" in outcome.reason
    assert outcome.safe_stop is not None
    assert not outcome.safe_stop.safe
    assert "another controller answers (serial number 99, before it was " in outcome.safe_stop.line
    assert "NOT SEEN: look at its stand" in outcome.safe_stop.line
    assert "valve off" not in outcome.safe_stop.line, "that was the other one"
    assert [request for at_s, request in two.written if at_s > two.again[0] + 15.0] == []
