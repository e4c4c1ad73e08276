"""A peer's process: its options, its stand file, its own log and its own truth."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

CHANNELS = ("force", "stroke_1", "stroke_2", "position", "command")
STROKE_TYPE = {"c": "<u2", "go": "<i2"}  # each has counts of its own
FORCE_kN = {"c": "1e-4", "go": "5e-5"}  # a count
STROKE_mm = {"c": "[-40.0, 0.005]", "go": "[-20.0, 0.01]"}


@dataclass(frozen=True)
class Case:
    """One peer with its options; `line` puts it behind a serial line."""

    peer: str
    options: tuple[str, ...] = ()
    line: bool = False
    rate_Hz: float = 1000.0
    timeout_s: float = 0.5

    def __str__(self) -> str:
        words = " ".join(self.options).replace("--", "")
        return f"{self.peer}{' RTU' if self.line else ''} {words}".strip()


@dataclass
class Running:
    """A controller that runs, and where it writes what it did."""

    case: Case
    folder: Path
    process: subprocess.Popen[str]
    stand: Path = field(init=False)

    def events(self) -> list[dict[str, Any]]:
        """Give what it has logged so far."""
        text = (self.folder / "log.jsonl").read_text()
        return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]

    def wait_for(
        self,
        what: Callable[[dict[str, Any]], bool],
        after: int = 0,
        meanwhile: subprocess.Popen[Any] | None = None,
        timeout_s: float = 60.0,
    ) -> int:
        """Wait until an event is logged; give its place in the log. What runs meanwhile must not end."""
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            for place, event in enumerate(self.events()):
                if place >= after and what(event):
                    return place
            assert self.process.poll() is None, "the controller has died"
            assert meanwhile is None or meanwhile.poll() is None, "the campaign ended before that"
            time.sleep(0.05)
        raise AssertionError(f"not seen within {timeout_s} s in {self.events()[-5:]}")

    def boot(self) -> None:
        """Have it boot anew, as after a power cut of the controller alone."""
        self.process.send_signal(signal.SIGUSR1)

    def truth(self) -> NDArray[np.void]:
        """Give every sample that it has made (all of them once it has ended)."""
        stroke = STROKE_TYPE[self.case.peer]
        kinds = [("sequence", "<u4"), ("tick_us", "<u4"), ("force", "<i4"), ("stroke_1", stroke)]
        kinds += [("stroke_2", stroke), ("position", "<i2"), ("command", "<i2")]
        kinds += [("true_force_kN", "<f4"), ("true_stroke_mm", "<f4")]
        kinds += [("state", "<u2"), ("status_word", "<u2"), ("boot", "<u2"), ("missed", "<u2")]
        row = np.dtype(kinds)
        raw = (self.folder / "truth.bin").read_bytes()
        return np.frombuffer(raw[: len(raw) // row.itemsize * row.itemsize], dtype=row)

    def end(self) -> dict[str, Any]:
        """End it and give the last it has to say."""
        if self.process.poll() is None:
            assert self.process.stdin is not None
            self.process.stdin.close()
            self.process.wait(60)
        last = self.events()[-1]
        assert last["event"] == "bye"
        return last


def _channel(name: str, unit: str, quantity: str, coefficients: str) -> str:
    certificate = 'certificate = "peer", date = "2026-01-15", valid_until = "2099-01-15"'
    return f"""
[[controller.channel]]
name = "{name}"
quantity = "{quantity}"
unit = "{unit}"
place = "of the peer"
calibration = {{ id = "{name}", coefficients = {coefficients}, {certificate} }}
uncertainty = {{ zero = 0.05, u_delay_s = 2e-5 }}
"""


def stand_text(case: Case, profile: str, address: str) -> str:
    """Give the stand file that a lab would write for this controller: no amplifier, no thermometer."""
    force, stroke = f"[0.0, {FORCE_kN[case.peer]}]", STROKE_mm[case.peer]
    head = f"""
[stand]
id = "peer-{case.peer}"
name = "A controller that was written from the documents"
laboratory = "peers"

[limits]
force_max_kN = 600.0
stroke_max_mm = 200.0
frequency_max_Hz = 2.55
speed_max_mm_per_s = 800.0

[controller]
profile = "{profile}"
{address}
device_id = 1
timeout_s = {case.timeout_s}
watchdog_s = {max(2.0, 2.0 * case.timeout_s)}
"""
    channels = _channel("force", "kN", "force", force)
    channels += _channel("stroke_1", "mm", "stroke", stroke) + _channel("stroke_2", "mm", "stroke", stroke)
    channels += _channel("position", "mm", "position", "[0.0, 0.01]")
    return head + channels + _channel("command", "mm", "command", "[0.0, 0.01]")


@contextmanager
def controller(case: Case, program: Path, folder: Path, *more: str) -> Iterator[Running]:
    """Run a controller in a folder, with a stand file beside it; end it on leaving."""
    folder.mkdir(parents=True, exist_ok=True)
    line = folder / "line"
    words = [str(program), *case.options, *more, "--rate-hz", str(case.rate_Hz)]
    words += ["--truth", str(folder / "truth.bin"), "--log", str(folder / "log.jsonl")]
    if case.line:
        words += ["--pty", str(line)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        running = Running(case, folder, process)
        try:
            assert process.stdout is not None
            word, port = process.stdout.readline().split()
            assert word == "ready"
            address = (
                f'serial = "{line}"\nbaud = 115200' if case.line else f'host = "127.0.0.1"\nport = {port}'
            )
            profile = "ring"
            if case.peer == "go":
                lean = ["--lean"] if "--lean" in case.options else []
                printed = subprocess.run(
                    [str(program), "--print-profile", *lean], capture_output=True, check=True
                )
                (folder / "go.toml").write_bytes(printed.stdout)
                profile = "go.toml"
            running.stand = folder / "stand.toml"
            running.stand.write_text(stand_text(case, profile, address))
            yield running
        finally:
            if process.poll() is None and process.stdin is not None and not process.stdin.closed:
                process.stdin.close()
                try:
                    process.wait(60)
                except subprocess.TimeoutExpired:
                    os.kill(process.pid, signal.SIGKILL)
