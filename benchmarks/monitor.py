"""What the live monitor costs the acquisition: with and without five open pages, in the same run.

The simulated stand swings in a process of its own, sampled at 1 kHz. This process acquires, guards and
records as a campaign does: in turns alone, and with the publisher, the web process and open pages (Chromium
where it is installed, else WebSocket clients that read as pages do). Processor time is this process's own, of
all its threads; the rest of the machine does not count in it. Samples are counted by the device's sequence
numbers: a lost one would be a gap.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

from benchmarks.common import PATIENCE_S, SAMPLE_STAND, Benchmark, processor_s, record, tell, wide_guards
from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.guards.panel import GuardPanel
from bufferstand.daq.monitor.access import Tokens
from bufferstand.daq.monitor.process import Address, web_process
from bufferstand.daq.monitor.publisher import Publisher, publishing
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.motions import Harmonic, RampTo

TOKENS = Tokens(view="benchmark", control="", free_view=True)
CLIENT = """
import sys, time
from threading import Thread
from websockets.sync.client import connect
def read():
    address = sys.argv[1].replace("http", "ws") + "/live"
    with connect(address, origin=sys.argv[1], max_size=1 << 24, proxy=None) as wire:
        while True:
            wire.recv()
for _ in range(int(sys.argv[2])):
    Thread(target=read, daemon=True).start()
print("open", flush=True)
sys.stdin.read()
"""
BROWSER = """
import os, sys
from playwright.sync_api import sync_playwright
with sync_playwright() as driver:
    options = ["--no-sandbox"] if os.geteuid() == 0 else []
    browser = driver.chromium.launch(executable_path=sys.argv[3], args=options, timeout=0)
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    context.set_default_timeout(0)  # a busy machine takes its time
    pages = [context.new_page() for _ in range(int(sys.argv[2]))]
    for page in pages:
        page.goto(sys.argv[1] + "/")
        while not page.evaluate("Number(document.body.dataset.redraws) > 2"):
            page.wait_for_timeout(50)
    print("open", flush=True)
    while not os.read(0, 1):
        break
    print(sum(int(page.evaluate("document.body.dataset.redraws")) for page in pages), flush=True)
    browser.close()
"""


@dataclass
class Turn:
    """What a stretch cost."""

    share: float
    samples: int
    lost: int
    late_s: float


class Bench:
    """The acquisition of a campaign on a moving stand."""

    def __init__(self, acquisition: Acquisition) -> None:
        self._acquisition = acquisition

    def turn(self, seconds: float, publisher: Publisher | None = None) -> Turn:
        """Acquire for so long, with a publisher or without; return the processor time over the wall's."""
        acquisition = self._acquisition
        acquisition.observers[:] = [] if publisher is None else [publisher.take]
        before = acquisition.latest
        wall_s, processor_s, late_s = time.perf_counter(), time.process_time(), 0.0
        while time.perf_counter() - wall_s < seconds:
            began_s = time.perf_counter()
            acquisition.tick()
            if publisher is not None:
                publisher.look(acquisition)
            late_s = max(late_s, time.perf_counter() - began_s)
            acquisition.rest()
        processor_s, wall_s = time.process_time() - processor_s, time.perf_counter() - wall_s
        after = acquisition.latest
        return Turn(processor_s / wall_s, after.samples - before.samples, after.lost - before.lost, late_s)


@contextmanager
def acquiring(folder: Path) -> Iterator[Bench]:
    """While inside, a stand swings at 1 kHz, and this process can acquire and record it."""
    stand = load_stand(SAMPLE_STAND)
    with start_process(SAMPLE_STAND, directory=folder / "stand", speed=1.0) as process:
        clock = WallClock()
        controller = build_controller(with_endpoints(stand, process.served.endpoints()), clock)
        controller.connect()
        guards = wide_guards("stroke", controller.facts.rate_Hz)
        acquisition = Acquisition(Stand(controller, ()), clock, GuardPanel(guards, wall_s=clock.wall_s()))
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=200.0, watchdog_ms=int(1e3 * PATIENCE_S))
        controller.start(RampTo(target_mm=30.0, speed_mm_per_s=40.0))
        _wait(acquisition, 2.0)
        controller.start(Harmonic(mean_mm=30.0, amplitude_mm=15.0, frequency_Hz=1.0, cycles=5000))
        _wait(acquisition, 2.0)
        recorder = record(acquisition.stand, folder)
        acquisition.attach(recorder)
        yield Bench(acquisition)
        recorder.close("complete")
        controller.close()


def _wait(acquisition: Acquisition, seconds: float) -> None:
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        acquisition.tick()
        acquisition.rest()


@contextmanager
def pages_open(url: str, count: int, bench: Bench, publisher: Publisher) -> Iterator[str]:
    """While inside, pages are open; gives what they are."""
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    program, kind = (BROWSER, "Chromium pages") if chromium else (CLIENT, "WebSocket clients")
    process = subprocess.Popen(
        [sys.executable, "-c", program, url, str(count), chromium or ""],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert process.stdout is not None
        os.set_blocking(process.stdout.fileno(), False)
        while process.poll() is None and not process.stdout.read():  # meanwhile the stand wants its reader
            bench.turn(0.2, publisher)
        if process.poll() is not None:
            raise RuntimeError(f"no {kind} could be opened; what they said is above")
        os.set_blocking(process.stdout.fileno(), True)
        yield kind
    finally:
        process.communicate(b"x")


def measure(folder: Path, *, seconds: float, turns: int, pages: int) -> Sequence[float]:
    """Measure alone and with open pages, in turns."""
    alone: list[Turn] = []
    watched: list[Turn] = []
    shown: list[float] = []
    with acquiring(folder) as bench:
        for _ in range(turns):
            alone.append(bench.turn(seconds))
            with publishing(folder, tell) as publisher:
                links: list[str] = []
                with web_process(folder, Address(port=0), links.append, TOKENS) as web:
                    url = links[0].split(": ", 1)[1].rstrip("/")
                    with pages_open(url, pages, bench, publisher) as kind:
                        before_s = processor_s(web.pid)
                        watched.append(bench.turn(seconds, publisher))
                        shown.append((processor_s(web.pid) - before_s) / seconds)
    for name, parts in (("alone", alone), (f"with {pages} {kind}", watched)):
        shares = ", ".join(f"{100.0 * part.share:.1f}" for part in parts)
        tell(
            f"{name}: {shares} % of a processor; {sum(part.samples for part in parts)} samples; "
            f"longest pass {1000.0 * max(part.late_s for part in parts):.0f} ms"
        )
    lost, samples = (sum(getattr(part, what) for part in (*alone, *watched)) for what in ("lost", "samples"))
    grown = median(part.share for part in watched) - median(part.share for part in alone)
    tell(f"the web process takes {100.0 * median(shown):.1f} % of a processor")
    return grown, lost / (samples + lost)


BENCHMARK = Benchmark(
    {
        "growth of the acquisition's time by open pages, processor / wall": 0.1,
        "lost samples / all": 0.0,
    },
    full=partial(measure, seconds=8.0, turns=3, pages=5),
    smoke=partial(measure, seconds=0.5, turns=1, pages=1),
)
