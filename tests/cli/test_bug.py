"""A bug of ours is told with its place, also where no file can be written."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.cli.campaign.running import keep_bug


@pytest.mark.parametrize("there_is_room", [True, False])
def test_the_place_of_a_bug_is_kept_or_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], there_is_room: bool
) -> None:
    out = tmp_path if there_is_room else tmp_path / "gone"
    keep_bug(ZeroDivisionError("a bug"), out)
    told = capsys.readouterr().err
    assert told.startswith("warning: a bug of bufferstand ended this; please report")
    assert ("ZeroDivisionError: a bug" in told) != there_is_room
    if there_is_room:
        assert "ZeroDivisionError: a bug" in (out / "internal-error.txt").read_text()
