"""The line with which ``run`` and ``resume`` end: how many run files there are, and whose."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.cli.commands.campaign.run import finish
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome
from bufferstand.daq.campaign_folder.folder import CampaignStatus
from bufferstand.foundation.errors import ExitStatus


def end_line(
    folder: Path, capsys: pytest.CaptureFixture[str], *, there: int, made: int, status: CampaignStatus
) -> str:
    runs = folder / "runs"
    runs.mkdir()
    paths = [runs / f"{number:03}-static.h5" for number in range(1, there + 1)]
    for path in paths:
        path.touch()
    (runs / "009-static.journal").touch()  # not sealed: no run file
    exit_status = ExitStatus.DONE if status == "complete" else ExitStatus.STOPPED
    finish(CampaignOutcome(status, exit_status, tuple(paths[there - made :]), "", None), folder)
    said = capsys.readouterr()
    return said.out + said.err


def test_after_a_resume_it_counts_all_and_those_of_this_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = end_line(tmp_path, capsys, there=7, made=4, status="complete")
    assert line.startswith(f"campaign complete: 7 run files in {tmp_path / 'runs'}, 4 of this start; next: ")


def test_of_a_first_start_they_are_all(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = end_line(tmp_path, capsys, there=1, made=1, status="complete")
    assert line.startswith(f"campaign complete: 1 run file in {tmp_path / 'runs'}; next: ")


def test_so_it_does_where_it_was_stopped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = end_line(tmp_path, capsys, there=5, made=0, status="stopped")
    assert f"5 run files in {tmp_path / 'runs'}, 0 of this start; go on with it" in line
