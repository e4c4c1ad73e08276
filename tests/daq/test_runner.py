"""A campaign from start to its end, for every reason to end, on a stand whose faults can be ordered."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.drivers.interfaces import MotionState
from bufferstand.foundation.errors import BadInput, ExitStatus
from bufferstand.recording.content import RecordingFault
from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.verification import verify
from tests.daq.cases import FACTS, HARMONIC, STATIC, Lines, plan_of, write_campaign
from tests.daq.fake_stand import FakeClock, FakeController, Orders, fake_stand


class Case:
    """A campaign on a fake stand."""

    def __init__(
        self,
        folder: Path,
        steps: str = HARMONIC,
        orders: Orders | None = None,
        *,
        limits: str = "",
        **stand: Any,
    ) -> None:
        self.folder = folder
        self.plan = plan_of(write_campaign(folder / "files", steps, limits=limits))
        self.clock = FakeClock()
        self.stand, self.controller = fake_stand(self.clock, orders, **stand)
        self.shown = Lines()
        self.request = StopRequest()

    @property
    def out(self) -> Path:
        return self.folder / "out"

    def run(self, **options: Any) -> CampaignOutcome:
        return run_campaign(
            self.plan, self.stand, self.clock, self.out, FACTS,
            progress=self.shown, stop_request=self.request, **options,
        )  # fmt: skip

    def record(self) -> Any:
        return json.loads((self.out / "campaign.json").read_text(encoding="utf-8"))


def assert_safe(controller: FakeController, outcome: CampaignOutcome) -> None:
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.safe
    assert controller.mm == pytest.approx(0.0, abs=0.4)
    assert controller.state in (MotionState.OFF, MotionState.FAULT)


def test_a_campaign_that_nothing_stops(tmp_path: Path) -> None:
    case = Case(tmp_path, HARMONIC + STATIC)
    outcome = case.run()
    assert (outcome.status, outcome.exit_status, outcome.reason) == ("complete", ExitStatus.DONE, "")
    assert [path.name for path in outcome.runs] == ["001-harmonic-10mm-5mm-1Hz.h5", "002-static-20mm_s.h5"]
    assert_safe(case.controller, outcome)
    harmonic = open_run(outcome.runs[0])
    assert (harmonic.status, harmonic.kind) == ("complete", "harmonic")
    stroke = harmonic.series("stroke_1").value
    assert stroke.max() == pytest.approx(15.0, abs=0.02)
    assert abs(stroke[0]) < 0.1  # from the ramp in …
    assert abs(stroke[-1]) < 0.1  # … to the release
    assert harmonic.gaps("controller") == []
    assert [
        finding for path in outcome.runs for finding in verify(path) if finding.level not in ("ok", "note")
    ] == []
    record = case.record()
    assert record["status"] == "complete"
    assert [(step["status"], step["cycles_done"]) for step in record["steps"]] == [
        ("complete", 3),
        ("complete", 2),
    ]


def test_the_runs_document_says_all_that_evaluating_needs(tmp_path: Path) -> None:
    document = open_run(Case(tmp_path).run().runs[0]).metadata
    assert document["run"]["operator"] == "tester"
    assert document["run"]["campaign"] == "test"
    assert document["specimen"]["id"] == "spring"
    assert document["stand"]["identity"]["serial"] == "1"
    assert document["step"]["amplitude_mm"] == 5.0
    assert document["limits"]["in_force"]["force_trip_kN"] == pytest.approx(618.0)
    assert {guard["name"] for guard in document["limits"]["guards"]["channels"]} == {
        "force", "stroke", "tilt", "following error",
    }  # fmt: skip
    assert document["streams"]["controller"]["rate_Hz"] == 1000.0
    assert document["streams"]["temperature_1"]["channels"][0]["place"] == "test"
    assert document["software"]["name"] == "bufferstand"


def test_what_is_not_guarded_is_said_at_the_start_and_kept_in_the_run(tmp_path: Path) -> None:
    case = Case(tmp_path)
    case.plan = replace(case.plan, not_guarded=("no second force: nobody sees it",))
    outcome = case.run()
    assert open_run(outcome.runs[0]).metadata["limits"]["not_guarded"] == ["no second force: nobody sees it"]
    assert case.record()["plan"]["not_guarded"] == ["no second force: nobody sees it"]
    assert any(line == "NOT GUARDED: no second force: nobody sees it" for line in case.shown.lines)


def at(seconds: float, value: float) -> Any:
    return lambda n: value if n >= seconds * 1000 else 0.0


def peak(seconds: float, for_s: float, value: float) -> Any:
    return lambda n: value if seconds <= n / 1000 < seconds + for_s else 0.0


@pytest.mark.dose(4)
@pytest.mark.parametrize(
    ("guard", "orders", "exit_status", "said"),
    [
        ("force", Orders(add={"force": peak(3.0, 0.1, 700.0)}), 3, "exceeds the limit of 618.00 kN"),
        ("stroke", Orders(add={"stroke_1": at(3.0, 500.0), "stroke_2": at(3.0, 500.0)}), 3, "252.00 mm"),
        ("tilt", Orders(add={"stroke_1": at(3.0, 6.0)}), 3, "tilt (stroke_1 − stroke_2) 6.00 mm"),
        ("following error", Orders(add={"position": at(3.0, -11.0)}), 3, "for 0.25 s"),
        ("controller", Orders(fault_at_s=3.0), 4, "fault 4 (actuator)"),
        ("controller", Orders(silent_from_s=3.0), 4, "delivers no new samples"),
        ("controller", Orders(heart_stops_at_s=3.0), 4, "does not count its heartbeat"),
        ("ring", Orders(lose_at={3000: 600}), 4, "600 samples (600 ms) were lost"),
    ],
)
def test_every_guard_ends_the_campaign_safe_with_its_data(
    tmp_path: Path, guard: str, orders: Orders, exit_status: int, said: str
) -> None:
    case = Case(tmp_path, HARMONIC + STATIC, orders)
    outcome = case.run()
    assert outcome.exit_status == exit_status
    assert said in outcome.reason
    assert_safe(case.controller, outcome)
    assert len(outcome.runs) == 1  # the second step never began
    run = open_run(outcome.runs[0])
    expected = "failed" if guard == "controller" else "stopped"
    assert (run.status, outcome.status) == (expected, expected)
    assert run.reason == outcome.reason
    kinds = [event.kind for event in run.events]
    assert "trip" in kinds
    assert "safe stop" in kinds
    assert len(run.series("force").value) > 2000
    record = case.record()
    assert (record["steps"][0]["stopped_by"], record["steps"][1]["status"]) == (guard, "pending")
    assert any(line.startswith("STOP: ") and said in line for line in case.shown.lines)


def test_a_gap_that_is_short_is_in_the_run_and_does_not_stop_it(tmp_path: Path) -> None:
    outcome = Case(tmp_path, HARMONIC, Orders(lose_at={3000: 25})).run()
    assert outcome.status == "complete"
    run = open_run(outcome.runs[0])
    assert [lost for _, lost in run.gaps("controller")] == [25]
    assert any(event.kind == "note" and "25 samples" in event.text for event in run.events)


@pytest.mark.parametrize(
    ("reading", "said", "exit_status"),
    [
        (lambda t_s: 25.0 if t_s < 3.0 else None, "nothing was received", 4),
        (lambda t_s: 25.0 if t_s < 3.0 else 85.0, "power-on value", 4),
        (lambda t_s: 25.0 if t_s < 3.0 else "CRC wrong: check the cable", "CRC wrong", 4),
        (lambda t_s: 25.0 if t_s < 3.0 else 40.0, "has reached the stop threshold of 40 °C", 3),
    ],
)
def test_temperature_by_excess_as_by_silence(
    tmp_path: Path, reading: Any, said: str, exit_status: int
) -> None:
    case = Case(tmp_path, HARMONIC.replace("cycles = 3", "cycles = 15"), reading=reading)
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("stopped", exit_status)
    assert said in outcome.reason
    assert_safe(case.controller, outcome)
    assert open_run(outcome.runs[0]).status == "stopped"


def test_what_has_tripped_already_refuses_the_campaign(tmp_path: Path) -> None:
    case = Case(tmp_path, reading=lambda _: 41.0)
    outcome = case.run()
    assert (outcome.status, outcome.exit_status, outcome.runs) == ("refused", 3, ())
    assert "41.00 °C has reached the stop threshold" in outcome.reason
    assert "enable" not in case.controller.calls
    silent = Case(tmp_path / "silent", reading=lambda _: None)
    assert silent.run().exit_status == 4
    assert "enable" not in silent.controller.calls


def test_a_device_that_does_not_answer_refuses_the_campaign(tmp_path: Path) -> None:
    case = Case(tmp_path, orders=Orders(wire_down=lambda _: True))
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("refused", 4)
    assert "no answer" in outcome.reason
    assert outcome.safe_stop is None


def test_a_watchdog_that_ran_out_before_we_came_is_no_reason_to_refuse(tmp_path: Path) -> None:
    case = Case(tmp_path)
    case.controller.fault_code, case.controller.state = 1, MotionState.FAULT
    assert case.run().status == "complete"
    assert any("had run out before this start" in line for line in case.shown.lines)


@pytest.mark.parametrize("code", [2, 3, 4])
def test_a_fault_from_before_is_named_and_reset_by_the_start(tmp_path: Path, code: int) -> None:
    case = Case(tmp_path)
    case.controller.state, case.controller.fault_code = MotionState.FAULT, code
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    assert any(f"the controller shows fault {code} (" in line for line in case.shown.lines)
    assert case.controller.fault_code == 0


def test_a_fault_from_before_with_force_on_the_specimen_refuses(tmp_path: Path) -> None:
    case = Case(tmp_path)
    case.controller.state, case.controller.fault_code = MotionState.FAULT, 2
    case.controller.mm = 2.0  # 10 kN
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("refused", ExitStatus.DEVICE_FAULT)
    assert "shows fault 2 (force limit of the device) from before this start" in outcome.reason
    assert "enable" not in case.controller.calls
    assert case.controller.fault_code == 2


def test_a_lost_wire_fails_the_run_and_says_that_the_watchdog_has_to_do_it(tmp_path: Path) -> None:
    case = Case(tmp_path, orders=Orders(wire_down=lambda now_s: now_s > 3.0))
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("failed", 4)
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.by == "watchdog"
    run = open_run(outcome.runs[0])
    assert run.status == "failed"
    assert len(run.series("force").value) > 2000
    case.clock.sleep(5.0)
    case.controller._live()
    assert case.controller.mm == pytest.approx(0.0)


def test_an_exception_in_the_loop_still_ends_safe_and_is_told(tmp_path: Path) -> None:
    case = Case(tmp_path)
    calls = []

    class Bug(Lines):
        def update(self, progress: Any) -> None:
            calls.append(progress)
            if len(calls) == 30:
                raise ZeroDivisionError("a display with a bug")

    outcome = run_campaign(case.plan, case.stand, case.clock, case.out, FACTS, progress=Bug())
    assert (outcome.status, outcome.exit_status) == ("failed", 4)
    assert isinstance(outcome.error, ZeroDivisionError)
    assert "internal error: ZeroDivisionError('a display with a bug') in test_runner.py" in outcome.reason
    assert_safe(case.controller, outcome)
    assert open_run(outcome.runs[0]).status == "failed"


def test_a_keyboard_interrupt_without_handlers_ends_safe(tmp_path: Path) -> None:
    case = Case(tmp_path)

    class Interrupting(Lines):
        def update(self, progress: Any) -> None:
            if progress.phase == "motion":
                raise KeyboardInterrupt

    outcome = run_campaign(case.plan, case.stand, case.clock, case.out, FACTS, progress=Interrupting())
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert_safe(case.controller, outcome)
    assert open_run(outcome.runs[0]).status == "stopped"


class FailingRecorder(RunRecorder):
    """Fails after a second of samples, as a full disk does."""

    def append(self, stream: str, sequence: int, time_us: Any, counts: Any, lost: int = 0) -> None:
        super().append(stream, sequence, time_us, counts, lost)
        if stream == "controller" and sequence > 3000:
            self.failure = OSError(28, "No space left on device")


def test_a_recorder_that_fails_stops_the_stand(tmp_path: Path) -> None:
    case = Case(tmp_path)
    outcome = case.run(recorder=FailingRecorder)
    assert (outcome.status, outcome.exit_status) == ("failed", 4)
    assert "No space left on device" in outcome.reason
    assert_safe(case.controller, outcome)
    assert open_run(outcome.runs[0]).status == "failed"


def test_a_run_for_which_there_is_no_room_ends_the_campaign(tmp_path: Path) -> None:
    case = Case(tmp_path, HARMONIC + STATIC)

    def recorder(folder: Path, run_id: str, document: Any) -> RunRecorder:
        if run_id.startswith("002"):
            raise BadInput("cannot record here: No space left on device", file=folder)
        return RunRecorder(folder, run_id, document)

    outcome = case.run(recorder=recorder)
    assert (outcome.status, outcome.exit_status, outcome.error) == ("failed", 4, None)
    assert "the run cannot be recorded: " in outcome.reason
    assert "No space left on device" in outcome.reason
    assert_safe(case.controller, outcome)
    assert [step["status"] for step in case.record()["steps"]] == ["complete", "failed"]


class UnsealableRecorder(RunRecorder):
    """Records, but cannot seal."""

    def close(self, status: str, reason: str = "") -> Path:
        super().close(status, reason)
        raise RecordingFault("disk full while sealing")


def test_a_run_that_cannot_be_sealed_ends_the_campaign(tmp_path: Path) -> None:
    case = Case(tmp_path, HARMONIC + STATIC)
    outcome = case.run(recorder=UnsealableRecorder)
    assert (outcome.status, outcome.exit_status) == ("failed", 4)
    assert "disk full while sealing" in outcome.reason
    assert case.record()["steps"][0]["status"] == "failed"


# --- the operator --------------------------------------------------------------------------------------


class Wish(Lines):
    """Asks for a stop at a cycle."""

    def __init__(self, request: StopRequest, level: StopLevel, cycle: int) -> None:
        super().__init__()
        self._request, self._level, self._cycle = request, level, cycle

    def update(self, progress: Any) -> None:
        super().update(progress)
        if progress.step == 1 and progress.phase == "motion" and progress.cycle >= self._cycle:
            self._request.ask(self._level, "the operator's key")


@pytest.mark.parametrize(
    ("level", "cycles", "complete"),
    [(StopLevel.NOW, 1, False), (StopLevel.AFTER_CYCLE, 2, False), (StopLevel.AFTER_STEP, 3, True)],
)
def test_the_operator_stops_now_after_the_cycle_or_after_the_step(
    tmp_path: Path, level: StopLevel, cycles: int, complete: bool
) -> None:
    case = Case(tmp_path, HARMONIC + STATIC)
    case.shown = Wish(case.request, level, 1)
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert outcome.reason == "stopped by the operator: the operator's key"
    assert_safe(case.controller, outcome)
    first = case.record()["steps"][0]
    assert first["cycles_done"] == cycles
    assert (first["status"] == "complete") is complete
    assert open_run(outcome.runs[0]).status == ("complete" if complete else "stopped")


# --- going on --------------------------------------------------------------------------------------------


def test_resume_leaves_out_what_is_complete_and_repeats_what_was_stopped(tmp_path: Path) -> None:
    first = Case(tmp_path, STATIC + HARMONIC, Orders(add={"force": at(9.0, 700.0)}))
    outcome = first.run()
    assert [step["status"] for step in first.record()["steps"]] == ["complete", "stopped"]
    again = Case(tmp_path, STATIC + HARMONIC)
    outcome = again.run()
    assert outcome.status == "complete"
    assert [path.name for path in outcome.runs] == ["002-harmonic-10mm-5mm-1Hz_part-2.h5"]
    steps = again.record()["steps"]
    assert steps[1]["runs"] == [
        "runs/002-harmonic-10mm-5mm-1Hz.h5", "runs/002-harmonic-10mm-5mm-1Hz_part-2.h5",
    ]  # fmt: skip
    assert again.record()["started_utc"] == first.record()["started_utc"]
    third = Case(tmp_path, STATIC + HARMONIC)
    assert (third.run().status, third.run().runs) == ("complete", ())


def test_a_step_whose_run_file_is_gone_is_done_again(tmp_path: Path) -> None:
    Case(tmp_path).run().runs[0].unlink()
    assert len(Case(tmp_path).run().runs) == 1


def test_after_a_temperature_stop_the_resume_threshold_counts_and_only_the_cycles_left_are_run(
    tmp_path: Path,
) -> None:
    steps = HARMONIC.replace("cycles = 3", "cycles = 8")
    assert Case(tmp_path, steps, reading=lambda t_s: 41.0 if t_s >= 6.0 else 25.0).run().exit_status == 3
    done = load_record(tmp_path / "out")
    assert done is not None
    cycles = done.steps[0].cycles_done
    assert 2 <= cycles <= 5
    warm = Case(tmp_path, steps, reading=lambda _: 35.0).run()
    assert (warm.status, warm.exit_status) == ("refused", 3)
    assert "still too warm to go on: temperature_1 (test) is at 35.00 °C" in warm.reason
    unplugged = Case(tmp_path, steps, Orders(wire_down=lambda _: True)).run()
    assert unplugged.exit_status == 4  # and does not make it forget
    assert Case(tmp_path, steps, reading=lambda _: 35.0).run().status == "refused"
    still_known = load_record(tmp_path / "out")
    assert still_known is not None
    assert still_known.steps[0].cycles_done == cycles
    cool = Case(tmp_path, steps, reading=lambda _: 29.0)
    outcome = cool.run()
    assert outcome.status == "complete"
    assert cycle_count(outcome.runs[0]) == 8 - cycles


def cycle_count(path: Path) -> int:
    """Count full-amplitude cycles by the upper turning points of the stroke."""
    stroke = open_run(path).series("stroke_1").value
    above = stroke > 10.0 + 0.97 * 5.0
    return int(np.count_nonzero(np.diff(above.astype(int)) == 1))


def heated(t_s: float) -> float:
    """40 °C reached in the harmonic motion, 30 °C ten seconds later, cool from then on."""
    return 25.0 if t_s < 5.0 else max(25.0, 40.0 - (t_s - 5.0))


COOLS_AT_ONCE = '[guards.action]\nwiring = "note"\n'
"""A specimen that cools within seconds is one whose thermometer has fallen off: here it only saves time."""


def test_wait_and_continue_waits_at_zero_force_and_runs_the_cycles_that_are_left(tmp_path: Path) -> None:
    steps = COOLS_AT_ONCE + HARMONIC.replace("cycles = 3", "cycles = 8") + STATIC
    case = Case(tmp_path, steps, limits='on_temperature_stop = "wait-and-continue"', reading=heated)
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE)
    first, second, _ = outcome.runs
    assert (open_run(first).status, open_run(second).status) == ("stopped", "complete")
    assert cycle_count(first) + cycle_count(second) in (8, 9)  # the cycle under way was begun anew
    assert case.controller.calls.count("enable") == 2
    assert any("waiting at zero force, valve off" in line for line in case.shown.lines)


def test_skip_waits_too_and_goes_on_with_the_next_step(tmp_path: Path) -> None:
    steps = COOLS_AT_ONCE + HARMONIC.replace("cycles = 3", "cycles = 8") + STATIC
    case = Case(tmp_path, steps, limits='on_temperature_stop = "skip"', reading=heated)
    outcome = case.run()
    assert outcome.status == "complete"
    assert [step["status"] for step in case.record()["steps"]] == ["skipped", "complete"]
    assert case.clock.now_s() > 15.0


def test_a_specimen_that_does_not_cool_ends_the_campaign(tmp_path: Path) -> None:
    case = Case(
        tmp_path, limits='on_temperature_stop = "skip"', reading=lambda t_s: 25.0 if t_s < 4.0 else 41.0
    )
    outcome = case.run(settings=RunSettings(cool_limit_s=10.0))
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert "not cool after 10 s" in outcome.reason


def test_steps_that_only_wait_are_done_and_not_recorded(tmp_path: Path) -> None:
    steps = '[[step]]\nkind = "hold"\nduration_s = 2.0\n[[step]]\nkind = "cool-down"\ntemperature_C = 24.0\n'
    case = Case(tmp_path, COOLS_AT_ONCE + steps, reading=lambda t_s: 28.0 - t_s if t_s < 5.0 else 23.0)
    outcome = case.run()
    assert (outcome.status, outcome.runs) == ("complete", ())
    assert case.clock.now_s() > 4.0


def test_a_cool_down_that_takes_too_long_stops(tmp_path: Path) -> None:
    steps = '[[step]]\nkind = "cool-down"\ntemperature_C = 20.0\ntimeout_s = 5.0\n'
    outcome = Case(tmp_path, steps).run()
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert "not cool after 5 s: temperature_1 (test) is at 21.00 °C" in outcome.reason


def test_a_motion_that_the_controller_refuses_or_never_ends(tmp_path: Path) -> None:
    refused = Case(tmp_path / "a", orders=Orders(reject=frozenset({"harmonic"}))).run()
    assert refused.exit_status == 4
    assert "refused a motion: harmonic: refused by order" in refused.reason
    stuck = Case(tmp_path / "b")
    stuck.controller._to = lambda *_: lambda _: (0.0, False)  # type: ignore[method-assign]
    outcome = stuck.run()
    assert outcome.exit_status == 4
    assert "the ramp has not ended after" in outcome.reason


# --- the folder ------------------------------------------------------------------------------------------


def test_the_folder_holds_all_that_resuming_needs(tmp_path: Path) -> None:
    case = Case(tmp_path)
    case.run()
    record = load_record(case.out)
    assert record is not None
    copy = case.out / record.campaign_file
    assert copy.read_bytes() == case.plan.campaign.path.read_bytes()
    again = plan_of(copy)
    assert [step.plan_hash for step in again.steps] == [step.plan_hash for step in case.plan.steps]
    clock = FakeClock()
    stand, _ = fake_stand(clock)
    assert run_campaign(again, stand, clock, case.out, FACTS).runs == ()


def test_orphans_of_a_crash_are_sealed_at_the_next_start(tmp_path: Path) -> None:
    case = Case(tmp_path)
    case.run()
    document = open_run(next(case.out.glob("runs/*.h5"))).metadata
    document = {k: v for k, v in document.items() if k not in ("datasets",)}
    document["run"] = {**document["run"], "id": "999-orphan", "status": "recovered"}
    left = RunRecorder(case.out / "runs", "999-orphan", document)
    left._stop_threads()
    left._journal.close()
    again = Case(tmp_path)
    again.run()
    assert open_run(case.out / "runs" / "999-orphan.h5").status == "recovered"
    assert any(line.startswith("recovered 999-orphan.h5") for line in again.shown.lines)


@pytest.mark.parametrize("content", ["", "{}", '{"schema": "other"}', "[1]"])
def test_a_folder_with_something_else_in_it_is_refused(tmp_path: Path, content: str) -> None:
    case = Case(tmp_path)
    case.out.mkdir()
    (case.out / "campaign.json").write_text(content, encoding="utf-8")
    with pytest.raises(BadInput, match=r"campaign\.json: .*; mend it, or choose another folder with --out"):
        case.run()


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file", encoding="utf-8")
    with pytest.raises(BadInput, match="the folder cannot be made"):
        Case(tmp_path).run()


# --- what is shown ---------------------------------------------------------------------------------------


def test_progress_says_where_it_is_at_most_ten_times_a_second(tmp_path: Path) -> None:
    case = Case(tmp_path, HARMONIC + STATIC)
    case.run(settings=RunSettings(pace=LoopPace(tick_s=0.01)))
    shown = case.shown.snapshots
    assert len(shown) <= case.clock.wall_s() * 10 + 2
    assert {snapshot.phase for snapshot in shown} >= {"start", "ramp", "motion", "release", "done"}
    motion = [snapshot for snapshot in shown if snapshot.phase == "motion" and snapshot.step == 1]
    assert max(snapshot.cycle for snapshot in motion) == 3
    assert {(s.steps, s.cycles, s.temperature_limit_C) for s in motion} == {(2, 3, 40.0)}
    assert all(s.temperatures_C == {"temperature_1": 21.0} for s in motion)
    assert all(a.elapsed_s < b.elapsed_s for a, b in pairwise(shown[:-1]))
    assert shown[-1].remaining_s == 0.0
    begun = [line for line in case.shown.lines if line.startswith("step ")]
    assert begun[0].startswith("step 1 of 2: ")


def test_a_step_whose_run_was_sealed_whole_is_not_repeated_though_nobody_noted_it(tmp_path: Path) -> None:
    """Killed between the sealing of the run and the note in campaign.json."""
    case = Case(tmp_path)
    assert case.run().status == "complete"
    path = case.out / "campaign.json"
    content = json.loads(path.read_text())
    whole = dict(content["steps"][0])
    content["steps"][0] |= {
        "status": "running",
        "cycles_done": 0,
        "runs": [*whole["runs"], "runs/never-begun.h5"],
    }
    path.write_text(json.dumps(content))
    again = Case(tmp_path).run()
    assert (again.status, again.runs) == ("complete", ())
    assert json.loads(path.read_text())["steps"][0] == whole


def test_a_step_whose_run_broke_off_is_done_again(tmp_path: Path) -> None:
    case = Case(tmp_path, orders=Orders())
    assert case.run().status == "complete"
    path = case.out / "campaign.json"
    content = json.loads(path.read_text())
    content["steps"][0] |= {"status": "running", "runs": ["runs/never-begun.h5"]}
    path.write_text(json.dumps(content))
    again = Case(tmp_path).run()
    assert again.status == "complete"
    assert len(again.runs) == 1
