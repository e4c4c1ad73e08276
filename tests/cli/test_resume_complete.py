"""``resume`` of a campaign that is complete: nothing is started, asked, connected or written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cli.commands.resume import command
from daq.folder import CampaignFolder
from tests.cli.test_edits import Lab


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    """Return a campaign of two steps, both complete; whoever asks or performs now fails."""
    lab = Lab(tmp_path)
    steps = tuple(replace(step, status="complete", cycles_done=3) for step in lab.record.steps)
    CampaignFolder(lab.out).save(replace(lab.record, steps=steps, status="complete"))

    def touched(*_: object, **__: object) -> Any:
        raise AssertionError("asked for, or started")

    for name in ("cli.running.consent_to_move", "cli.running.perform"):
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
