"""Evaluation in processes of this machine: the same bits, and nothing stops the others."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pandas as pd
import pytest

from bufferstand.evaluation.archive.evaluate import ArchiveProgress, evaluate_archive
from bufferstand.evaluation.archive.local_workers import DIED, LocalWorkers
from bufferstand.evaluation.archive.settings_and_software import software
from bufferstand.evaluation.archive.tables import cycles_frame, write_document, write_tables
from bufferstand.evaluation.archive.tasks import (
    MOST_BYTES,
    MOST_FILES,
    File,
    OtherSoftware,
    batches,
    evaluate_batch,
)
from bufferstand.evaluation.document.build import evaluate_paths
from tests.evaluation_archive.samples import SETTINGS, all_of_it, archive, damaged, let_poison_kill


@pytest.mark.slow
def test_processes_give_what_this_one_gives_and_bad_files_stop_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = archive(tmp_path)
    here = evaluate_archive(runs, SETTINGS, LocalWorkers(1))
    assert here.failures == ()

    broken, foreign, gone = runs[1].with_name("damaged.h5"), runs[1].with_name("f.h5"), tmp_path / "gone.h5"
    broken.write_bytes(runs[1].read_bytes())
    damaged(broken)
    foreign.write_text("time,force\n")
    poison = runs[2].with_name("poison.h5")
    poison.write_bytes(runs[2].read_bytes())
    let_poison_kill(tmp_path, monkeypatch)
    told: list[ArchiveProgress] = []
    files = [*runs[:2], broken, foreign, poison, gone, *runs[2:]]
    there = evaluate_archive(files, SETTINGS, LocalWorkers(2), report=told.append)

    assert [Path(failure.path).name for failure in there.failures] == [
        "damaged.h5", "f.h5", "poison.h5", "gone.h5"
    ]  # fmt: skip
    assert "no HDF5 file" in there.failures[1].problem
    assert (there.failures[2].problem, there.failures[2].lost) == (DIED, True)
    assert "no such file" in there.failures[3].problem
    assert told[-1] == ArchiveProgress(done=12, total=12, reused=0, failed=4)
    one, two = all_of_it(here), all_of_it(there)
    assert one[0] == two[0]
    assert one[2]["runs"] == two[2]["runs"]  # type: ignore[index]
    assert one[2]["trends"] == two[2]["trends"]  # type: ignore[index]


@pytest.mark.slow
def test_the_same_as_without_processes_and_keeping(tmp_path: Path) -> None:
    """What is kept and sent loses nothing: the document is that of the plain evaluation."""
    runs = archive(tmp_path)[:3]
    plain = evaluate_paths(runs, SETTINGS.options)
    evaluation = evaluate_archive(runs, SETTINGS, LocalWorkers(1))
    with (tmp_path / "e.json").open("w") as stream:
        write_document(evaluation, stream)
    kept = json.loads((tmp_path / "e.json").read_text())
    for key in ("schema", "runs", "trends", "temperature_comparisons", "decision_rule"):
        assert kept[key] == json.loads(json.dumps(plain[key])), key
    assert kept["trends"]
    assert kept["software"]["version"] == plain["software"]["version"]
    assert kept["failures"] == []


@pytest.mark.slow
def test_a_long_document_is_written_run_by_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    evaluation = evaluate_archive(archive(tmp_path)[:3], SETTINGS, LocalWorkers(1))
    texts = []
    for most in (20, 2):
        monkeypatch.setattr("bufferstand.evaluation.archive.tables.PRETTY_RUNS", most)
        with (tmp_path / "e.json").open("w") as stream:
            write_document(evaluation, stream)
        texts.append((tmp_path / "e.json").read_text())
    assert json.loads(texts[0]) == json.loads(texts[1])
    assert texts[1].count("\n") < 30


def test_csv_says_what_pandas_writes(tmp_path: Path) -> None:
    evaluation = evaluate_archive(archive(tmp_path)[:2], SETTINGS, LocalWorkers(1))
    write_tables(evaluation, tmp_path / "c.csv", None)
    texts = (tmp_path / "c.csv").read_text(), cycles_frame(evaluation).to_csv(index=False)
    ours, theirs = (list(csv.reader(StringIO(text))) for text in texts)
    assert len(ours) == len(theirs) > 1
    for mine, its in zip(ours, theirs, strict=True):
        for a, b in zip(mine, its, strict=True):  # 0.000015 is 1.5e-05
            assert a == b or float(a) == float(b)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".xlsx"])
def test_every_row_can_be_traced(tmp_path: Path, suffix: str) -> None:
    runs = archive(tmp_path)[:2]
    (tmp_path / "no.h5").touch()
    evaluation = evaluate_archive([*runs, tmp_path / "no.h5"], SETTINGS, LocalWorkers(1))
    names = tmp_path / f"cycles{suffix}", tmp_path / f"runs{suffix}"
    write_tables(evaluation, *names)
    readers = {".csv": pd.read_csv, ".parquet": pd.read_parquet, ".xlsx": pd.read_excel}
    cycles, rows = (readers[suffix](name) for name in names)
    assert len(cycles) == sum(run.facts["cycles"] for run in evaluation.runs)
    assert list(rows["path"]) == [str(path) for path in (*runs, tmp_path / "no.h5")]
    assert "no HDF5 file" in rows["problem"][2]
    for table in (cycles, rows):
        assert set(table["settings_sha256"]) == {SETTINGS.sha256}
        assert set(table["version"]) == {software().text}
    assert list(rows["sha256"][:2]) == [run.facts["sha256"] for run in evaluation.runs]
    assert set(cycles["sha256"]) == set(rows["sha256"][:2])
    value, expanded = evaluation.runs[0].facts["means"]["damping"][:2]
    assert (rows["damping"][0], rows["U(damping)"][0]) == pytest.approx((value, expanded), rel=1e-12)
    if suffix == ".xlsx":
        assert list(pd.read_excel(names[0], sheet_name=None)) == ["cycles", "runs"]


def test_other_software_is_refused(tmp_path: Path) -> None:
    other = replace(software(), code_sha256="0" * 64, libraries=(("numpy", "1.0"),))
    with pytest.raises(OtherSoftware, match=r"bufferstand .* instead of .*\+000000000000, numpy .* instead"):
        evaluate_batch([], SETTINGS, other)


def test_tasks_are_even_and_the_largest_come_first() -> None:
    files = [File(str(n), 500_000) for n in range(2000)] + [File("long", 2_000_000_000)]
    made = batches(files, 2)
    assert sorted(file.path for batch in made for file in batch) == sorted(file.path for file in files)
    assert made[0] == [files[-1]]
    assert max(len(batch) for batch in made) == MOST_FILES
    assert all(sum(file.size for file in batch) <= MOST_BYTES for batch in made[1:])
    assert max(len(batch) for batch in batches(files[:16], 2)) == 2
