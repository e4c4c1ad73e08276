"""Programs under test: real processes, started warm, stopped and killed by their number."""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

ROOT = Path(__file__).parents[2]
PATIENCE_S = 240.0
"""Only a hang ends after this time [s of the wall]."""


TRIES = 3
TOO_BUSY = (
    "behind the stand for",
    "does not keep up",
    "stood still",
    "no reply within",
    "was not fed in time",
)
"""What programs say on a computer that cannot follow a stand in real time."""
T = TypeVar("T")


@dataclass
class Program:
    """A command that was started: who it is, how it ended, what it said."""

    label: str
    pid: int
    log: Path
    started_s: float
    ended_s: float | None = None
    status: int | None = None
    """Exit status; -9 after kill -9; None while it lives."""
    _over: threading.Event = field(default_factory=threading.Event)

    @property
    def alive(self) -> bool:
        return not self._over.is_set()

    @property
    def said(self) -> str:
        return self.log.read_text(encoding="utf-8", errors="replace") if self.log.exists() else ""

    @property
    def last_line(self) -> str:
        lines = [line.strip() for line in self.said.splitlines() if line.strip()]
        return lines[-1] if lines else ""

    def wait(self, timeout_s: float = PATIENCE_S) -> int:
        """Return its exit status.

        Raises:
            AssertionError: It does not end within the time.
        """
        assert self._over.wait(timeout_s), f"{self.label} does not end:\n{self.said[-2000:]}"
        assert self.status is not None
        return self.status

    def send(self, number: signal.Signals) -> None:
        if self.alive:
            os.kill(self.pid, number)

    def kill(self) -> float:
        """Kill it with SIGKILL; return when [s]."""
        at_s = time.monotonic()
        self.send(signal.SIGKILL)
        return at_s

    def over(self, status: int, at_s: float) -> None:
        """Note its end."""
        self.status, self.ended_s = status, at_s
        self._over.set()


class Launcher:
    """Starts commands; all that it has started end with it."""

    def __init__(self) -> None:
        environment = {
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
        }
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "tests.two_programs.launcher"],
            cwd=ROOT,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._began: queue.Queue[int] = queue.Queue()
        self._programs: dict[int, Program] = {}
        self._lock = threading.Lock()
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"
        self._reader = threading.Thread(target=self._read, name="launcher", daemon=True)
        self._reader.start()

    def start(self, label: str, log: Path, *words: str | Path, module: str = "bufferstand") -> Program:
        """Start ``bufferstand`` with these words (or another module); what it says goes into the log."""
        assert self._process.stdin is not None
        with self._lock:
            self._process.stdin.write(json.dumps([str(log), module, [str(word) for word in words]]) + "\n")
            self._process.stdin.flush()
            at_s = time.monotonic()
            pid = self._began.get(timeout=PATIENCE_S)
            self._programs[pid] = Program(label, pid, log, at_s)
        return self._programs[pid]

    def close(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(30.0)
        self._reader.join(30.0)
        assert self._process.stdout is not None
        self._process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            word, pid, *status = line.split()
            if word == "began":
                self._began.put(int(pid))
            else:
                while int(pid) not in self._programs:  # it ended before its start was written down
                    time.sleep(0.001)
                self._programs[int(pid)].over(int(status[0]), time.monotonic())


def patiently(meeting: Callable[[Path], T], folder: Path, fine: Callable[[T], bool]) -> T:
    """Have a meeting again, in a folder of its own each time, where the computer was too busy for it.

    A program that is disturbed by another may say the same: what is wrong three times is wrong.
    """
    for number in range(TRIES):
        result = meeting(folder / f"{number}")
        logs = (folder / f"{number}").rglob("*.txt")
        busy = any(words in log.read_text(errors="replace") for log in logs for words in TOO_BUSY)
        if fine(result) or not busy:
            break
    return result
