"""How much faster two Dask workers are than one, on loopback.

    .venv/bin/python -m benchmarks.archive_cluster [--runs 400] [--folder DIR] [--repeat 3]

Scheduler and workers are processes of their own with one thread each. One and two workers take turns; the
best of each counts. The ratio needs two cores that nobody else uses: the load of the machine is printed with
it. By processor time it is what evenly shared work would give; that can be seen on a busy machine too.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path

from benchmarks.archive import make_run
from bufferstand.evaluation.archive.dask_cluster import ClusterWorkers
from bufferstand.evaluation.archive.evaluate import evaluate_archive
from bufferstand.evaluation.archive.local_workers import LocalWorkers
from bufferstand.evaluation.archive.settings_and_software import EvaluationSettings
from bufferstand.evaluation.archive.stored_run import RequestedParts
from bufferstand.evaluation.archive.tables import cycles_frame
from bufferstand.evaluation.facts.run_facts import Options
from tests.evaluation_archive.dask_cluster import DaskCluster, dask_cluster


def seconds(files: list[Path], settings: EvaluationSettings, address: str) -> float:
    """Return how long a cluster takes [s]."""
    start = time.perf_counter()
    evaluate_archive(files, settings, ClusterWorkers(address, print), wanted=RequestedParts(entries=False))
    return time.perf_counter() - start


def processor_seconds(cluster: DaskCluster) -> list[float]:
    """Return the processor time of each worker so far [s]."""
    found = []
    for worker in cluster.workers:
        facts = Path(f"/proc/{worker.pid}/stat").read_text().rpartition(")")[2].split()
        found.append((int(facts[11]) + int(facts[12])) / os.sysconf("SC_CLK_TCK"))
    return found


def measure(folder: Path, runs: int, repeat: int) -> None:
    """Measure one worker and two, in turns, and print."""
    files = [make_run(folder / "archive", number) for number in range(runs)]
    settings = EvaluationSettings(Options(draws=0))
    times: dict[int, list[float]] = {1: [], 2: []}
    shares: list[float] = []
    for name in ("one", "two"):
        (folder / name).mkdir(exist_ok=True)
    with dask_cluster(folder / "one", 1) as one, dask_cluster(folder / "two", 2) as two:
        for address in (one.address, two.address):  # imports and the file system's cache
            seconds(files[:20], settings, address)
        for _ in range(repeat):
            times[1].append(seconds(files, settings, one.address))
            before = processor_seconds(two)
            times[2].append(seconds(files, settings, two.address))
            shares = [b - a for a, b in zip(before, processor_seconds(two), strict=True)]
        cluster = evaluate_archive(files[:20], settings, ClusterWorkers(two.address, print))
    same = cycles_frame(cluster).equals(cycles_frame(evaluate_archive(files[:20], settings, LocalWorkers(1))))
    load = os.getloadavg()[0]
    print(f"{runs} runs; load of the machine {load:.1f} on {os.cpu_count()} cores; same figures: {same}")
    for workers, taken in times.items():
        print(f"{workers} worker(s)   {min(taken):7.1f} s   (all: {', '.join(f'{t:.1f}' for t in taken)})")
    print(f"scaling       {min(times[1]) / min(times[2]):7.2f} x (at least 1.7)")
    share = sum(shares) / max(shares)
    print(f"by processor  {share:7.2f} x: two workers took {shares[0]:.1f} and {shares[1]:.1f} s")


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--folder", type=Path, help="where the archive is made, and found again")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        measure(chosen.folder or Path(temporary), chosen.runs, chosen.repeat)


if __name__ == "__main__":
    main()
