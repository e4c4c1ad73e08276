"""``bufferstand runs``: what is sound is listed; what cannot be read is named."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from bufferstand.cli.commands.recordings import runs
from bufferstand.cli.commands.recordings.runs import command
from bufferstand.foundation.errors import BadInput

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs" / "runs"


def listed(path: Path, *words: str) -> Result:
    return CliRunner().invoke(command, [str(path), "--no-cache", *words], standalone_mode=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "bad.h5").write_text("nothing")
    (tmp_path / "worse.h5").touch()
    return tmp_path


def test_a_file_that_is_no_run_is_refused(folder: Path) -> None:
    for words in ([], ["--json", "-"]):
        done = listed(folder / "bad.h5", *words)
        assert isinstance(done.exception, BadInput)
        assert str(done.exception).endswith(
            "bad.h5: no HDF5 file; name a run file (*.h5) or a folder of them; "
            "“bufferstand import” makes runs of foreign records"
        )
        assert done.output == ""


def test_a_folder_of_which_nothing_can_be_read_is_bad_input(folder: Path) -> None:
    done = listed(folder, "--json", "-")
    assert isinstance(done.exception, BadInput)
    assert "none of its 2 run files can be read" in str(done.exception)
    assert len(json.loads(done.stdout)["problems"]) == 2
    assert done.stderr.count("warning: ") == 2


def test_what_cannot_be_read_does_not_hide_the_others(folder: Path) -> None:
    sample = next(SAMPLES.glob("*.h5"))
    (folder / sample.name).write_bytes(sample.read_bytes())
    done = listed(folder)
    assert done.exception is None
    assert sample.name in done.stdout
    assert done.stderr.count("warning: ") == 2


def test_without_a_home_that_is_said_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "default_folder", lambda: None)
    done = CliRunner().invoke(command, [str(next(SAMPLES.glob("*.h5")))], standalone_mode=False)
    assert done.exception is None
    assert done.stderr.count("no home folder") == 1
