"""What is known already: found again by content, never believed when it is not, never needed."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from bufferstand.evaluation.archive import cache as cache_room
from bufferstand.evaluation.archive.cache import FILE_NAME, Cache
from bufferstand.evaluation.archive.evaluate import ArchiveEvaluation, evaluate_archive
from bufferstand.evaluation.archive.local_workers import LocalWorkers
from bufferstand.evaluation.archive.settings_and_software import EvaluationSettings, software
from bufferstand.evaluation.archive.stored_run import RequestedParts
from bufferstand.evaluation.archive.tasks import File, Outcome
from bufferstand.recording.finding import cache_file as cachefile
from bufferstand.recording.finding.cache_file import CacheFile
from bufferstand.recording.finding.index import indexed_runs
from tests.evaluation_archive.samples import SETTINGS, all_of_it, archive, damaged

DAMAGE = {
    "other values": "UPDATE runs SET cycles = zeroblob(length(cycles))",
    "other entry": "UPDATE runs SET entry = zeroblob(length(entry))",
    "other type": "UPDATE runs SET rows = CAST(rows AS BLOB)",
    "no text": "UPDATE runs SET text = CAST(x'7bff' AS TEXT)",
    "other table": "DROP TABLE files",
}


class Counting:
    """Workers that say what they were given."""

    def __init__(self) -> None:
        self.given: list[str] = []

    def evaluate(self, files: Sequence[File], settings: EvaluationSettings) -> Iterator[Outcome]:
        self.given += [Path(file.path).name for file in files]
        yield from LocalWorkers(1).evaluate(files, settings)


def evaluated(
    files: Sequence[Path], folder: Path, settings: EvaluationSettings = SETTINGS
) -> tuple[ArchiveEvaluation, list[str]]:
    workers = Counting()
    cache = Cache(folder, settings.sha256, software().sha256)
    evaluation = evaluate_archive(files, settings, workers, cache)
    assert cache.problem == ""
    cache.close()
    return evaluation, workers.given


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    monkeypatch.setattr(cachefile, "SETTLED_S", 0.0)
    return archive(tmp_path / "archive")[:3]


@pytest.mark.slow
def test_only_what_changed_is_evaluated(runs: list[Path], tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    first, given = evaluated(runs, folder)
    assert given == [path.name for path in runs]
    second, given = evaluated(runs, folder)
    assert (given, second.reused) == ([], 3)
    assert all_of_it(second) == all_of_it(first)

    os.utime(runs[0])  # touched, its content is the same
    moved = runs[1].rename(runs[1].with_name("moved.h5"))
    copied = runs[2].with_name("copied.h5")
    copied.write_bytes(runs[2].read_bytes())
    third, given = evaluated([runs[0], moved, copied], folder)
    assert given == []
    assert [run.path for run in third.runs] == [str(runs[0]), str(moved), str(copied)]

    runs[2].write_bytes(runs[0].read_bytes())  # another run under its name
    fourth, given = evaluated([runs[2]], folder)
    assert given == []
    assert fourth.runs[0].facts["sha256"] == first.runs[0].facts["sha256"]


@pytest.mark.slow
def test_other_settings_are_another_evaluation(runs: list[Path], tmp_path: Path) -> None:
    evaluated(runs[:1], tmp_path)
    heavier = replace(SETTINGS, options=replace(SETTINGS.options, moving_mass_kg=150.0))
    other, given = evaluated(runs[:1], tmp_path, heavier)
    assert given == [runs[0].name]
    assert other.runs[0].facts["means"] != evaluated(runs[:1], tmp_path)[0].runs[0].facts["means"]
    assert evaluated(runs[:1], tmp_path, heavier)[1] == []


def test_other_code_is_another_evaluation(
    runs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluated(runs[:1], tmp_path)
    cache = Cache(tmp_path, SETTINGS.sha256, replace(software(), code_sha256="f" * 64).sha256)
    assert cache.find("x.h5", "no matter", RequestedParts()) is None
    assert evaluate_archive(runs[:1], SETTINGS, Counting(), cache).reused == 0
    cache.close()
    monkeypatch.setattr(cache_room, "KEPT_DAYS", 0)
    Cache(tmp_path, SETTINGS.sha256, software().sha256).close()  # drops what other software left
    with sqlite3.connect(tmp_path / FILE_NAME) as connection:
        assert connection.execute("SELECT count(*) FROM runs").fetchone() == (1,)
    connection.close()


@pytest.mark.slow
def test_a_file_that_was_damaged_is_not_taken_for_whole(runs: list[Path], tmp_path: Path) -> None:
    evaluated(runs, tmp_path)
    damaged(runs[0])
    found, given = evaluated(runs, tmp_path)
    assert given == [runs[0].name]
    assert [failure.path for failure in found.failures] == [str(runs[0])]


def test_a_file_changed_just_now_is_read(tmp_path: Path) -> None:
    runs = archive(tmp_path / "archive")[:1]
    evaluated(runs, tmp_path)
    with sqlite3.connect(tmp_path / FILE_NAME) as connection:
        assert connection.execute("SELECT count(*) FROM files").fetchone() == (0,)
    connection.close()
    assert evaluated(runs, tmp_path)[1] == []  # but found by its content


def test_whether_it_was_changed_just_now_is_asked_when_its_stamp_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Slow(Counting):
        def evaluate(self, files: Sequence[File], settings: EvaluationSettings) -> Iterator[Outcome]:
            monkeypatch.setattr(cachefile, "SETTLED_S", 0.0)  # as if it took longer than that
            yield from super().evaluate(files, settings)

    runs = archive(tmp_path / "archive")[:1]
    cache = Cache(tmp_path, SETTINGS.sha256, software().sha256)
    evaluate_archive(runs, SETTINGS, Slow(), cache)
    cache.close()
    with sqlite3.connect(tmp_path / FILE_NAME) as connection:
        assert connection.execute("SELECT count(*) FROM files").fetchone() == (0,)
    connection.close()


def test_a_user_without_a_home_goes_on_without(runs: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    def nobody() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", nobody)
    assert cachefile.default_folder() is None
    cache = Cache(None, SETTINGS.sha256, software().sha256)
    assert len(evaluate_archive(runs[:1], SETTINGS, Counting(), cache).runs) == 1
    assert "no home folder; name a folder with --cache" in cache.problem
    assert len(indexed_runs(runs[0])) == 1
    cache.close()


@pytest.mark.dose(4)
@pytest.mark.slow
@pytest.mark.parametrize(
    "damage",
    [
        "none",
        "no database",
        "cut",
        "other values",
        "other entry",
        "other type",
        "no text",
        "other table",
        "foreign",
    ],
)
def test_a_damaged_cache_costs_only_time(runs: list[Path], tmp_path: Path, damage: str) -> None:
    first, _ = evaluated(runs[:1], tmp_path)
    file = tmp_path / FILE_NAME
    if damage == "no database":
        file.write_bytes(b"no database" * 1000)
    elif damage == "cut":
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    elif damage == "foreign":
        file.unlink()
        with sqlite3.connect(file) as connection:
            connection.execute("CREATE TABLE files (path TEXT PRIMARY KEY, colour TEXT)")
        connection.close()
    elif damage != "none":
        with sqlite3.connect(file) as connection:
            connection.execute(DAMAGE[damage])
        connection.close()
    workers = Counting()
    cache = Cache(tmp_path, SETTINGS.sha256, software().sha256)
    again = evaluate_archive(runs[:1], SETTINGS, workers, cache)
    cache.close()
    assert workers.given == ([] if damage in ("none", "other table") else [runs[0].name])
    assert all_of_it(again) == all_of_it(first)
    assert cache.problem == ""
    assert evaluated(runs[:1], tmp_path)[1] == []  # it is whole again


@pytest.mark.slow
def test_pages_that_are_garbled_are_made_anew(runs: list[Path], tmp_path: Path) -> None:
    first, _ = evaluated(runs, tmp_path)
    file = tmp_path / FILE_NAME
    content = bytearray(file.read_bytes())
    content[4096:] = os.urandom(len(content) - 4096)  # all but the first page, which has the schema
    file.write_bytes(content)
    again, given = evaluated(runs, tmp_path)
    assert len(given) == 3
    assert all_of_it(again) == all_of_it(first)
    evaluated(runs, tmp_path)  # what was lost with the damage is kept at last
    assert evaluated(runs, tmp_path)[1] == []


@pytest.mark.slow
def test_a_schema_that_is_no_text_is_made_anew(runs: list[Path], tmp_path: Path) -> None:
    evaluated(runs[:1], tmp_path)
    file = tmp_path / FILE_NAME
    file.write_bytes(file.read_bytes().replace(b"CREATE TABLE files", b"CR\xf3ATE TABLE files"))
    assert len(evaluated(runs[:1], tmp_path)[1]) == 1
    assert evaluated(runs[:1], tmp_path)[1] == []


def test_one_that_stays_damaged_is_given_up(tmp_path: Path) -> None:
    file = CacheFile(tmp_path, "x.sqlite", "CREATE TABLE IF NOT EXISTS x (y INTEGER);")
    for tries in range(2):
        with file.guarded() as connection:
            assert connection is not None
            connection.execute("SELECT colour FROM nowhere")
        assert file.usable == (tries == 0)
    assert "no such table: nowhere; going on without it" in file.problem


def test_one_that_another_made_anew_is_left_alone(tmp_path: Path) -> None:
    one = CacheFile(tmp_path, "x.sqlite", "CREATE TABLE IF NOT EXISTS x (y INTEGER);")
    (tmp_path / "x.sqlite").rename(tmp_path / "damaged.sqlite")  # so that its inode is not given anew
    other = CacheFile(tmp_path, "x.sqlite", "CREATE TABLE IF NOT EXISTS x (y INTEGER);")
    with other.guarded() as connection:
        assert connection is not None
        connection.execute("INSERT INTO x VALUES (1)")
    with one.guarded() as connection:
        assert connection is not None
        connection.execute("SELECT colour FROM nowhere")
    with one.guarded() as connection:
        assert connection is not None
        assert connection.execute("SELECT y FROM x").fetchall() == [(1,)]
    one.close()
    other.close()


@pytest.mark.slow
def test_deleted_or_forbidden_meanwhile(runs: list[Path], tmp_path: Path) -> None:
    class Deleting(Counting):
        def evaluate(self, files: Sequence[File], settings: EvaluationSettings) -> Iterator[Outcome]:
            for outcome in super().evaluate(files, settings):
                (tmp_path / "cache" / FILE_NAME).unlink(missing_ok=True)
                yield outcome

    cache = Cache(tmp_path / "cache", SETTINGS.sha256, software().sha256)
    assert len(evaluate_archive(runs, SETTINGS, Deleting(), cache).runs) == 3
    cache.close()
    (tmp_path / "file").touch()
    nowhere = Cache(tmp_path / "file" / "below", SETTINGS.sha256, software().sha256)
    assert "going on without it" in nowhere.problem
    assert len(evaluate_archive(runs, SETTINGS, Counting(), nowhere).runs) == 3
    nowhere.close()


_WRITER = """
import sys
from pathlib import Path
from bufferstand.evaluation.archive.cache import Cache
from bufferstand.evaluation.archive.evaluate import evaluate_archive
from bufferstand.evaluation.archive.settings_and_software import software
from bufferstand.evaluation.archive.local_workers import LocalWorkers
from tests.evaluation_archive.samples import SETTINGS
runs = sorted(Path(sys.argv[1]).rglob("*.h5"))
for _ in range(int(sys.argv[3])):
    cache = Cache(Path(sys.argv[2]), SETTINGS.sha256, software().sha256)
    evaluate_archive(runs, SETTINGS, LocalWorkers(1), cache)
    assert not cache.problem, cache.problem
    cache.close()
    for path in runs:
        path.touch()
"""


@pytest.mark.slow
def test_two_evaluations_at_once(runs: list[Path], tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-c", _WRITER, str(runs[0].parent), str(tmp_path / "cache"), "4"]
    both = [subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(Path.cwd())}) for _ in range(2)]
    deadline = time.monotonic() + 120.0
    assert [process.wait(deadline - time.monotonic()) for process in both] == [0, 0]
    assert evaluated(runs, tmp_path / "cache")[1] == []
