"""What the plan says of strokes by what was learned, what is then commanded, and the stand's own truth."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.campaign.plan import command, show_what_is_learned
from bufferstand.daq.campaign.stroke_forecast import reached_rows, stroke_outlook
from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.strokes.stroke_rows import STROKES_NAME, read_strokes
from bufferstand.foundation.errors import BadInput
from tests.daq.stroke_bench import reached, run
from tests.daq.test_stroke import sine

STEPS = sine(40.0, 15.0, 0.8) + sine(60.0, 15.0, 0.8) + sine(60.0, 15.0, 0.8, more="compensate = false")


def test_the_plan_shows_what_is_commanded_and_reached_by_what_was_learned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A frame 30 % softer than stated, a spring 10 % softer than its model, an actuator of 8 Hz."""
    outcome, opened, _, plan = run(tmp_path, STEPS)
    assert outcome.status == "complete", outcome.reason
    truth = reached(opened, outcome)
    rows = [line["motions"][0] for line in read_strokes(tmp_path / "out")]
    found = stroke_outlook(plan, tmp_path / "out")
    assert [one.compensated for one in found] == [True, True, False]
    for one, row, true in zip(found, rows, truth, strict=True):
        assert one.commanded.mean_mm == pytest.approx(row["last_commanded_mean_mm"], abs=0.15)
        assert one.commanded.amplitude_mm == pytest.approx(row["last_commanded_amplitude_mm"], rel=0.005)
        assert one.reached.mean_mm == pytest.approx(true.mean_mm[-1], abs=0.15)
        assert one.reached.amplitude_mm == pytest.approx(true.amplitude_mm[-1], rel=0.008)
    stated = plan.steps[2].turns
    assert stated is not None
    planned_mm = 0.5 * (stated.upper_mm - stated.lower_mm)
    true_mm = truth[2].amplitude_mm[-1]
    off_mm = abs(found[2].reached.amplitude_mm - true_mm)
    assert off_mm < 0.5 * abs(planned_mm - true_mm), "the plan without it knows a stiffer machine"
    shown = [row[2:5] for row in reached_rows(tmp_path / "out")]
    assert shown[1][0] == "60.00 ± 15.00"

    words = [str(tmp_path / "campaign.toml"), "--learned", str(tmp_path / "out")]
    answer = CliRunner().invoke(command, words)
    assert answer.exit_code == 0, answer.output
    assert "asked mm" in answer.output
    assert "commanded mm" in answer.output
    told = CliRunner().invoke(command, [*words, "--json"])
    strokes = json.loads(told.output)["strokes"]
    assert strokes[1]["commanded"]["mean_mm"] == pytest.approx(found[1].commanded.mean_mm)

    record = load_record(tmp_path / "out")
    assert record is not None
    show_what_is_learned(plan, tmp_path / "out", record)
    assert capsys.readouterr().out == "", "nothing is left to do"


def test_a_folder_in_which_nothing_was_learned_is_said(tmp_path: Path) -> None:
    _, _, _, plan = run(tmp_path, sine(30.0, 5.0, 1.0, cycles=2))
    (tmp_path / "out" / STROKES_NAME).unlink()
    with pytest.raises(BadInput, match="nothing was learned of the stroke here"):
        stroke_outlook(plan, tmp_path / "out")
