"""How long the report of a campaign of 60 steps takes, and what of it is what: wall and processor time.

The campaign is made of the recorded runs in ``sample_runs/runs`` (a static run of two minutes, harmonic ones
of 10 s to 100 s, a thousand samples a second), each written again under another id, with a later start and
the last digit of each sample read anew, until there are enough. First ``bufferstand report`` as a user runs
it, in a process of its own, on all cores; then the stages in this process, one after the other. The reference
is bare matplotlib in this process that draws as many figures, of three curves of 1500 points each. The goal
is 20 s on two free cores where the sixteen figures of this report, drawn so, take a second of a processor.
"""

from __future__ import annotations

import io
import json
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.common import ROOT, Benchmark, best, cost, tell
from bufferstand.evaluation.archive.comparison import load_evaluation
from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.reading import read_source
from bufferstand.recording.content import StreamContent
from bufferstand.recording.runfile.file import open_run, write_run

SAMPLES = ROOT / "sample_runs" / "runs"
PAUSE_S = 20.0


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
    random = np.random.default_rng(number)
    streams = {
        name: StreamContent(
            stream.time,
            {channel: _read_again(counts, random) for channel, counts in stream.counts.items()},
            stream.segments,
        )
        for name, stream in run.streams.items()
    }
    write_run(folder / f"{facts['id']}.h5", metadata, streams, anchors=run.anchors)
    return ended + timedelta(seconds=PAUSE_S)


def _read_again(counts: NDArray[Any], random: np.random.Generator) -> NDArray[Any]:
    """Return counts with the last digit read anew: a copy of samples would be left out of the report."""
    if not np.issubdtype(counts.dtype, np.integer):
        return counts
    again: NDArray[Any] = counts + random.integers(-1, 2, counts.size).astype(counts.dtype)
    return again


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Tell wall and processor time of what is done inside."""
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    spent = time.perf_counter() - wall, time.process_time() - cpu
    tell(f"{what}: {spent[0]:.2f} s wall, {spent[1]:.2f} s processor")


def stages(folder: Path, evaluation: Path, steps: int) -> int:
    """Tell what reading, content, figures, HTML and PDF take; return the number of figures."""
    with timed("read runs, join the evaluation"):
        source = read_source(folder, load_evaluation(evaluation))
    if len(source.runs) != steps:
        raise RuntimeError(f"the report is of {len(source.runs)} runs, not of {steps}")
    with timed("content"):
        content = build_content(source)
    with timed(f"draw {len(content.pictures())} figures"):
        figures = [draw(picture.plot) for picture in content.pictures()]
    with timed("HTML"):
        html = render_html(content, figures)
    with timed("PDF"):
        pdf = render_pdf(content, figures)
    tell(f"HTML {len(html.encode()) / 1e6:.1f} MB, PDF {len(pdf) / 1e6:.1f} MB")
    return len(figures)


def plain_figures(count: int) -> None:
    """Draw figures as one does it in an afternoon: three curves each, as SVG."""
    angle = np.linspace(0.0, 2.0 * np.pi, 1500)
    for _ in range(count):
        figure = Figure(figsize=(6.3, 3.5))
        axes = figure.subplots()
        for size in (1.0, 2.0, 3.0):
            axes.plot(size * np.cos(angle), size * np.sin(angle), label=f"{size:g}")
        axes.legend()
        figure.savefig(io.BytesIO(), format="svg")


def measure(folder: Path, *, steps: int, rounds: int) -> Sequence[float]:
    """Make the campaign and measure."""
    campaign, evaluation = folder / "campaign", folder / "evaluation.json"
    tell(f"{make_campaign(campaign, steps) / 60.0:.0f} min on the stand")
    command = ("-m", "bufferstand", "report", str(campaign), "--out", str(folder / "out"))
    whole = cost(*command)
    tell(f"bufferstand report {whole}")
    cost("-m", "bufferstand", "evaluate", str(campaign), "--no-cache", "--json", str(evaluation))
    figures = stages(campaign, evaluation, steps)
    (plain,) = best([lambda: plain_figures(figures)], rounds)
    tell(f"{figures} plain figures: {plain:.2f} s processor")
    return [whole.cpu_s / plain]


BENCHMARK = Benchmark(
    {"report / as many plain figures, processor": 40.0},
    full=partial(measure, steps=60, rounds=3),
    smoke=partial(measure, steps=1, rounds=1),
)
