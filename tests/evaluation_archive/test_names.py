"""Files whose names are no UTF-8 text: evaluated, kept, found and put out like any other."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.recordings.runs import command
from bufferstand.evaluation.archive.cache import Cache
from bufferstand.evaluation.archive.evaluate import evaluate_archive
from bufferstand.evaluation.archive.local_workers import LocalWorkers
from bufferstand.evaluation.archive.run_files import find_runs
from bufferstand.evaluation.archive.settings_and_software import software
from bufferstand.evaluation.archive.tables import write_document, write_tables
from bufferstand.foundation.files.names import readable
from bufferstand.recording.finding import cache_file as cachefile
from tests.evaluation_archive.samples import SETTINGS, archive


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(cachefile, "SETTLED_S", 0.0)
    runs = archive(tmp_path / "archive")
    for path, name in zip(runs, (b"Pr\xfcf.h5", b"Pr\xe4f.h5", "Prüf.h5".encode()), strict=False):
        path.rename(tmp_path / os.fsdecode(name))
    return tmp_path


NAMES = ["Pr\\xe4f.h5", "Pr\\xfcf.h5", "Prüf.h5"]


def test_readable(tmp_path: Path) -> None:
    assert readable(Path("a/Prüf 漢.h5")) == "a/Prüf 漢.h5"
    assert [readable(os.fsdecode(name)) for name in (b"Pr\xfcf", b"Pr\xe4f")] == ["Pr\\xfcf", "Pr\\xe4f"]


@pytest.mark.slow
def test_evaluated_and_kept(folder: Path, tmp_path: Path) -> None:
    files = find_runs([str(folder / "*.h5")])
    for reused in (0, 3):
        cache = Cache(tmp_path / "cache", SETTINGS.sha256, software().sha256)
        evaluation = evaluate_archive(files, SETTINGS, LocalWorkers(1), cache)
        cache.close()
        assert evaluation.reused == reused
        assert sorted(Path(run.path).name for run in evaluation.runs) == NAMES
        with (tmp_path / "e.json").open("w", encoding="utf-8") as stream:
            write_document(evaluation, stream)
        write_tables(evaluation, tmp_path / "cycles.csv", tmp_path / "runs.csv")
        for name in ("e.json", "cycles.csv", "runs.csv"):
            assert "xfcf.h5" in (tmp_path / name).read_text(encoding="utf-8")


@pytest.mark.slow
def test_listed_and_found(folder: Path, tmp_path: Path) -> None:
    for words in (["--where", "damping > 0 and 'xfc' in path", "--json", "-"], ["--json", "-"], []):
        done = CliRunner().invoke(
            command, [str(folder), "--cache", str(tmp_path / "cache"), *words], standalone_mode=False
        )
        assert done.exception is None
        assert "xfcf.h5" in done.stdout
        if "--where" in words:
            (run,) = json.loads(done.stdout)["runs"]
            assert run["damping"] > 0.0
