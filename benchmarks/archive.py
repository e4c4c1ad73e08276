"""What evaluating an archive costs beside bare h5py, and what doing it a second time costs.

    .venv/bin/python -m benchmarks.archive [--runs 2000] [--jobs 2] [--folder DIR] [--draws 0]

Makes runs of 500 kB of a recorded one (same channels, other noise), and lets bare h5py open each and read
every dataset, in as many processes as the evaluation then has. Both start fresh processes. The first
evaluation keeps its results, the second one finds them. Only ratios of one session mean anything: wall time,
and processor time of all processes.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from bufferstand.recording.content import Event, Segment, StreamContent
from bufferstand.recording.runfile.file import open_run, write_run
from bufferstand.recording.runfile.run import Run

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "sample_runs/runs/013-harmonic-78mm-15mm-0.849Hz.h5"
SHARE = 0.76
"""Of the sample, so that a run file has 500 kB."""


def stream_of(run: Run, name: str, random: np.random.Generator) -> StreamContent:
    """Return the beginning of a stream of the sample, its raw numbers with one more digit of noise."""
    stream = run.streams[name]
    rows = int(SHARE * stream.rows)
    counts = {
        channel: values[:rows] + random.integers(-1, 2, rows).astype(values.dtype)
        if channel != "command" and name == "controller"
        else values[:rows]
        for channel, values in stream.counts.items()
    }
    return StreamContent(stream.time[:rows], counts, (Segment(0, 0, 0),))


def make_run(folder: Path, number: int) -> Path:
    """Write one run."""
    run = open_run(SAMPLE)
    path = folder / f"{number // 100:03d}" / f"run-{number:05d}.h5"
    if path.exists():
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(number)
    left_out = ("datasets", "content_sha256")
    metadata = {key: value for key, value in run.metadata.items() if key not in left_out}
    metadata["run"] = {**metadata["run"], "id": path.stem}
    metadata["specimen"] = {**metadata["specimen"], "id": f"S-{number % 20:02d}"}
    streams = {name: stream_of(run, name, random) for name in run.streams}
    return write_run(path, metadata, streams, [Event(0.0, "made", "by benchmarks.archive")], run.anchors)


def read_bare(paths: Sequence[str]) -> int:
    """Open files with h5py and read every dataset; return how many bytes they are in memory."""
    size = 0

    def visit(_: str, item: object) -> None:
        nonlocal size
        if isinstance(item, h5py.Dataset):
            size += item[()].nbytes

    for path in paths:
        with h5py.File(path, "r") as tree:
            tree.visititems(visit)
    return size


def bare(folder: str, jobs: int) -> None:
    """Read all runs of a folder in so many processes (the other side of the comparison)."""
    paths = [str(path) for path in sorted(Path(folder).rglob("*.h5"))]
    parts = [paths[first : first + 25] for first in range(0, len(paths), 25)]
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        sum(pool.map(read_bare, parts))


@dataclass(frozen=True)
class Cost:
    """What a command took: wall and processor time [s], and the largest memory of any process so far [MB]."""

    wall_s: float
    cpu_s: float
    peak_MB: float

    def over(self, other: Cost) -> str:
        """Return the ratio to another one in words."""
        return f"{self.wall_s / other.wall_s:.3f} x wall, {self.cpu_s / other.cpu_s:.3f} x processor time"

    def __str__(self) -> str:
        return f"{self.wall_s:7.1f} s wall {self.cpu_s:7.1f} s processor"


def cost(command: Sequence[str]) -> Cost:
    """Run a command and return what it and its children took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # or every process compiles its libraries anew
    subprocess.run(
        [sys.executable, *command], check=True, env=environment, stdout=subprocess.DEVNULL, cwd=ROOT
    )
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Cost(wall, cpu, after.ru_maxrss / 1024.0)


def measure(folder: Path, runs: int, jobs: int, draws: int) -> None:
    """Make the archive, measure and print."""
    archive = folder / "archive"
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        made = list(pool.map(make_run, [archive] * runs, range(runs), chunksize=10))
    size = sum(path.stat().st_size for path in made)
    print(f"{runs} runs of {size / runs / 1e3:.0f} kB, {jobs} processes, {draws} draws")
    time.sleep(3.0)  # what has just changed is not trusted to be settled
    evaluate = ["-m", "bufferstand", "evaluate", str(archive), "--draws", str(draws), "--jobs", str(jobs)]
    kept = ["--cache", str(folder / "cache"), "--table", str(folder / "cycles.csv")]
    for path in (folder / "cache").glob("*"):
        path.unlink()
    read = ["-c", f"from benchmarks.archive import bare; bare({str(archive)!r}, {jobs})"]
    few = str(made[0].parent)
    cost(read)  # both sides once before: files and compiled libraries are at hand then
    cost(["-m", "bufferstand", "evaluate", few, "--draws", str(draws), "--jobs", str(jobs), "--no-cache"])
    reading = cost(read)
    first = cost([*evaluate, *kept])
    second = cost([*evaluate, *kept])
    print(f"bare h5py            {reading}")
    print(f"first evaluation     {first} = {first.over(reading)} of bare h5py (at most 3)")
    print(f"second evaluation    {second} = {second.over(first)} of the first one (at most 0.05)")
    print(f"largest process      {first.peak_MB:7.0f} MB (at most 500)")


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--draws", type=int, default=0)
    parser.add_argument("--folder", type=Path, help="where the archive is made, and found again")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        measure(chosen.folder or Path(temporary), chosen.runs, chosen.jobs, chosen.draws)


if __name__ == "__main__":
    main()
