"""A recording counts once, however many files hold it, and one message names the copies."""

from __future__ import annotations

import json
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from bufferstand.cli.main import main
from bufferstand.evaluation.across_runs.copies import SHOWN, RecordingIdentity, each_once
from bufferstand.evaluation.archive.evaluate import evaluate_archive
from bufferstand.evaluation.archive.local_workers import LocalWorkers
from bufferstand.evaluation.archive.run_queries import results_by_path
from bufferstand.evaluation.archive.tables import document, runs_frame
from bufferstand.evaluation.document.build import evaluate_paths
from tests.evaluation_archive.samples import SETTINGS, archive

BEGUN = datetime(2026, 3, 5, 9, tzinfo=UTC)


def ended(*words: str) -> int | str | None:
    """Run the command; return its exit status."""
    with pytest.raises(SystemExit) as end:
        main(list(words))
    return end.value.code


def copied(path: Path, name: str) -> Path:
    return Path(shutil.copy(path, path.with_name(name)))


@pytest.mark.slow
def test_a_copy_changes_no_figure_and_is_named_once(tmp_path: Path) -> None:
    runs = archive(tmp_path)[:4]
    alone = document(evaluate_archive(runs, SETTINGS, LocalWorkers(1)))
    copy = copied(runs[1], "zz.h5")
    evaluation = evaluate_archive([*runs, copy], SETTINGS, LocalWorkers(1))
    both = document(evaluation)
    assert both["runs"] == alone["runs"]
    assert both["trends"] == alone["trends"]
    assert both["copies"] == [{"path": str(copy), "of": str(runs[1]), "same": "content"}]
    assert both["warnings"] == [f"{copy} is a copy of {runs[1]}: it is counted once"]
    assert alone["copies"] == []
    by_path = results_by_path(evaluation)
    assert by_path[str(copy)] == by_path[str(runs[1])]
    rows = runs_frame(evaluation)
    assert list(rows["problem"].dropna()) == [f"{copy} is a copy of {runs[1]}: counted once"]
    in_python = evaluate_paths([*runs, copy], SETTINGS.options)
    assert (in_python["copies"], in_python["warnings"]) == (both["copies"], both["warnings"])
    assert in_python["trends"] == both["trends"]


def test_the_same_samples_under_another_name_are_one_recording(tmp_path: Path) -> None:
    text = "time [s],stroke [mm],force [kN]\n" + "".join(
        f"{0.01 * n:.2f},{min(n, 100 - n):d},{2 * min(n, 100 - n):d}\n" for n in range(101)
    )
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(text)
    out = tmp_path / "runs"
    files = [str(tmp_path / name) for name in ("a.csv", "b.csv")]
    assert ended("import", *files, "--kind", "static", "--out", str(out)) == 0
    made = evaluate_paths([out], SETTINGS.options)
    assert [run["run"]["id"] for run in made["runs"]] == ["a"]
    assert [copy["same"] for copy in made["copies"]] == ["samples"]
    (told,) = made["warnings"]
    assert "name only the one whose facts are right" in told


def test_a_program_that_reads_the_json_is_told_on_standard_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = archive(tmp_path)[:1]
    copy = copied(runs[0], "zz.h5")
    assert ended("evaluate", str(runs[0]), str(copy), "--json", "-", "--draws", "0", "--no-cache") == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["copies"]
    assert err.count("is a copy of") == 1


def test_runs_of_two_campaigns_with_one_id_are_no_copies() -> None:
    one = RecordingIdentity("a.h5", "001", "h1", "s1", "A", BEGUN)
    other = RecordingIdentity("b.h5", "001", "h2", "s2", "B", BEGUN)
    assert each_once([one, other]).kept == (0, 1)
    assert each_once([one, other]).warnings == ()


def test_two_different_files_of_one_run_are_doubted() -> None:
    one = RecordingIdentity("a.h5", "001", "h1", "s1", "A", BEGUN)
    other = RecordingIdentity("b.h5", "001", "h2", "s2", "A", BEGUN)
    told = each_once([one, other])
    assert told.kept == (0, 1)
    (text,) = told.warnings
    assert "b.h5 and a.h5 are both run “001” of campaign “A”" in text


def test_runs_without_a_file_or_samples_are_never_copies() -> None:
    assert each_once([RecordingIdentity("", "x"), RecordingIdentity("", "x")]).kept == (0, 1)


def test_many_copies_are_one_message() -> None:
    files = [RecordingIdentity(f"{n}.h5", "001", "h", "s") for n in range(SHOWN + 3)]
    told = each_once(files)
    assert (told.kept, len(told.copies)) == ((0,), SHOWN + 2)
    (text,) = told.warnings
    assert "and 2 more files" in text
