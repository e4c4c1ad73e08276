"""What searching and opening a run among thousands takes in the desk, beside the second that it may take.

The desk is the command itself, asked over its own port; what is measured is from the request to the last
byte; the first search counts from the page's own request on. The index is filled before, as it is from the
first look on; each desk is a fresh process.
"""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from urllib.parse import urlencode

from benchmarks.archive import SAMPLE
from benchmarks.common import PATIENCE_S, Benchmark, tell
from bufferstand.recording.content import Event, Segment, StreamContent
from bufferstand.recording.runfile.file import open_run, write_run

ALLOWED_S = 1.0
ORIGINALS = 50
"""Runs that are written; the others are further names of them, each in a folder of its own hundred."""
ROWS = 4000


def make_archive(folder: Path, runs: int) -> None:
    """Make a folder with so many run files."""
    sample = open_run(SAMPLE)
    left_out = ("datasets", "content_sha256")
    streams = {
        name: StreamContent(
            stream.time[:ROWS],
            {channel: values[:ROWS] for channel, values in stream.counts.items()},
            (Segment(0, 0, 0),),
        )
        for name, stream in sample.streams.items()
    }
    originals = []
    for number in range(min(ORIGINALS, runs)):
        metadata = {key: value for key, value in sample.metadata.items() if key not in left_out}
        metadata["run"] = {**metadata["run"], "id": f"run-{number:02d}"}
        metadata["specimen"] = {**metadata["specimen"], "id": f"S-{number % 20:02d}"}
        path = folder / "000" / f"run-{number:05d}.h5"
        path.parent.mkdir(parents=True, exist_ok=True)
        made = [Event(0.0, "made", "by benchmarks.desk_archive")]
        originals.append(write_run(path, metadata, streams, made, sample.anchors))
    for number in range(len(originals), runs):
        path = folder / f"{number // 100:03d}" / f"run-{number:05d}.h5"
        path.parent.mkdir(exist_ok=True)
        os.link(originals[number % len(originals)], path)


@contextmanager
def desk(folder: Path, environment: dict[str, str]) -> Iterator[http.client.HTTPConnection]:
    """While inside, a desk serves a folder; gives a connection to it."""
    command = [sys.executable, "-P", "-m", "bufferstand", "desk", str(folder), "--address", "127.0.0.1:0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        assert process.stderr is not None
        found = re.search(r"127\.0\.0\.1:(\d+)", process.stderr.readline())
        assert found is not None
        with closing(http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=PATIENCE_S)) as wire:
            yield wire
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE_S)


def asked_s(wire: http.client.HTTPConnection, page: str, **query: str) -> tuple[float, bytes]:
    """Ask for something; return how long that took [s], and the answer."""
    began_s = time.perf_counter()
    wire.request("GET", f"{page}?{urlencode(query)}")
    answer = wire.getresponse()
    content = answer.read()
    assert answer.status == 200, content[:400]
    return time.perf_counter() - began_s, content


def measure(folder: Path, *, runs: int, rounds: int) -> Sequence[float]:
    """Make the archive and measure."""
    archive = folder / "archive"
    make_archive(archive, runs)
    environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}
    command = [
        sys.executable,
        "-P",
        "-m",
        "bufferstand",
        "runs",
        str(archive),
        "--json",
        str(folder / "all.json"),
    ]
    time.sleep(2.5 if rounds > 1 else 0.0)  # a file that was written this moment is not indexed yet
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
    first, again, opened = [], [], []
    for number in range(rounds):
        with desk(archive, environment) as wire:
            page_s, _ = asked_s(wire, "/archive")
            first.append(page_s + asked_s(wire, "/archive/runs", words="s-07 harmonic")[0])
            where = 'specimen == "S-11" and frequency_Hz > 0.5'
            took_s, content = asked_s(wire, "/archive/runs", where=where, sort="path")
            again.append(took_s)
            path = json.loads(content)["rows"][number % 3]["path"] if runs > ORIGINALS else "000/run-00000.h5"
            opened.append(asked_s(wire, "/archive/run", path=path)[0])
    tell(
        f"{runs} runs: first search {max(first):.3f} s, search again {max(again):.3f} s, "
        f"a run opened {max(opened):.3f} s (the longest of {rounds} desks)"
    )
    return [max(took) / ALLOWED_S for took in (first, again, opened)]


BENCHMARK = Benchmark(
    {
        "first search of a fresh desk / 1 s": 1.0,
        "further search / 1 s": 1.0,
        "opening a run / 1 s": 1.0,
    },
    full=partial(measure, runs=10_000, rounds=3),
    smoke=partial(measure, runs=3, rounds=1),
)
