"""How long the report of a campaign of 60 steps takes, and what of it is what: wall and processor time.

    .venv/bin/python -m benchmarks.report [--steps 60]

The campaign is made of the recorded runs in ``sample_runs/runs`` (a static run of two minutes, harmonic ones
of 10 s to 100 s, a thousand samples a second), each written again under another id and a later start until
there are enough. First ``bufferstand report`` as a user runs it, in a process of its own, on all cores, and
once more with an evaluation that exists already; then the stages in this process, one after the other. To be
met: under 20 s on an otherwise idle machine.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path

from bufferstand.evaluation.archive.comparison import load_evaluation
from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.reading import read_source
from bufferstand.recording.content import StreamContent
from bufferstand.recording.runfile.file import open_run, write_run

SAMPLES = Path(__file__).parents[1] / "sample_runs" / "runs"
PAUSE_S = 20.0
LIMIT_S = 20.0


def make_campaign(folder: Path, steps: int) -> float:
    """Write a campaign of so many steps; return how long it would have taken on the stand [s]."""
    (folder / "runs").mkdir(parents=True)
    sources = sorted(SAMPLES.glob("*.h5"))
    starts = datetime.fromisoformat("2026-03-05T08:00:00+00:00")
    at = starts
    for number in range(1, steps + 1):
        at = _write_again(sources[(number - 1) % len(sources)], folder / "runs", number, at)
    return (at - starts).total_seconds()


def _write_again(source: Path, folder: Path, number: int, started: datetime) -> datetime:
    run = open_run(source)
    metadata = json.loads(json.dumps(dict(run.metadata)))
    facts = metadata["run"]
    lasted = datetime.fromisoformat(facts["ended_utc"]) - datetime.fromisoformat(facts["started_utc"])
    ended = started + lasted
    facts |= {
        "id": f"{number:03d}-{run.id[4:]}",
        "started_utc": started.isoformat(),
        "ended_utc": ended.isoformat(),
        "step_index": number,
    }
    streams = {
        name: StreamContent(stream.time, dict(stream.counts), stream.segments)
        for name, stream in run.streams.items()
    }
    write_run(folder / f"{facts['id']}.h5", metadata, streams, anchors=run.anchors)
    return ended + timedelta(seconds=PAUSE_S)


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Print wall and processor time of what is done inside."""
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    spent = time.perf_counter() - wall, time.process_time() - cpu
    print(f"  {what:<34} {spent[0]:6.2f} s wall   {spent[1]:6.2f} s CPU", flush=True)


def as_a_user(folder: Path, out: Path, *further: str) -> None:
    """Run the command and print what it took, its children included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    wall = time.perf_counter()
    command = [sys.executable, "-P", "-m", "bufferstand", "report", str(folder), "--out", str(out), *further]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - wall
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    words = "bufferstand report" + (" --evaluation" if further else "")
    print(
        f"  {words:<34} {wall:6.2f} s wall   {cpu:6.2f} s CPU   (limit {LIMIT_S:g} s wall, idle machine)",
        flush=True,
    )


def stages(folder: Path, evaluation: Path) -> None:
    """Print what reading, content, figures, HTML and PDF take, in this process."""
    with timed("read runs, join the evaluation"):
        source = read_source(folder, load_evaluation(evaluation))
    with timed("content"):
        content = build_content(source)
    with timed(f"draw {len(content.pictures())} figures"):
        figures = [draw(picture.plot) for picture in content.pictures()]
    with timed("HTML"):
        html = render_html(content, figures)
    with timed("PDF"):
        pdf = render_pdf(content, figures)
    print(f"  HTML {len(html.encode()) / 1e6:.1f} MB, PDF {len(pdf) / 1e6:.1f} MB")


def main() -> None:
    """Make the campaign, measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--steps", type=int, default=60)
    steps = parser.parse_args().steps
    with tempfile.TemporaryDirectory(prefix="bufferstand-report-") as name:
        folder, out = Path(name) / "campaign", Path(name) / "out"
        lasted = make_campaign(folder, steps)
        print(f"{steps} steps, {lasted / 60.0:.0f} min on the stand, {os.cpu_count()} cores")
        as_a_user(folder, out)
        evaluation = Path(name) / "evaluation.json"
        command = [
            sys.executable,
            "-P",
            "-m",
            "bufferstand",
            "evaluate",
            str(folder),
            "--no-cache",
            "--json",
            str(evaluation),
        ]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        as_a_user(folder, out, "--evaluation", str(evaluation))
        stages(folder, evaluation)


if __name__ == "__main__":
    main()
