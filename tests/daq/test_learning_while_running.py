"""A specimen that heats and cools otherwise than the model says: the campaign learns it, and says so."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign_folder.as_run import (
    AS_RUN_NAME,
    AsRun,
    observed_run,
    read_as_run,
    report_rows,
)
from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.model.file import load_model
from bufferstand.protocols.prediction.learning import learn_heating
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import SAMPLES, Lines
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign

MODEL = SAMPLES / "models" / "category-a-elastomer.toml"
PREDICTOR = ModelPredictor(load_model(MODEL))
PACE = RunSettings(pace=LoopPace(tick_s=0.1))
STEP = """
[[step]]
kind = "harmonic"
prestress_mm = 60.0
amplitude_mm = 20.0
frequency_Hz = {frequency_Hz}
cycles = {cycles}
"""
COOL = '[[step]]\nkind = "cool-down"\ntemperature_C = 28.0\n'
GIVEN = (STEP.format(frequency_Hz=1.2, cycles=20) + COOL) * 3
SHORT = STEP.format(frequency_Hz=1.2, cycles=25) + STEP.format(frequency_Hz=0.8, cycles=10)
SOONEST = '[plan]\norder = "soonest"\n' + "".join(
    STEP.format(frequency_Hz=frequency, cycles=30) for frequency in (1.2, 1.3, 1.4, 1.1, 1.0)
)
TRUE_CAPACITY, TRUE_LOSS = 10_500.0, 11.0
"""Of the specimen on the stand; the model that plans has 15 000 J/K and 10 W/K."""


def other_specimen(folder: Path) -> Path:
    """Write a stand file whose spring has another heat balance than the model of the plan."""
    text = MODEL.read_text(encoding="utf-8")
    text = text.replace("capacity_J_per_K = 15000.0", f"capacity_J_per_K = {TRUE_CAPACITY}")
    text = text.replace("loss_W_per_K = 10.0", f"loss_W_per_K = {TRUE_LOSS}")
    (folder / "true.toml").write_text(text, encoding="utf-8")
    stand = (folder / "stand.toml").read_text(encoding="utf-8")
    path = folder / "true-stand.toml"
    path.write_text(stand.replace(str(MODEL), "true.toml"), encoding="utf-8")
    return path


@dataclass
class Ended:
    outcome: CampaignOutcome
    opened: InProcessStand
    lines: list[str]
    rows: tuple[AsRun, ...]


def run(folder: Path, steps: str, *, after_step: bool = False, truth: bool = False) -> Ended:
    """Run (or go on with) a campaign with the other specimen; stop after the first step if so asked."""
    plan, stand_file = sample_plan(campaign(folder, steps))
    opened, shown, request = (
        open_in_process(load_stand(other_specimen(folder)), log_truth=truth),
        Lines(),
        StopRequest(),
    )
    if after_step:
        request.ask(StopLevel.AFTER_STEP, "test")
        request = _Later(request)
    outcome = run_campaign(
        plan, opened.stand, opened.clock, folder / "out", facts_of(stand_file), progress=shown,
        stop_request=request, settings=PACE, predictor=PREDICTOR,
    )  # fmt: skip
    return Ended(outcome, opened, shown.lines, read_as_run(folder / "out"))


class _Later(StopRequest):
    """Asks for a stop after the step once the first has begun."""

    def __init__(self, asked: StopRequest) -> None:
        super().__init__()
        self._asked, self._looked = asked, 0

    @property
    def level(self) -> StopLevel:
        self._looked += 1
        return self._asked.level if self._looked > 20 else StopLevel.NONE

    @property
    def reason(self) -> str:
        return self._asked.reason


@pytest.mark.long
def test_the_time_that_is_left_comes_closer_to_what_happens(tmp_path: Path) -> None:
    ended = run(tmp_path, GIVEN)
    assert ended.outcome.status == "complete", ended.outcome.reason
    rows = ended.rows
    assert [row.complete for row in rows] == [True] * 6
    after = [sum(row.duration_s for row in rows[number + 1 :]) for number in range(len(rows))]
    for number in (3, 4):  # until something has cooled down, nothing is known of the cooling
        learned, planned = (
            abs(left_s - after[number]) for left_s in (rows[number].left_s, rows[number].planned_left_s)
        )
        assert learned < 0.2 * planned
        assert learned < 0.05 * after[number]
    absorbed = sum(row.heat_J for row in rows) / sum(row.modelled_heat_J for row in rows)
    assert rows[-1].heating == pytest.approx(absorbed * 15_000.0 / TRUE_CAPACITY, rel=0.06)
    assert rows[-1].cooling == pytest.approx(TRUE_LOSS / 10.0 * 15_000.0 / TRUE_CAPACITY, rel=0.08)
    warm = rows[2]
    assert warm.end_C is not None
    assert warm.planned is not None
    assert abs(warm.estimated.end_C - warm.end_C) < 0.5
    assert abs(warm.planned.end_C - warm.end_C) > 2.0, "the first plan did not know"
    assert any(line.startswith("planned anew (heating × 1.") for line in ended.lines)
    assert sum(line.startswith("  took ") for line in ended.lines) == 6
    assert [row[0] for row in report_rows(rows)] == ["1", "2", "3", "4", "5", "6"]


def test_the_measured_heat_is_that_of_the_specimen(tmp_path: Path) -> None:
    ended = run(tmp_path, STEP.format(frequency_Hz=1.2, cycles=4), truth=True)
    truth = ended.opened.truth.arrays()
    (row,) = ended.rows
    assert row.heat_J == pytest.approx(float(truth["work_J"][-1]), rel=0.02)
    assert row.planned is not None
    assert row.heat_J == pytest.approx(row.planned.heat_J, rel=0.15), "the frame takes some of the stroke"
    found = observed_run(ended.outcome.runs[0], {"temperature_3"})
    assert found is not None
    assert found.heat_J == pytest.approx(row.heat_J, rel=0.02)
    assert (found.start_C, found.end_C) == pytest.approx((row.start_C, row.end_C), abs=0.2)


@pytest.mark.long
def test_pauses_follow_what_was_learned_and_no_step_runs_into_the_stop(tmp_path: Path) -> None:
    learned = run(tmp_path, SOONEST)
    assert learned.outcome.status == "complete", learned.outcome.reason
    assert not any(line.startswith("STOP") for line in learned.lines)
    pauses = [row for row in learned.rows if row.pause]
    assert pauses
    assert any(row.planned is None for row in pauses), "there where the first plan had none"
    assert all(row.end_C is not None and row.end_C < 40.0 for row in learned.rows)
    assert any(row.end_C is not None and row.end_C > 36.0 for row in learned.rows), "no more than is needed"
    assert len(learned.outcome.runs) == 5
    record = load_record(tmp_path / "out")
    assert record is not None
    assert {step.status for step in record.steps} == {"complete"}
    assert not any(step.name.startswith("pause") for step in record.steps)


def test_a_resumed_campaign_knows_what_was_learned_before(tmp_path: Path) -> None:
    first = run(tmp_path, SHORT, after_step=True)
    assert first.outcome.exit_status == 3
    (row,) = first.rows
    then = run(tmp_path, SHORT)
    assert then.outcome.status == "complete", then.outcome.reason
    assert then.rows[0] == row
    assert len(then.rows) == 2
    assert then.rows[1].heating > 1.05, "from the step of the first start"
    planned, learned = (
        abs(then.rows[1].end_C - of.end_C) for of in (then.rows[1].planned, then.rows[1].estimated)
    )
    assert learned < planned


def test_without_its_line_a_recorded_run_is_learned_from(tmp_path: Path) -> None:
    first = run(tmp_path, SHORT, after_step=True)
    (tmp_path / "out" / AS_RUN_NAME).unlink()  # as if the program had been killed before it wrote it
    found = observed_run(first.outcome.runs[0], {"temperature_3"})
    assert found is not None
    assert learn_heating([found], PREDICTOR).heating > 1.05
    then = run(tmp_path, SHORT)
    assert then.outcome.status == "complete", then.outcome.reason
    assert then.rows[0].heating > 1.05
    assert len(open_run(then.outcome.runs[0]).streams) > 1


def test_a_line_that_is_cut_off_is_left_out(tmp_path: Path) -> None:
    ended = run(tmp_path, STEP.format(frequency_Hz=1.2, cycles=1))
    path = tmp_path / "out" / AS_RUN_NAME
    with path.open("a", encoding="utf-8") as stream:
        stream.write('{"index": 2, "na')
    assert read_as_run(tmp_path / "out") == ended.rows
    assert read_as_run(tmp_path) == ()


HOT = '[limits]\non_temperature_stop = "{policy}"\ntemperature_resume_C = 39.6\n' + (
    STEP.format(frequency_Hz=1.2, cycles=16)
    + '[[step]]\nkind = "hold"\nduration_s = 60.0\n'
    + STEP.format(frequency_Hz=0.2, cycles=1)
)


@pytest.mark.parametrize(("policy", "status"), [("wait-and-continue", "complete"), ("stop", "stopped")])
def test_a_specimen_that_gets_too_warm_in_a_pause(tmp_path: Path, policy: str, status: str) -> None:
    """The sensor lags behind the spring, so that the stop can come when nothing moves any more."""
    plan, stand_file = sample_plan(campaign(tmp_path, HOT.format(policy=policy), initial_C=38.6))
    steps = tuple(replace(step, pause=step.kind == "hold") for step in plan.steps)
    opened, shown = open_in_process(stand_file, log_truth=False), Lines()
    outcome = run_campaign(
        replace(plan, steps=steps), opened.stand, opened.clock, tmp_path / "out", facts_of(stand_file),
        progress=shown, settings=PACE, predictor=None,
    )  # fmt: skip
    assert any(line.startswith("STOP: temperature_") for line in shown.lines), shown.lines
    assert outcome.status == status, outcome.reason
    assert len(outcome.runs) == (2 if status == "complete" else 1)
    assert any("waiting at zero force" in line for line in shown.lines) == (status == "complete")
    assert not opened.device.controller.valve_on
