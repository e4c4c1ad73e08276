"""What evaluating an archive costs beside bare h5py, and what doing it a second time costs.

Makes runs of 500 kB of a recorded one (same channels, other noise), and lets bare h5py open each and read
every dataset, in as many processes as the evaluation then has. Both start fresh processes. The first
evaluation keeps its results, the second one finds them. No Monte Carlo.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.common import ROOT, Benchmark, cost, tell
from bufferstand.recording.content import Event, Segment, StreamContent
from bufferstand.recording.runfile.file import open_run, write_run
from bufferstand.recording.runfile.run import Run

SAMPLE = ROOT / "sample_runs/runs/013-harmonic-78mm-15mm-0.849Hz.h5"
SHARE = 0.76
"""Of the sample, so that a run file has 500 kB."""
BARE = str(ROOT / "benchmarks/common/bare_h5py.py")


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
    path.parent.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(number)
    left_out = ("datasets", "content_sha256")
    metadata = {key: value for key, value in run.metadata.items() if key not in left_out}
    metadata["run"] = {**metadata["run"], "id": path.stem}
    metadata["specimen"] = {**metadata["specimen"], "id": f"S-{number % 20:02d}"}
    streams = {name: stream_of(run, name, random) for name in run.streams}
    return write_run(path, metadata, streams, [Event(0.0, "made", "by benchmarks.archive")], run.anchors)


def measure(folder: Path, *, runs: int, jobs: int, settle_s: float) -> Sequence[float]:
    """Make the archive and measure."""
    archive = folder / "archive"
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        made = list(pool.map(make_run, [archive] * runs, range(runs), chunksize=10))
    tell(f"{runs} runs of {sum(path.stat().st_size for path in made) / runs / 1e3:.0f} kB")
    time.sleep(settle_s)  # what has just changed is not trusted to be settled
    evaluate = ("-m", "bufferstand", "evaluate", "--draws", "0", "--jobs", str(jobs))
    kept = (*evaluate, str(archive), "--cache", str(folder / "cache"), "--table", str(folder / "cycles.csv"))
    read = (BARE, str(archive), str(jobs))
    cost(*read)  # both sides once before: files and compiled libraries are at hand then
    cost(*evaluate, str(made[0].parent), "--no-cache")
    reading, first, second = cost(*read), cost(*kept), cost(*kept)
    for name, taken in (("bare h5py", reading), ("first", first), ("second", second)):
        tell(f"{name:9} {taken}, largest process {taken.peak_MB:.0f} MB")
    return (
        first.wall_s / reading.wall_s,
        first.cpu_s / reading.cpu_s,
        second.wall_s / first.wall_s,
        first.peak_MB / 500.0,
    )


BENCHMARK = Benchmark(
    {
        "first evaluation / bare h5py, wall": 1.5,
        "first evaluation / bare h5py, processor": 1.5,
        "second evaluation / first, wall": 0.05,
        "largest process / 500 MB": 1.0,
    },
    full=partial(measure, runs=2000, jobs=2, settle_s=3.0),
    smoke=partial(measure, runs=2, jobs=1, settle_s=0.0),
)
