"""A real Dask cluster on loopback, whose processes are killed: the same bits, or a plain word why not."""

from __future__ import annotations

import logging
import os
import shutil
import threading
from collections.abc import Sequence
from pathlib import Path

import pytest

from bufferstand.evaluation.archive.cache import Cache
from bufferstand.evaluation.archive.dask_cluster import ClusterWorkers, _quiet
from bufferstand.evaluation.archive.evaluate import ArchiveProgress, evaluate_archive
from bufferstand.evaluation.archive.local_workers import DIED, LocalWorkers
from bufferstand.evaluation.archive.settings_and_software import software
from bufferstand.evaluation.archive.tables import cycles_frame, write_tables
from bufferstand.evaluation.archive.tasks import File, OtherFile, evaluate_batch, mark_of
from bufferstand.foundation.errors import BadInput, DeviceFault
from bufferstand.recording.runfile.file import read_metadata
from tests.evaluation_archive.dask_cluster import ROOT, DaskCluster, dask_cluster, free_port
from tests.evaluation_archive.samples import (
    SETTINGS,
    aged,
    all_of_it,
    archive,
    damaged,
    let_poison_kill,
    let_slow_wait,
    until,
)

pytestmark = pytest.mark.filterwarnings(
    "ignore::ResourceWarning"
)  # Dask's own sockets, when one end is killed


@pytest.fixture
def runs(tmp_path: Path) -> list[Path]:
    return archive(tmp_path / "archive")


def silent(_: str) -> None:
    """Take warnings of processors that differ: not here, where all are one machine."""
    raise AssertionError(_)


def table(folder: Path, name: str, files: Sequence[Path], workers: LocalWorkers | ClusterWorkers) -> bytes:
    evaluation = evaluate_archive(files, SETTINGS, workers)
    write_tables(evaluation, folder / f"{name}.csv", folder / f"{name}-runs.csv")
    return (folder / f"{name}.csv").read_bytes() + (folder / f"{name}-runs.csv").read_bytes()


@pytest.mark.slow
def test_the_same_table_with_a_worker_killed_midway(
    runs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Relative paths, a damaged file and one that kills its worker; the table is that of this process."""
    monkeypatch.chdir(tmp_path)
    bad = runs[3].with_name("bad.h5")
    bad.write_bytes(runs[3].read_bytes())
    damaged(bad)
    files = [path.relative_to(tmp_path) for path in (*runs[:4], bad, *runs[4:])]
    expected = table(tmp_path, "here", files, LocalWorkers(1))
    with dask_cluster(tmp_path, 2) as cluster:
        killed: list[ArchiveProgress] = []

        def kill_one(progress: ArchiveProgress) -> None:
            if progress.done >= 2 and not killed:
                killed.append(progress)
                cluster.kill(cluster.workers[0])

        evaluation = evaluate_archive(
            files, SETTINGS, ClusterWorkers(cluster.address, silent), report=kill_one
        )
        assert killed
        assert [Path(failure.path).name for failure in evaluation.failures] == ["bad.h5"]
        write_tables(evaluation, tmp_path / "there.csv", tmp_path / "there-runs.csv")
    there = (tmp_path / "there.csv").read_bytes() + (tmp_path / "there-runs.csv").read_bytes()
    assert there == expected


@pytest.mark.long
def test_a_file_that_kills_its_worker(
    runs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The workers' nannies start them again; the file is named and the others have their results."""
    poison = runs[0].with_name("poison.h5")
    poison.write_bytes(runs[0].read_bytes())
    expected = evaluate_archive(runs[:3], SETTINGS, LocalWorkers(1))
    place = let_poison_kill(tmp_path, monkeypatch)
    values = {"PYTHONPATH": f"{place}:{ROOT}"}
    cluster = DaskCluster(tmp_path)
    try:
        cluster.start_scheduler({"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"})
        cluster.start_worker(values, nanny=True)
        found = evaluate_archive([poison, *runs[:3]], SETTINGS, ClusterWorkers(cluster.address, silent))
    finally:
        cluster.close()
    assert [(failure.problem, failure.lost) for failure in found.failures] == [(DIED, True)]
    assert cycles_frame(found).equals(cycles_frame(expected))


@pytest.mark.long
def test_a_scheduler_that_is_restarted(runs: list[Path], tmp_path: Path) -> None:
    expected = all_of_it(evaluate_archive(runs, SETTINGS, LocalWorkers(1)))
    with dask_cluster(tmp_path, 1) as cluster:
        restarted: list[threading.Thread] = []

        def restart() -> None:
            assert cluster.scheduler is not None
            cluster.kill(cluster.scheduler)
            cluster.kill(cluster.workers[0])
            cluster.start_scheduler()
            cluster.start_worker()

        def restart_once(progress: ArchiveProgress) -> None:
            if progress.done >= 2 and not restarted:
                restarted.append(threading.Thread(target=restart))
                restarted[0].start()

        workers = ClusterWorkers(cluster.address, silent)
        assert all_of_it(evaluate_archive(runs, SETTINGS, workers, report=restart_once)) == expected
        restarted[0].join()


@pytest.fixture(scope="module")
def other_code(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the code that differs in one line of the evaluation."""
    folder = tmp_path_factory.mktemp("other-code")
    package = folder / "bufferstand"
    shutil.copytree(ROOT / "bufferstand", package, ignore=shutil.ignore_patterns("__pycache__"))
    with (package / "evaluation" / "cycles.py").open("a") as file:
        file.write("# another version\n")
    return folder


@pytest.mark.slow
def test_what_cannot_be_a_worker(runs: list[Path], tmp_path: Path, other_code: Path) -> None:
    """Other code, no bufferstand at all, more threads, an archive that is not mounted: refused by name."""
    cases: list[tuple[dict[str, str], str]] = [
        ({"PYTHONPATH": str(other_code)}, r"worker tcp://127.0.0.1:\d+: has bufferstand .* instead of"),
        ({"OPENBLAS_NUM_THREADS": "2"}, "is not run with OPENBLAS_NUM_THREADS=1"),
    ]
    cluster = DaskCluster(tmp_path)
    try:
        cluster.start_scheduler()
        for environment, said in cases:
            worker = cluster.start_worker(environment)
            with pytest.raises(BadInput, match=said):
                evaluate_archive(runs[:2], SETTINGS, ClusterWorkers(cluster.address, silent))
            cluster.kill(worker)
    finally:
        cluster.close()


HERE = Path("/proc/self/cwd")
"""Each process sees its own current folder under this path, as machines do that mount different archives."""


@pytest.mark.slow
def test_a_worker_that_sees_another_archive(
    runs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first file is the same there, the second is another run: refused, and nothing of it is kept."""
    for place, chosen in (("mine", runs[:2]), ("stale", [runs[0], runs[5]])):
        (tmp_path / place).mkdir()
        for name, run in zip("ab", chosen, strict=True):
            shutil.copyfile(run, tmp_path / place / f"{name}.h5")
            aged(tmp_path / place / f"{name}.h5")
    monkeypatch.chdir(tmp_path / "mine")
    monkeypatch.setattr("bufferstand.recording.finding.cache_file.SETTLED_S", -1e6)
    files = [HERE / "a.h5", HERE / "b.h5"]
    cache = Cache(tmp_path / "cache", SETTINGS.sha256, software().sha256)
    with dask_cluster(tmp_path, 0) as cluster:
        cluster.start_worker(folder=tmp_path / "stale")
        with pytest.raises(BadInput, match=r"b\.h5: worker tcp://\S+ sees another file under this path"):
            evaluate_archive(files, SETTINGS, ClusterWorkers(cluster.address, silent), cache)
    found = evaluate_archive(files, SETTINGS, LocalWorkers(1), cache)
    cache.close()
    assert [run.facts["sha256"] for run in found.runs] == [
        read_metadata(path)["content_sha256"] for path in runs[:2]
    ]


@pytest.mark.slow
def test_a_worker_that_joins_late_and_sees_no_archive(
    runs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It gets what another one leaves; that it does not find the file is no failure of the run."""
    mine, empty = tmp_path / "mine", tmp_path / "empty"
    mine.mkdir()
    empty.mkdir()
    for name, run in (("run", runs[0]), ("slow", runs[3])):
        shutil.copyfile(run, mine / f"{name}.h5")
    monkeypatch.chdir(mine)
    let_slow_wait(tmp_path, monkeypatch)
    with dask_cluster(tmp_path, 0) as cluster:
        first = cluster.start_worker({"PYTHONPATH": os.environ["PYTHONPATH"]}, folder=mine)

        def replace_worker(progress: ArchiveProgress) -> None:
            if progress.done != 1:
                return
            until((mine / "slow.h5.opened").exists)
            cluster.start_worker(folder=empty)
            until(lambda: cluster.workers_known() == 2)
            cluster.kill(first)

        with pytest.raises(BadInput, match=r"slow\.h5: worker tcp://\S+ sees no such file"):
            evaluate_archive(
                [HERE / "run.h5", HERE / "slow.h5"],
                SETTINGS,
                ClusterWorkers(cluster.address, silent),
                report=replace_worker,
            )


@pytest.mark.slow
def test_a_task_says_what_its_files_are(runs: list[Path]) -> None:
    """One that is gone also where it was asked for is a failure of the run, as on one machine."""
    file = File(str(runs[0]), 0, mark_of(str(runs[0])))
    (outcome,) = evaluate_batch([file], SETTINGS, software())
    assert outcome.run is not None
    runs[0].unlink()
    assert mark_of(str(runs[0])) == ""
    with pytest.raises(OtherFile, match=str(runs[0])):
        evaluate_batch([file], SETTINGS, software())
    (outcome,) = evaluate_batch([File(str(runs[0]), 0)], SETTINGS, software())
    assert "no such file" in outcome.problem


@pytest.mark.parametrize("name", ["distributed", "distributed.client", "asyncio", "tornado.application"])
def test_what_dask_logs_of_a_restart_is_not_shown(name: str) -> None:
    logger = logging.getLogger(name)
    before = logger.level
    with _quiet():
        assert not logger.isEnabledFor(logging.CRITICAL)
    assert logger.level == before


def test_no_scheduler(runs: list[Path]) -> None:
    with pytest.raises(BadInput, match="no scheduler answers there"):
        evaluate_archive(runs[:2], SETTINGS, ClusterWorkers("nonsense", silent))


@pytest.mark.long
def test_nobody_there(runs: list[Path], tmp_path: Path) -> None:
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(BadInput, match="no scheduler answers there"):
        evaluate_archive(runs[:2], SETTINGS, ClusterWorkers(address, silent))
    with dask_cluster(tmp_path, 0) as cluster:
        with pytest.raises(BadInput, match="no worker has joined the cluster"):
            evaluate_archive(runs[:2], SETTINGS, ClusterWorkers(cluster.address, silent, lost_s=1.0))
        worker = cluster.start_worker()

        def kill_all(progress: ArchiveProgress) -> None:
            if progress.done:
                cluster.kill(worker)

        with pytest.raises(DeviceFault, match="all workers are gone"):
            evaluate_archive(
                runs, SETTINGS, ClusterWorkers(cluster.address, silent, lost_s=20.0), report=kill_all
            )
