"""What five pages cost a campaign of an hour at 1 kHz, and whether anything of the live monitor grows.

``bufferstand run`` swings the simulated stand in real time; ``bufferstand monitor`` serves it to Chromium
pages that each show something else: the last half minute, five minutes, the whole campaign, other channels,
a phone. All have the figures per cycle. Processor time is that of the acquiring process alone, before the
pages are opened, while they are open, and after they are closed. Once a minute the memory of the page's
server is taken (PSS, which Linux shares out), and of each page what its JavaScript holds after garbage was
collected, with its nodes and listeners. "Lost" is what is missing in the sealed run file.
"""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.common import ROOT, SAMPLE_STAND, Benchmark, NotHere, processor_s, tell
from benchmarks.common.processes import shared_out_MB
from bufferstand.recording.runfile import open_run

FREQUENCY_HZ = 1.0
SETTLE_S = 600.0
"""Longest wait for the campaign to swing, and for the pages to be open [s]."""
CAMPAIGN = """
[campaign]
id = "hour"
title = "An hour at 1 kHz"
stand = "stand.toml"
specimen = "specimens/category-a-elastomer.toml"

[conditions]
ambient_C = 21.0

[limits]
force_max_kN = 600.0
frequency_max_Hz = 2.55
temperature_stop_C = 40.0
temperature_resume_C = 30.0
on_temperature_stop = "stop"

[[step]]
kind = "harmonic"
name = "an hour"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = {frequency_Hz}
cycles = {cycles}
"""
BROWSER = """
import json, os, sys
from playwright.sync_api import sync_playwright
OTHER = {"span": "whole", "force-channel": "position"}
VIEWS = [{}, {"span": "300"}, {"span": "whole"}, OTHER, {"phone": True}]
with sync_playwright() as driver:
    options = ["--no-sandbox"] if os.geteuid() == 0 else []
    browser = driver.chromium.launch(executable_path=sys.argv[3], args=options, timeout=0)
    pages = []
    for number in range(int(sys.argv[2])):
        view = VIEWS[number % len(VIEWS)]
        phone = {"viewport": {"width": 390, "height": 844}} if view.get("phone") else {}
        context = browser.new_context(**(phone or {"viewport": {"width": 1280, "height": 900}}))
        context.set_default_timeout(0)  # a busy machine takes its time
        page = context.new_page()
        page.goto(sys.argv[1])
        while not page.evaluate("Number(document.body.dataset.redraws) > 2"):
            page.wait_for_timeout(50)
        for name, value in view.items():
            if name != "phone":
                page.select_option("#" + name, value)
        wire = context.new_cdp_session(page)
        wire.send("Performance.enable")
        pages.append((page, wire))
    print("open", flush=True)
    while sys.stdin.readline():
        told = []
        for page, wire in pages:
            wire.send("HeapProfiler.collectGarbage")
            found = {one["name"]: one["value"] for one in wire.send("Performance.getMetrics")["metrics"]}
            found["redraws"] = int(page.evaluate("document.body.dataset.redraws"))
            found["cycles"] = int(page.evaluate("document.getElementById('cycle-rows').rows.length"))
            told.append(found)
        print(json.dumps(told), flush=True)
    browser.close()
"""


@dataclass
class Seen:
    """What was taken while the pages were open: one entry a look.

    Between the collection and the look a page makes garbage anew: the least of a quarter is what it keeps.
    """

    server_MB: list[float] = field(default_factory=list)
    page_MB: list[list[float]] = field(default_factory=list)
    nodes: list[int] = field(default_factory=list)
    listeners: list[int] = field(default_factory=list)
    redraws: int = 0

    @property
    def grown(self) -> tuple[float, float]:
        """Return the memory of the last quarter over that of the second: of the server, of the worst page."""
        pages = [list(one) for one in zip(*self.page_MB, strict=True)]
        return _grown(self.server_MB, median), max(_grown(one, min) for one in pages)


def _grown(looks: Sequence[float], of: Callable[[Sequence[float]], float]) -> float:
    quarter = max(1, len(looks) // 4)
    return of(looks[-quarter:]) / of(looks[quarter : 2 * quarter] or looks)


def words(*of_command: str) -> list[str]:
    """Return a command of bufferstand for a child process."""
    return [sys.executable, "-P", "-m", "bufferstand", *of_command]


@contextmanager
def campaign(folder: Path, seconds: float) -> Iterator[subprocess.Popen[bytes]]:
    """While inside, a campaign swings in real time, by a command of its own; it is complete afterwards."""
    for name in ("specimens", "models"):
        shutil.copytree(SAMPLE_STAND.parent / name, folder / name)
    stand = SAMPLE_STAND.read_text(encoding="utf-8")
    missing = "missed_cycles_per_h = 30.0"  # by the simulated controller: they count as gaps
    assert missing in stand
    stand = stand.replace(missing, "missed_cycles_per_h = 0.0")
    (folder / "stand.toml").write_text(stand, encoding="utf-8")
    cycles = int(seconds * FREQUENCY_HZ)
    file = folder / "hour.toml"
    file.write_text(CAMPAIGN.format(frequency_Hz=FREQUENCY_HZ, cycles=cycles), encoding="utf-8")
    command = words("run", str(file), "--out", str(folder / "out"), "--simulate")
    with (folder / "run.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log, cwd=ROOT)
    try:
        _until(lambda: _swings(folder / "out", process, folder / "run.log"))
        yield process
        subprocess.run(words("stop", str(folder / "out"), "--after", "cycle"), check=True, cwd=ROOT)
        process.wait(SETTLE_S)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            process.wait(SETTLE_S)


def _swings(out: Path, process: subprocess.Popen[bytes], log: Path) -> bool:
    """Return whether samples of the run are written."""
    if process.poll() is not None:
        raise RuntimeError(f"the campaign has ended: {log.read_text(encoding='utf-8')[-2000:]}")
    journals = list((out / "runs").glob("*.journal*")) if (out / "runs").is_dir() else []
    return any(one.stat().st_size > 200_000 for one in journals)


def _until(what: Callable[[], bool]) -> None:
    end_s = time.monotonic() + SETTLE_S
    while not what():
        if time.monotonic() > end_s:
            raise TimeoutError("the stand does not swing, or the pages are not open")
        time.sleep(0.2)


@contextmanager
def page_served(out: Path) -> Iterator[tuple[int, str]]:
    """While inside, ``bufferstand monitor`` serves the page; gives its process and link."""
    command = words("monitor", str(out), "--address", "127.0.0.1:0", "--view-only")
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        assert process.stderr is not None
        found = None
        while found is None and (line := process.stderr.readline()):
            found = re.search(r"http://\S+", line)
        if found is None:
            raise RuntimeError("the page is not served; what it said is above")
        yield process.pid, found[0]
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate()


@contextmanager
def pages_open(link: str, count: int) -> Iterator[Callable[[], list[dict[str, Any]]]]:
    """While inside, pages are open; gives what asks for the memory of each."""
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        raise NotHere("needs Chromium and playwright")
    command = [sys.executable, "-c", BROWSER, link, str(count), chromium]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None

        def look() -> list[dict[str, Any]]:
            process.stdin.write("look\n")  # type: ignore[union-attr]
            process.stdin.flush()  # type: ignore[union-attr]
            return list(json.loads(process.stdout.readline()))  # type: ignore[union-attr]

        try:
            if process.stdout.readline().strip() != "open":
                raise RuntimeError("the pages could not be opened; what they said is above")
            yield look
        finally:
            process.stdin.close()


def share_of(pid: int, seconds: float) -> float:
    """Return which share of a processor a process takes over so long."""
    before_s, wall_s = processor_s(pid), time.perf_counter()
    time.sleep(seconds)
    return (processor_s(pid) - before_s) / (time.perf_counter() - wall_s)


def measure(folder: Path, *, seconds: float, alone_s: float, look_s: float, pages: int) -> Sequence[float]:
    """Measure an acquisition alone, with pages open for so long, and alone again."""
    seen = Seen()
    with campaign(folder, 2.0 * alone_s + seconds + SETTLE_S) as run:
        before = share_of(run.pid, alone_s)
        with page_served(folder / "out") as (server, link), pages_open(link, pages) as look:
            shares, served_s = [], processor_s(server)
            began_s = time.monotonic()
            while time.monotonic() - began_s < seconds:
                shares.append(share_of(run.pid, look_s))
                found = look()
                seen.server_MB.append(shared_out_MB(server))
                seen.page_MB.append([one["JSHeapUsedSize"] / 2**20 for one in found])
                seen.nodes.append(max(int(one["Nodes"]) for one in found))
                seen.listeners.append(max(int(one["JSEventListeners"]) for one in found))
                seen.redraws = sum(one["redraws"] for one in found)
                said = " ".join(f"{one[-1]:.2f}" for one in zip(*seen.page_MB, strict=True))
                tell(
                    f"{time.monotonic() - began_s:6.0f} s: run {100 * shares[-1]:.1f} %, server "
                    f"{seen.server_MB[-1]:.1f} MB, pages {said} MB, {seen.nodes[-1]} nodes, "
                    f"{seen.listeners[-1]} listeners, {seen.redraws} redraws, {found[0]['cycles']} cycles"
                )
            served = (processor_s(server) - served_s) / (time.monotonic() - began_s)
        after = share_of(run.pid, alone_s)
    lost, samples = lost_of(folder / "out")
    alone, watched = (before + after) / 2.0, median(shares)
    tell(
        f"alone {100 * before:.1f} % and {100 * after:.1f} % of a processor, with {pages} pages "
        f"{100 * watched:.1f} %; the page's server takes {100 * served:.1f} %; {samples} samples, {lost} lost"
    )
    return watched - alone, lost / (samples + lost), *seen.grown


def lost_of(out: Path) -> tuple[int, int]:
    """Return how many samples are missing in the sealed run files, and how many are there.

    An interruption of unknown size counts as one.
    """
    runs = [open_run(path) for path in sorted((out / "runs").glob("*.h5"))]
    lost = sum(max(1, gap) for run in runs for _, gap in run.gaps("controller"))
    return lost, sum(run.streams["controller"].rows for run in runs)


BENCHMARK = Benchmark(
    {
        "growth of the acquisition's time by open pages, processor / wall": 0.1,
        "lost samples / all": 0.0,
        "the server's memory, last quarter / second quarter": 1.05,
        "what the worst page's scripts hold, last quarter / second quarter": 1.1,
    },
    full=partial(measure, seconds=3600.0, alone_s=60.0, look_s=60.0, pages=5),
    smoke=partial(measure, seconds=4.0, alone_s=1.0, look_s=1.0, pages=2),
)
