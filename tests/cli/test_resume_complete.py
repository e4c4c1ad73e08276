"""``resume`` of a campaign that is complete: nothing is started, asked or connected; only edits are taken."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bufferstand.cli.campaign.as_run_view import rows_against
from bufferstand.cli.campaign.preparation import prepare
from bufferstand.cli.commands.campaign.resume import command
from bufferstand.cli.commands.campaign.run import finish
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome
from bufferstand.daq.campaign_folder.as_run import AsRun, ExpectedOutcome, add_as_run, rows_in_force
from bufferstand.daq.campaign_folder.folder import CampaignFolder, StepRecord
from bufferstand.foundation.errors import BadInput, ExitStatus
from tests.cli.test_edits import Lab


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    """Return a campaign of two steps, both complete; whoever asks or performs now fails."""
    lab = Lab(tmp_path)
    steps = tuple(replace(step, status="complete", cycles_done=3) for step in lab.record.steps)
    CampaignFolder(lab.out).save(replace(lab.record, steps=steps, status="complete"))

    def touched(*_: object, **__: object) -> Any:
        raise AssertionError("asked for, or started")

    for name in (
        "bufferstand.cli.campaign.consent_to_move",
        "bufferstand.cli.campaign.perform",
    ):
        monkeypatch.setattr(name, touched)
    return lab


def _resume(out: Path, *options: str) -> int:
    status: int = command.main([str(out), *options], standalone_mode=False)
    return status


@pytest.mark.parametrize("options", [(), ("--simulate", "--speed", "10")])
def test_nothing_is_left_and_nothing_is_touched(
    lab: Lab, options: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.stat().st_mtime_ns for path in lab.out.rglob("*")}
    assert _resume(lab.out, *options) == 0
    said = capsys.readouterr()
    assert said.out.startswith(
        "nothing is left to do (2 of 2 steps complete), and nothing was touched; next: "
    )
    assert f"bufferstand report {lab.out} --out {lab.out / 'report'}" in said.out
    assert said.err == ""
    assert {path: path.stat().st_mtime_ns for path in lab.out.rglob("*")} == before


def test_a_step_that_was_added_is_left_to_do(lab: Lab) -> None:
    lab.add_step()
    with pytest.raises(AssertionError, match="asked for, or started"):
        _resume(lab.out, "--take-edits")


def test_a_campaign_whose_end_was_not_seen_is_brought_to_its_safe_end(lab: Lab) -> None:
    CampaignFolder(lab.out).save(replace(lab.record, status="running"))
    with pytest.raises(AssertionError, match="asked for, or started"):
        _resume(lab.out)


def test_steps_that_were_left_out_are_counted(lab: Lab, capsys: pytest.CaptureFixture[str]) -> None:
    one, two = lab.record.steps
    CampaignFolder(lab.out).save(replace(lab.record, steps=(one, replace(two, status="skipped"))))
    assert _resume(lab.out) == 0
    assert "(1 of 2 steps complete, 1 skipped)" in capsys.readouterr().out


def test_a_limit_that_was_edited_is_taken_and_is_what_the_next_edit_differs_from(
    lab: Lab, capsys: pytest.CaptureFixture[str]
) -> None:
    lab.edit("[limits]", "[limits]\nforce_max_kN = 580.0")
    assert _resume(lab.out, "--take-edits") == 0
    said = capsys.readouterr()
    assert "limit: force_max_kN 600 → 580 (stricter)" in said.err
    assert "the edited files are taken" in said.err
    assert said.out.startswith("nothing is left to do (2 of 2 steps complete)")
    record = lab.record
    assert record.status == "complete"
    assert record.starts[-1]["edits"]["how"] == "--take-edits"
    assert "force_max_kN = 580.0" in (lab.out / "inputs/edited.toml").read_text()
    lab.edit("580.0", "570.0")
    assert _resume(lab.out, "--take-edits") == 0
    assert "limit: force_max_kN 580 → 570 (stricter)" in capsys.readouterr().err
    lab.edit("570.0", "590.0")
    with pytest.raises(BadInput, match=r"never counts within a campaign: force_max_kN 570 → 590 \(LOOSER\)"):
        _resume(lab.out, "--take-edits")


def test_a_comment_is_taken_and_recorded_too(lab: Lab, capsys: pytest.CaptureFixture[str]) -> None:
    lab.edit("[limits]", "# as agreed\n[limits]")
    assert _resume(lab.out) == 0
    assert lab.record.starts[-1]["edits"]["how"] == "no change in meaning"
    capsys.readouterr()
    assert _resume(lab.out) == 0
    assert capsys.readouterr().err == "", "and it is not said again"


def test_edits_cannot_be_kept_and_taken_at_once(lab: Lab) -> None:
    lab.edit("[limits]", "[limits]\nforce_max_kN = 580.0")
    before = lab.record
    for options in (("--keep", "--take-edits"), ("--take-edits", "--keep")):
        with pytest.raises(BadInput, match=r"--keep --take-edits: .*give only one of them"):
            _resume(lab.out, *options)
    assert lab.record == before


def test_what_a_campaign_took_is_told_without_the_steps_that_edits_have_replaced(
    lab: Lab, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = lab.record.steps
    for step, took_s in ((replace(one, name="gone", plan_hash="f" * 64), 1000.0), (one, 10.0), (two, 20.0)):
        add_as_run(lab.out, _row(step, took_s))
    lab.edit("[limits]", "[limits]\nforce_max_kN = 580.0")  # the others get another hash, and stay
    assert _resume(lab.out, "--take-edits") == 0
    assert lab.record.steps[0].plan_hash != one.plan_hash
    capsys.readouterr()
    outcome = CampaignOutcome("complete", ExitStatus.DONE, (), "", None)
    assert finish(outcome, lab.out) == 0
    said = capsys.readouterr().out
    assert "took 30.0 s (planned 27.0 s)" in said
    assert "without 1 step that edits have replaced (16 min 40 s)" in said
    rows = rows_against(prepare(lab.campaign).plan, lab.out)
    assert [row.name for row in rows] == [one.name, two.name]
    assert "without 1 step that edits have replaced (16 min 40 s)" in capsys.readouterr().err


def _row(step: StepRecord, took_s: float) -> AsRun:
    expected = ExpectedOutcome(0.9 * took_s, 0.0, 21.0)
    return AsRun(
        step.index, step.name, "harmonic", step.plan_hash, False, "", "2026-03-05T14:00:00+00:00", True, 3,
        took_s, 21.0, 21.0, 21.0, 0.0, 0.0, expected, expected, 1.0, 1.0, 0.0, 0.0,
    )  # fmt: skip


def test_a_pause_belongs_to_the_step_that_it_comes_before() -> None:
    a, b = StepRecord(1, "a", "A"), StepRecord(2, "b", "B")
    rows = [replace(_row(StepRecord(0, "p", f"pause {step.name}"), 1.0), pause=True) for step in (a, b)]
    all_rows = (rows[0], _row(a, 1.0), rows[1], _row(b, 1.0), replace(rows[0], name="last"))
    assert rows_in_force(all_rows, {"B"}) == all_rows[2:]
    assert rows_in_force(all_rows, {"A", "B"}) == all_rows
