"""What a zoom into a run that is over takes on the live page's side, beside the 0.3 s that it may take.

The run is an hour at 1 kHz, written as a campaign's are; its spans are asked for as the page's server does.
The first look at all of it reads the whole file, to see that it is whole; a zoom reads what it shows, and of
a wide one nothing any more, once the cells of its channels are there. Of a
campaign that is under way the page's server keeps a history: that of twelve hours is asked for, too.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.archive import SAMPLE
from benchmarks.common import Benchmark, tell
from bufferstand.daq.monitor.past import History, RunSpans
from bufferstand.recording.content import Anchor, Segment, StreamContent
from bufferstand.recording.runfile import open_run, write_run

ALLOWED_S = 0.3
RATE_HZ = 1000
CHANNELS = ("stroke", "force")
SEED = 20
BLOCK_ROWS = 50_000


def make_run(folder: Path, seconds: int) -> Path:
    """Make a campaign's folder with one run: the sample's readings over and over, with noise of counts."""
    sample, generator = open_run(SAMPLE), np.random.default_rng(SEED)
    metadata = {k: v for k, v in sample.metadata.items() if k not in ("datasets", "content_sha256")}
    streams = {}
    for name, stream in sample.streams.items():
        rate_Hz = RATE_HZ if name == "controller" else 1
        rows = seconds * rate_Hz
        time_us = int(stream.first_stamp) + np.arange(rows, dtype=np.int64) * (1_000_000 // rate_Hz)
        noise = generator.integers(-3, 4, rows)
        counts = {
            channel: (np.resize(values, rows) + noise).astype(values.dtype)
            for channel, values in stream.counts.items()
        }
        streams[name] = StreamContent(time_us, counts, (Segment(0, 0, 0),))
    first = sample.anchors[0]
    anchors = [
        Anchor(first.device_us + 10_000_000 * n, first.host_s + 10.0 * n, first.utc)
        for n in range(max(2, seconds // 10))
    ]
    (folder / "runs").mkdir()
    return write_run(folder / "runs" / "001-long.h5", metadata, streams, (), anchors)


def took_s(ask: Callable[[], object]) -> float:
    """Return how long it takes to ask, and to write the answer as the page gets it [s]."""
    began_s = time.perf_counter()
    json.dumps(ask())
    return time.perf_counter() - began_s


def worst_history_s(hours: float) -> float:
    """Fill a history of so many hours; return how long the slowest of its spans takes [s]."""
    history = History()
    history.name([{"name": name, "unit": ""} for name in CHANNELS])
    wave = np.sin(np.arange(BLOCK_ROWS) * 0.002 * math.pi)
    for block in range(math.ceil(hours * 3600 * RATE_HZ / BLOCK_ROWS)):
        time_s = (block * BLOCK_ROWS + np.arange(BLOCK_ROWS)) / RATE_HZ
        history.take(time_s, dict.fromkeys(CHANNELS, wave))
    end_s = 3600.0 * hours
    spans = [(end_s * (1.0 - share), end_s) for share in (1.0, 0.5, 0.1, 0.01, 0.001)]
    return max(took_s(partial(history.span, *span, CHANNELS)) for span in spans)


def measure(folder: Path, *, seconds: int, hours: float) -> Sequence[float]:
    """Return the ratios of :data:`BENCHMARK`."""
    file = str(make_run(folder, seconds).relative_to(folder))
    spans = RunSpans(folder)
    whole_s = took_s(lambda: spans.span(file, -math.inf, math.inf, CHANNELS))
    tell(f"{seconds} s at {RATE_HZ} Hz: the first look at all of it takes {whole_s:.3f} s")
    zooms = []
    for part in (60, 5, 2):  # of an hour: a minute, 12 minutes, half an hour
        length_s, times = seconds / part, []
        for place in (0.1, 0.3, 0.45):
            first_s = place * seconds
            times.append(took_s(partial(spans.span, file, first_s, first_s + length_s, CHANNELS)))
        zooms.append(max(times))
        tell(f"a zoom to {length_s:.0f} s: at most {max(times):.3f} s")
    history_s = worst_history_s(hours)
    tell(f"a span of {hours:g} h of history: at most {history_s:.4f} s")
    return [zooms[0] / whole_s, *(one / ALLOWED_S for one in [*zooms, history_s])]


BENCHMARK = Benchmark(
    goals={
        "zoom to a minute / first look at the hour": 0.1,
        "zoom to a minute / 0.3 s": 0.3,
        "zoom to 12 minutes / 0.3 s": 0.5,
        "zoom to half an hour / 0.3 s": 0.3,
        "span of 12 hours' history / 0.3 s": 0.1,
    },
    full=partial(measure, seconds=3600, hours=12.0),
    smoke=partial(measure, seconds=60, hours=0.1),
)
