"""Commands only with the writer's lock: lost, kept through a wait, left by a killed program; virtual time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.drivers.interfaces import Controller, MotionState
from bufferstand.drivers.register_maps.profile import load_profile
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, behind_a_wire, open_in_process
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.drivers.simulated.wires.modbus_requests import EXCHANGE
from bufferstand.foundation.errors import ExitStatus, NotInCharge
from bufferstand.foundation.motions import RampTo, Release, StandStill
from tests.daq.cases import Lines
from tests.daq.run_in_process import COARSE, facts_of, sample_plan
from tests.daq.test_in_process import campaign
from tests.daq.test_in_use import written_by

PROFILE = load_profile("ring")
WRITER, FEED = PROFILE.find("writer").address, PROFILE.find("watchdog_feed").address
ACKNOWLEDGE = PROFILE.find("ring_acknowledge").address
INTRUDER = 4711
RESUMES = replace(COARSE, awaits_stand=True)
BRIEF = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 2
"""
COOLS = BRIEF + "start_temperature_C = [15.0, 25.0]\n"
ELSEWHERE = f"a program that this computer knows nothing of (number {INTRUDER})"


class TwoPrograms:
    """One stand in virtual time, one bank of registers, and a wire for each program that talks to it."""

    def __init__(self, folder: Path, steps: str = BRIEF, **settings: Any) -> None:
        self.folder = folder
        self.plan, self.file = sample_plan(campaign(folder, steps, **settings))
        self.opened: InProcessStand = open_in_process(self.file)
        self.clock = self.opened.clock
        self.written: list[tuple[float, bytes]] = []
        """What the campaign has written, with the time [s]; neither request numbers nor acknowledgements."""
        self.stand = behind_a_wire(self.opened, self.file, lambda: 0.001, lost=self._seen)
        self.bank: RegisterBank = cast(Any, self.stand.controller)._link._wire.responder._bank
        self.shown = Lines()
        self.request = StopRequest()

    def _seen(self, request: bytes) -> Any:
        acknowledges = int.from_bytes(request[5:7]) == ACKNOWLEDGE
        if written_by(request, PROFILE) and not acknowledges:
            self.written.append((self.clock.now_s(), request))
        return ""

    def other(self) -> Controller:
        """Return another program's driver of the same controller."""
        stand = behind_a_wire(self.opened, self.file, lambda: 0.001)
        link = cast(Any, stand.controller)._link
        link._wire.responder = cast(Any, self.stand.controller)._link._wire.responder
        stand.controller.connect()
        return stand.controller

    def at(self, reached: Callable[[], bool], do: Callable[[], object]) -> list[float]:
        """Do something once, as soon as something is so; the list then holds the time."""
        done: list[float] = []

        def look(now_s: float) -> None:
            if not done and reached():
                done.append(now_s)
                do()

        self.clock.listen(look)
        return done

    def take_over(self, number: int = INTRUDER) -> None:
        """Let another number stand in the register, as it does in a controller that was started anew."""
        assert self.bank.write(WRITER, [0]) == 0
        assert self.bank.write(WRITER, [number]) == 0

    def see_nothing_sent_since(self, lost_s: float) -> None:
        """At most the heartbeat by which the loss is noticed was written, and not later than it was due."""
        late = [(at_s, request) for at_s, request in self.written if at_s > lost_s + 0.002]
        assert len(late) <= 1
        for at_s, request in late:
            assert at_s < lost_s + 0.5
            assert (request[0], int.from_bytes(request[5:7])) == (EXCHANGE, FEED)

    @property
    def state(self) -> MotionState:
        return self.opened.device.controller.state

    @property
    def writer(self) -> int:
        return self.bank.read(WRITER, 1)[0]

    def run(self, settings: RunSettings = COARSE) -> CampaignOutcome:
        return run_campaign(
            self.plan, self.stand, self.clock, self.folder / "out", facts_of(self.file),
            progress=self.shown, stop_request=self.request, settings=settings,
        )  # fmt: skip


@pytest.mark.parametrize("number", [INTRUDER, 0])
def test_a_lock_that_is_lost_under_way_ends_it_and_touches_nothing_more(tmp_path: Path, number: int) -> None:
    two = TwoPrograms(tmp_path)
    machine = two.opened.device.controller
    lost = two.at(
        lambda: machine.state is MotionState.WAVEFORM and machine.cycles_done >= 1,
        lambda: two.take_over(number),
    )
    outcome = two.run()
    assert (outcome.status, outcome.exit_status) == ("failed", ExitStatus.DEVICE_FAULT)
    assert "the right to give commands was lost" in outcome.reason
    two.see_nothing_sent_since(lost[0])
    report = outcome.safe_stop
    assert report is not None
    assert (report.by, report.safe) == ("nobody", False)
    assert report.duration_s < 3.0
    assert two.clock.now_s() - lost[0] < 5.0, "it is noticed soon"
    whose = f"another program has the stand: {ELSEWHERE}" if number else "no program has the right"
    assert report.line.startswith(f"nothing was sent: {whose}")
    assert "last seen: force" in report.line
    assert "(state waveform)" in report.line
    assert report.line in two.shown.lines
    assert two.writer == number
    two.clock.sleep(20.0)
    truth = two.opened.truth.arrays()
    assert abs(truth["force_kN"][-1]) < 0.5, "unfed, its own watchdog has taken the force away"
    assert not two.opened.device.controller.valve_on


def test_no_heartbeat_is_written_for_another(tmp_path: Path) -> None:
    two = TwoPrograms(tmp_path)
    controller = two.stand.controller
    controller.connect()
    first: list[Callable[[], object]] = [controller.feed_watchdog, controller.disable]
    for order in first:
        with pytest.raises(NotInCharge, match="has not the right to give it commands; nothing was sent"):
            order()
    controller.enable(force_limit_kN=200.0, stroke_limit_mm=100.0, watchdog_ms=2000)
    controller.feed_watchdog()
    two.take_over()
    with pytest.raises(NotInCharge, match="has taken over"):
        controller.look_at_lock()
    two.written.clear()
    orders: list[Callable[[], object]] = [
        controller.feed_watchdog,
        controller.disable,
        controller.reset_fault,
        lambda: controller.start(StandStill()),
        lambda: controller.start(RampTo(target_mm=5.0, speed_mm_per_s=5.0)),
        lambda: controller.start(Release(speed_mm_per_s=5.0), hurry=True),
        lambda: controller.start(Release(speed_mm_per_s=5.0)),
        lambda: controller.prepare(Release(speed_mm_per_s=5.0)),
    ]
    two.opened.device.controller.fail(cast(Any, 4))  # there is a fault that could be reset
    two.clock.sleep(1.0)
    for order in orders:
        with pytest.raises(NotInCharge, match="has taken over; nothing more is sent"):
            order()
    controller.give_back()
    assert two.written == []
    assert two.writer == INTRUDER


def test_a_campaign_that_waits_has_the_valve_off_and_the_stand(tmp_path: Path) -> None:
    two = TwoPrograms(tmp_path, COOLS, initial_C=25.08)
    refused: list[str] = []
    valve: list[bool] = []

    def second() -> None:
        valve.append(two.opened.device.controller.valve_on)
        words = {"force_limit_kN": 200.0, "stroke_limit_mm": 100.0, "watchdog_ms": 2000}
        try:
            other.enable(**words)  # type: ignore[arg-type]
        except Exception as error:  # noqa: BLE001 - whatever it is, it must be that refusal
            refused.append(str(error))

    other = two.other()
    began = two.at(lambda: any("waits for the specimen" in line for line in two.shown.lines), lambda: None)
    two.at(lambda: bool(began) and two.clock.now_s() > began[0] + 2.0, second)
    outcome = two.run()
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    assert valve == [False]
    assert "another program (number" in refused[0]
    assert two.writer == 0, "given back at the end of the campaign"


@pytest.mark.parametrize("comes_back", [False, True])
def test_a_lock_lost_in_a_wait_is_asked_for_again(tmp_path: Path, comes_back: bool) -> None:
    """Lost to another program: refused behind the wait. Lost, and free again: it goes on."""
    two = TwoPrograms(tmp_path, COOLS, initial_C=25.08)
    began = two.at(lambda: any("waits for the specimen" in line for line in two.shown.lines), lambda: None)
    lost = two.at(lambda: bool(began) and two.clock.now_s() > began[0] + 2.0, two.take_over)
    feeds = iter(range(30_000, 60_000))

    def holds(_: float) -> None:  # it lives, and so the controller does not drop it
        if lost and not (comes_back and two.clock.now_s() > lost[0] + 2.0):
            two.bank.write(FEED, [next(feeds)])

    two.clock.listen(holds)
    two.at(lambda: comes_back and bool(lost) and two.clock.now_s() > lost[0] + 2.0,
           lambda: two.bank.write(WRITER, [0]))  # fmt: skip
    outcome = two.run()
    assert any("asks for the stand again before it moves" in line for line in two.shown.lines)
    if comes_back:
        assert outcome.status == "complete", outcome.reason
        return
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert f"another program gives the controller commands: {ELSEWHERE}" in outcome.reason
    assert "and it lives" in outcome.reason
    two.see_nothing_sent_since(lost[0])
    assert two.writer == INTRUDER


def left_under_load(two: TwoPrograms, watchdog_ms: int) -> int:
    """Let a program move the stand and die; return its number."""
    dead = two.other()
    dead.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=watchdog_ms)
    sequence = dead.start(RampTo(target_mm=25.0, speed_mm_per_s=100.0))
    while dead.status().done_sequence != sequence:
        two.clock.sleep(0.02)
    dead.feed_watchdog()
    assert abs(dead.status().force_kN) > 20.0
    return two.writer


@pytest.mark.parametrize("watchdog_ms", [2000, 10_000])
def test_resume_waits_for_the_controllers_own_safe_state(tmp_path: Path, watchdog_ms: int) -> None:
    two = TwoPrograms(tmp_path)
    dead, died_s = left_under_load(two, watchdog_ms), two.clock.now_s()
    seen: list[tuple[float, int, bool]] = []
    two.clock.listen(lambda now_s: seen.append((now_s, two.writer, two.opened.device.controller.valve_on)))
    outcome = two.run(RESUMES)
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    first_s = two.written[0][0]
    before = [look for look in seen if look[0] < first_s]
    assert {writer for _, writer, _ in before} == {dead, 0}
    assert not before[-1][2]
    switched_off_s = next(at_s for at_s, _, on in before if not on)
    # By the watchdog; the release of 25 mm at the device's own speed of 20 mm/s or more takes 1.25 s at most.
    assert watchdog_ms / 1e3 < switched_off_s - died_s < watchdog_ms / 1e3 + 2.0
    assert max(10.0, switched_off_s - died_s) < first_s - died_s < max(10.0, watchdog_ms / 1e3 + 2.0) + 2.0
    truth = two.opened.truth.arrays()
    at_first = np.interp(first_s * 1e6, truth["time_us"] - truth["time_us"][0], truth["force_kN"])
    assert abs(at_first) < 0.5
    waits = next(line for line in two.shown.lines if line.startswith("waits for the controller"))
    assert "s at most: another program gives the controller commands" in waits
    assert "(holding, force" in waits
    assert sum(" s at most: " in line for line in two.shown.lines) >= 2, "it counts down"
    assert any("the controller is at rest, and nobody has it" in line for line in two.shown.lines)


def test_refused_tries_make_nobody_wait_longer(tmp_path: Path) -> None:
    two = TwoPrograms(tmp_path)
    left_under_load(two, 2000)
    died_s, tries = two.clock.now_s(), 0
    while (outcome := two.run()).exit_status == ExitStatus.DEVICE_FAULT:
        assert "gives no sign of life. If it was killed, wait" in outcome.reason
        assert two.written == []
        tries += 1
        assert two.clock.now_s() - died_s < 15.0
    assert outcome.status == "complete"
    assert tries >= 3
    assert two.written[0][0] - died_s < 10.0 + 3.0, "a refused try looks for 1.5 s, and one looks at rest"


def test_a_program_that_lives_is_not_waited_for(tmp_path: Path) -> None:
    two = TwoPrograms(tmp_path)
    left_under_load(two, 2000)
    feeds = iter(range(30_000, 60_000))
    two.clock.listen(lambda _: two.bank.write(FEED, [next(feeds)]))
    began_s = two.clock.now_s()
    outcome = two.run(RESUMES)
    assert (outcome.status, outcome.exit_status) == ("refused", ExitStatus.DEVICE_FAULT)
    assert "and it lives: wait for its end, or end it" in outcome.reason
    assert two.clock.now_s() - began_s < 3.0
    assert two.written == []
    assert two.state is MotionState.HOLDING


def test_the_operator_ends_the_wait_with_nothing_written(tmp_path: Path) -> None:
    two = TwoPrograms(tmp_path)
    left_under_load(two, 10_000)
    end_s = two.clock.now_s() + 4.0
    two.at(lambda: two.clock.now_s() > end_s, lambda: two.request.ask(StopLevel.NOW, "Ctrl-C"))
    outcome = two.run(RESUMES)
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT, "nobody saw the stand safe"
    assert "stopped by the operator: Ctrl-C" in outcome.reason
    assert outcome.safe_stop is None
    assert two.written == []
    assert two.state is MotionState.HOLDING


def test_a_motion_that_nothing_ends_is_not_waited_for_for_ever(tmp_path: Path) -> None:
    """A controller whose watchdog does not run out as it should."""
    two = TwoPrograms(tmp_path)
    left_under_load(two, 2000)
    two.clock.listen(lambda _: two.opened.device.controller.watchdog.restart())
    began_s = two.clock.now_s()
    outcome = two.run(RESUMES)
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert "in vain" in outcome.reason
    assert "look at the stand" in outcome.reason
    assert two.clock.now_s() - began_s < 45.0
    assert two.written == []


CONTROL = PROFILE.find("control_word").address


def test_a_valve_that_somebody_else_switches_off_under_load_is_noticed_at_once(tmp_path: Path) -> None:
    """A hold would take half a minute, and nobody would say that it holds nothing."""
    two = TwoPrograms(tmp_path, '[[step]]\nkind = "hold"\nstroke_mm = 20.0\nduration_s = 40.0\n')
    held = two.at(lambda: two.state is MotionState.HOLDING and two.clock.now_s() > 10.0, lambda: None)
    off = two.at(
        lambda: bool(held) and two.clock.now_s() > held[0] + 2.0, lambda: two.bank.write(CONTROL, [0])
    )
    outcome = two.run()
    assert (outcome.status, outcome.exit_status) == ("failed", ExitStatus.DEVICE_FAULT)
    assert "valve is off" in outcome.reason
    assert "where this program had it on" in outcome.reason
    assert two.clock.now_s() - off[0] < 15.0


def test_a_valve_that_somebody_else_switches_on_in_a_wait_is_never_called_safe(tmp_path: Path) -> None:
    two = TwoPrograms(tmp_path, COOLS, initial_C=25.08)
    began = two.at(lambda: any("waits for the specimen" in line for line in two.shown.lines), lambda: None)

    def switch_on() -> None:
        for word in (6, 7, 15):
            assert two.bank.write(CONTROL, [word]) == 0

    two.at(lambda: bool(began) and two.clock.now_s() > began[0] + 2.0, switch_on)
    outcome = two.run()
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert "valve is on" in outcome.reason
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.safe is not two.opened.device.controller.valve_on
    assert not two.opened.device.controller.valve_on, "it had the lock: it has switched it off"
