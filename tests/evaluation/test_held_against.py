"""What a harmonic run is compared with where the piston's stroke was asked for, not the specimen's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.evaluation.document.build import evaluate_file, evaluation_document
from bufferstand.evaluation.facts.planned_motion import PlannedValue, expected_turns, held_against
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.report.content.content import Table
from bufferstand.evaluation.report.sections.statements import not_as_required, targets_section
from bufferstand.evaluation.report.source.reading import read_source
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.daq.run_in_process import COARSE, facts_of, sample_plan
from tests.evaluation.signals import Ellipse

SAMPLES = Path(__file__).parents[2] / "sample_runs"
FACTS = RunFacts("harmonic-1", "harmonic", specimen={"id": "B1"})
TURNS = {"lower_mm": 64.4, "upper_mm": 91.6, "lower_kN": 100.0, "upper_kN": 500.0}
STEP: dict[str, Any] = {
    "prestress_mm": 80.0,
    "amplitude_mm": 15.0,
    "frequency_Hz": 1.0,
    "compensate": False,
    "motions": [{"motion": "ramp"}, {"motion": "harmonic"}, {"motion": "release"}],
    "estimates": [{"turns": {"lower_mm": 0.0, "upper_mm": 77.6}}, {"turns": TURNS}, {"turns": None}],
}
"""80 ± 15 mm of the piston, of which the plan expects 78 ± 13.6 mm of the specimen."""
UNKNOWN = {**STEP, "estimates": [{"turns": None}] * 3}


def of_its_step(step: dict[str, Any], mean_mm: float, amplitude_mm: float) -> list[str]:
    columns = Ellipse(mean_mm, amplitude_mm, mean_kN=300.0).columns(1.0, 500.0, 4.5)
    run = evaluate_run(make_record(*columns), replace(FACTS, step=step))
    return [warning for warning in run.warnings if "its step" in warning]


def test_the_piston_s_stroke_is_not_demanded_of_the_specimen() -> None:
    assert of_its_step(STEP, 77.6, 13.3) == []
    assert of_its_step({**STEP, "compensate": True}, 77.6, 13.3) != []


def test_another_motion_than_the_plan_expected_is_told_with_what_was_asked_of_the_piston() -> None:
    (warning,) = of_its_step(STEP, 77.6, 15.6)
    assert warning == (
        "the run is not its step: amplitude_mm is 15.6, planned was 13.6 of the specimen for 15 of the piston"
    )
    (warning,) = of_its_step(STEP, 50.0, 13.6)
    assert "prestress_mm is 50, planned was 78 of the specimen for 80 of the piston" in warning


def test_without_an_expectation_on_record_only_the_frequency_is_held_against_the_step() -> None:
    assert of_its_step(UNKNOWN, 77.6, 9.0) == []
    (warning,) = of_its_step({**UNKNOWN, "frequency_Hz": 1.27}, 77.6, 9.0)
    assert warning.startswith("the run is not its step: frequency_Hz is 1")


def test_what_is_on_record_is_found() -> None:
    assert held_against(STEP, "frequency_Hz") == PlannedValue(1.0)
    assert held_against({**STEP, "compensate": True}, "amplitude_mm") == PlannedValue(15.0)
    assert held_against({"amplitude_mm": 15.0}, "amplitude_mm") == PlannedValue(15.0), "an earlier file"
    assert held_against({**STEP, "amplitude_mm": None}, "amplitude_mm") is None
    mean, amplitude = (held_against(STEP, name) for name in ("prestress_mm", "amplitude_mm"))
    assert mean is not None
    assert (mean.value, mean.of_piston) == (pytest.approx(78.0), 80.0)
    assert amplitude is not None
    assert (amplitude.value, amplitude.of_piston) == (pytest.approx(13.6), 15.0)
    several = {"motions": [{"motion": "harmonic"}] * 2, "estimates": [{"turns": TURNS}] * 2}
    assert expected_turns({**STEP, **several}, "harmonic") is None


@pytest.mark.slow
def test_a_step_of_the_paper_is_not_warned_of_though_the_frame_is_softer_than_stated(tmp_path: Path) -> None:
    """80 ± 15 mm of the piston, on the sample stand: its frame is softer than the stand file states."""
    campaign_file = tmp_path / "campaign.toml"
    campaign_file.write_text(
        f"""
[campaign]
id = "paper"
stand = "{SAMPLES / "stand.toml"}"
specimen = "{SAMPLES / "specimens/category-a-elastomer.toml"}"
[stroke]
compensate = false
[zero]
touch = false
stroke_untouched_max_mm = 3.0
[[step]]
kind = "harmonic"
prestress_mm = 80.0
amplitude_mm = 15.0
peak_speed_mm_per_s = 80.0
cycles = 3
""",
        encoding="utf-8",
    )
    plan, stand_file = sample_plan(campaign_file)
    opened = open_in_process(stand_file)
    folder = tmp_path / "out"
    outcome = run_campaign(plan, opened.stand, opened.clock, folder, facts_of(stand_file), settings=COARSE)
    assert outcome.status == "complete", outcome.reason
    run = evaluate_file(outcome.runs[0], Options(draws=0))
    amplitude_mm = run.summary.values["amplitude_mm"].value
    assert amplitude_mm is not None
    assert 12.8 < amplitude_mm < 13.5, "by more than 10 % less than the piston's"
    assert [warning for warning in run.warnings if "its step" in warning] == []
    source = read_source(folder, evaluation_document([run]))
    assert not_as_required(source.runs[0]) == []
    targets = targets_section(source)
    assert targets is not None
    (table,) = targets.blocks
    assert isinstance(table, Table)
    (row,) = table.rows
    assert row[1].text == "80.00 ± 15.00 (piston)"
    assert row[-1].text.startswith("expected 77.8")
