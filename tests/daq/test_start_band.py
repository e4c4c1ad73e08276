"""Bands of temperature before a step, steps' own limits and repetitions, on the simulated stand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign_folder.as_run import AsRun, read_as_run
from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.model.file import load_model
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import SAMPLES, Lines
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign

PACE = RunSettings(pace=LoopPace(tick_s=0.1))
PREDICTOR = ModelPredictor(load_model(SAMPLES / "models" / "category-a-elastomer.toml"))
BAND = "start_temperature_C = [15.0, 25.0]\n"


def sine(cycles: int = 2, more: str = "") -> str:
    return (
        '[[step]]\nkind = "harmonic"\nprestress_mm = 20.0\namplitude_mm = 5.0\nfrequency_Hz = 1.0\n'
        f"cycles = {cycles}\n{more}\n"
    )


@dataclass
class Ended:
    outcome: CampaignOutcome
    opened: InProcessStand
    lines: list[str]
    rows: tuple[AsRun, ...]


def run(folder: Path, steps: str, *, initial_C: float = 21.0, request: StopRequest | None = None) -> Ended:
    conditions = f"[conditions]\nspecimen_C = {initial_C}\n"
    plan, stand_file = sample_plan(campaign(folder, conditions + steps, initial_C=initial_C))
    opened, shown = open_in_process(stand_file, log_truth=False), Lines()
    outcome = run_campaign(
        plan, opened.stand, opened.clock, folder / "out", facts_of(stand_file), progress=shown,
        stop_request=request, settings=PACE, predictor=PREDICTOR,
    )  # fmt: skip
    opened.stand.close()
    return Ended(outcome, opened, shown.lines, read_as_run(folder / "out"))


def test_a_warm_specimen_is_waited_for_and_the_record_says_how_warm_it_was(tmp_path: Path) -> None:
    ended = run(tmp_path, sine(more=BAND), initial_C=27.0)
    assert ended.outcome.status == "complete", ended.outcome.reason
    assert any("waits for the specimen to cool: temperature_" in line for line in ended.lines)
    found = open_run(ended.outcome.runs[0])
    force = found.series("force")
    assert force.time_s[-1] - force.time_s[0] < 10.0, "the wait is no part of the record"
    (said,) = [event for event in found.events if event.kind == "temperature"]
    assert "within start_temperature_C = [15, 25]" in said.text
    for name in ("temperature_1", "temperature_2"):
        assert found.series(name).value[0] <= 25.3
    assert found.step["start_band"] == {
        "low_C": 15.0,
        "high_C": 25.0,
        "timeout_s": 7200.0,
        "refuses_cold": True,
    }
    wait, step = ended.rows
    assert (wait.pause, wait.kind, wait.name) == (True, "cool-down", "cooled down to 25 °C")
    assert wait.planned is not None
    assert wait.duration_s == pytest.approx(wait.planned.duration_s, rel=0.1)
    assert step.duration_s == pytest.approx(step.estimated.duration_s, rel=0.2)
    assert step.start_C == pytest.approx(25.0, abs=0.2)


def test_a_specimen_within_the_band_is_not_waited_for(tmp_path: Path) -> None:
    ended = run(tmp_path, sine(more=BAND))
    assert ended.outcome.status == "complete", ended.outcome.reason
    assert not any("waits" in line for line in ended.lines)
    assert len(ended.rows) == 1


COLD = "[conditions]\nspecimen_C = 21.0\n"


@pytest.mark.parametrize("too_cold", ["refuse", "run"])
def test_a_specimen_colder_than_planned(tmp_path: Path, too_cold: str) -> None:
    """The plan expects 21 °C; it is 12 °C when the step is to begin."""
    steps = COLD + sine() + sine(3, BAND + f'too_cold = "{too_cold}"')
    plan, stand_file = sample_plan(campaign(tmp_path, steps, initial_C=12.0))
    opened, shown = open_in_process(stand_file, log_truth=False), Lines()
    outcome = run_campaign(
        plan,
        opened.stand,
        opened.clock,
        tmp_path / "out",
        facts_of(stand_file),
        progress=shown,
        settings=PACE,
    )
    if too_cold == "run":
        assert outcome.status == "complete", outcome.reason
        found = open_run(outcome.runs[1])
        (said,) = [event for event in found.events if event.kind == "temperature"]
        assert "outside start_temperature_C" in said.text
        return
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert "put a step with kind = “warm-up” and temperature_C = 20 before it" in outcome.reason
    assert "before step 2" in outcome.reason
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.safe
    assert not opened.device.controller.valve_on
    record = load_record(tmp_path / "out")
    assert record is not None
    assert [step.status for step in record.steps] == ["complete", "stopped"]
    assert len(outcome.runs) == 1, "nothing was recorded of what did not begin"


def test_a_wait_that_takes_too_long_stops_the_campaign(tmp_path: Path) -> None:
    ended = run(tmp_path, sine(more=BAND + "start_timeout_s = 30.0"), initial_C=30.0)
    assert (ended.outcome.status, ended.outcome.exit_status) == ("stopped", 3)
    assert "not cool after 30 s" in ended.outcome.reason


def test_a_step_with_its_own_stop_runs_warm_and_the_next_waits_below_the_campaign_s(tmp_path: Path) -> None:
    own = "temperature_stop_C = 60.0\ntemperature_resume_C = 55.0\n"
    cool = '[[step]]\nkind = "cool-down"\ntemperature_C = 49.0\n'
    ended = run(tmp_path, sine(more=own) + cool + sine(3, own), initial_C=50.0)
    assert ended.outcome.status == "complete", ended.outcome.reason
    assert not any(line.startswith("STOP") for line in ended.lines)
    found = open_run(ended.outcome.runs[0])
    assert found.metadata["limits"]["test"]["temperature_stop_C"] == 60.0
    guards = found.metadata["limits"]["guards"]["temperatures"]
    assert [guard["stop_C"] for guard in guards] == [60.0, 60.0, None]
    assert [guard["resume_C"] for guard in guards] == [55.0, 55.0, None]


def test_the_campaign_s_stop_counts_again_in_the_step_after(tmp_path: Path) -> None:
    own = "temperature_stop_C = 60.0\ntemperature_resume_C = 55.0\n"
    ended = run(tmp_path, sine(more=own) + sine(3), initial_C=50.0)
    assert (ended.outcome.status, ended.outcome.exit_status) == ("stopped", 3)
    assert "has reached the stop threshold of 40 °C" in ended.outcome.reason
    assert [open_run(path).status for path in ended.outcome.runs[:1]] == ["complete"]


def test_a_campaign_can_begin_warm_with_a_cool_down(tmp_path: Path) -> None:
    cool = '[[step]]\nkind = "cool-down"\ntemperature_C = 44.0\n'
    ended = run(tmp_path, "[limits]\ntemperature_stop_C = 44.5\n" + cool + sine(), initial_C=45.0)
    assert ended.outcome.status == "complete", ended.outcome.reason


class _AfterFirst(StopRequest):
    """Asks for a stop after the first step."""

    looked = 0

    @property
    def level(self) -> StopLevel:
        self.looked += 1
        return StopLevel.AFTER_STEP if self.looked > 20 else StopLevel.NONE

    @property
    def reason(self) -> str:
        return "test"


def test_a_repetition_goes_on_in_the_turn_where_it_was_stopped(tmp_path: Path) -> None:
    inner = (sine() + sine(3)).replace("[[step]]", "[[step.step]]")
    steps = '[[step]]\nkind = "repeat"\ntimes = 2\n' + inner
    first = run(tmp_path, steps, request=_AfterFirst())
    assert first.outcome.status == "stopped"
    record = load_record(tmp_path / "out")
    assert record is not None
    assert [step.status for step in record.steps] == ["complete", "pending", "pending", "pending"]
    then = run(tmp_path, steps)
    assert then.outcome.status == "complete", then.outcome.reason
    assert len(then.outcome.runs) == 3
    record = load_record(tmp_path / "out")
    assert record is not None
    assert [step.name.rpartition(" (")[2] for step in record.steps] == [
        "1 of 2)", "1 of 2)", "2 of 2)", "2 of 2)",
    ]  # fmt: skip
