"""How time is taken: of tasks in this process, of commands, of other processes."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def best(tasks: Sequence[Callable[[], object]], rounds: int) -> list[float]:
    """Return the shortest processor time of each of several tasks that take turns [s]."""
    times = []
    for _ in range(rounds):
        row = []
        for task in tasks:
            start = time.process_time()
            task()
            row.append(time.process_time() - start)
        times.append(row)
    return [min(column) for column in zip(*times, strict=True)]


@dataclass(frozen=True)
class Cost:
    """What a command and its children took: wall and processor time [s], memory [MB].

    The memory is that of the largest process, and at least what this one has, as Linux counts it."""

    wall_s: float
    cpu_s: float
    peak_MB: float

    def __str__(self) -> str:
        return f"{self.wall_s:7.2f} s wall {self.cpu_s:7.2f} s processor"


def cost(*words: str) -> Cost:
    """Run Python with these arguments; return what it took.

    Raises
    ------
    subprocess.CalledProcessError
        If it fails.
    """
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # or every process compiles its libraries anew
    command = [sys.executable, "-P", *words]
    start = time.perf_counter()
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, cwd=ROOT) as process:
        _, status, usage = os.wait4(process.pid, 0)  # with its children's, which it has waited for
        process.returncode = os.waitstatus_to_exitcode(status)
    wall_s = time.perf_counter() - start
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return Cost(wall_s, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0)


def processor_s(pid: int) -> float:
    """Return the processor time of another process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
