"""How much faster two Dask workers are than one, on loopback.

Scheduler and workers are processes of their own with one thread each. One and two workers take turns; the
best of each counts. The ratio of wall times needs two cores that nobody else uses. That of processor times is
the larger share of the two workers: evenly shared work would give 0.5, also on a busy machine. Both must give
the figures that one machine gives.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from benchmarks.archive import make_run
from benchmarks.common import Benchmark, processor_s, tell
from bufferstand.evaluation.archive.dask_cluster import ClusterWorkers
from bufferstand.evaluation.archive.evaluate import evaluate_archive
from bufferstand.evaluation.archive.local_workers import LocalWorkers
from bufferstand.evaluation.archive.settings_and_software import EvaluationSettings
from bufferstand.evaluation.archive.stored_run import RequestedParts
from bufferstand.evaluation.archive.tables import cycles_frame
from bufferstand.evaluation.facts.run_facts import Options
from tests.evaluation_archive.dask_cluster import dask_cluster


def seconds(files: list[Path], settings: EvaluationSettings, address: str) -> float:
    """Return how long a cluster takes [s]."""
    start = time.perf_counter()
    evaluate_archive(files, settings, ClusterWorkers(address, tell), wanted=RequestedParts(entries=False))
    return time.perf_counter() - start


def measure(folder: Path, *, runs: int, repeat: int) -> Sequence[float]:
    """Measure one worker and two, in turns."""
    files = [make_run(folder / "archive", number) for number in range(runs)]
    settings = EvaluationSettings(Options(draws=0))
    times: dict[int, list[float]] = {1: [], 2: []}
    shares: list[float] = []
    for name in ("one", "two"):
        (folder / name).mkdir()
    with dask_cluster(folder / "one", 1) as one, dask_cluster(folder / "two", 2) as two:
        for address in (one.address, two.address):  # imports and the file system's cache
            seconds(files[:20], settings, address)
        for _ in range(repeat):
            times[1].append(seconds(files, settings, one.address))
            before = [processor_s(worker.pid) for worker in two.workers]
            times[2].append(seconds(files, settings, two.address))
            shares = [processor_s(worker.pid) - b for worker, b in zip(two.workers, before, strict=True)]
        cluster = evaluate_archive(files[:20], settings, ClusterWorkers(two.address, tell))
    local = evaluate_archive(files[:20], settings, LocalWorkers(1))
    if not cycles_frame(cluster).equals(cycles_frame(local)):
        raise AssertionError("the cluster's figures are not those of one machine")
    for workers, taken in times.items():
        tell(f"{workers} worker(s): {', '.join(f'{one:.1f}' for one in taken)} s")
    tell(f"two workers took {shares[0]:.1f} and {shares[1]:.1f} s of a processor")
    return min(times[2]) / min(times[1]), max(shares) / sum(shares)


BENCHMARK = Benchmark(
    {
        "two workers / one, wall": 1.0 / 1.7,
        "larger share of two workers / both, processor": 1.0 / 1.7,
    },
    full=partial(measure, runs=400, repeat=3),
    smoke=partial(measure, runs=4, repeat=1),
)
