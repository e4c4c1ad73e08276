"""Do pieces of work in forked processes, each with limits of its own."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MEMORY_BYTES = 6 * 2**30
BREATH_S = 0.005


@dataclass(frozen=True)
class Work:
    """One piece.

    Parameters
    ----------
    tag : object
        What it is called by whoever asked for it.
    do : callable
        It; what it returns in bytes is read by the parent, an exception makes it fail.
    cpu_s : float
        Processor time that it may take [s]; its children count for themselves.
    wall_s : float
        Time of the wall that it may take [s]: one that waits takes no processor.
    """

    tag: Any
    do: Callable[[], bytes]
    cpu_s: float
    wall_s: float


@dataclass(frozen=True)
class Done:
    """What became of a piece: what it returned, None where it failed; whether its limits ended it."""

    tag: Any
    said: bytes | None
    timed_out: bool


def _child(work: Work, folder: str, out: int) -> None:
    """Be the child: never returns."""
    try:
        os.setsid()
        null = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(null, stream)
        resource.setrlimit(resource.RLIMIT_CPU, (int(work.cpu_s) + 1, int(work.cpu_s) + 3))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
        os.environ["TMPDIR"] = tempfile.tempdir = folder
        said = work.do()
        with os.fdopen(out, "wb") as pipe:
            pipe.write(said)
    except BaseException:  # noqa: BLE001 - whatever it was, this process is over
        os._exit(1)
    os._exit(0)


def in_processes(works: Iterable[Work], jobs: int) -> Iterator[Done]:
    """Yield what became of pieces, as they end; so many at a time.

    Whatever a piece started and left behind is ended with it.
    """
    running: dict[int, tuple[Work, float, str, Path]] = {}
    waiting = iter(works)
    more = True
    while more or running:
        while more and len(running) < jobs:
            work = next(waiting, None)
            if work is None:
                more = False
                break
            folder = tempfile.mkdtemp(prefix="mutant-")
            place = Path(folder, "said")
            sys.stdout.flush()
            sys.stderr.flush()
            pid = os.fork()
            if pid == 0:
                _child(work, folder, os.open(place, os.O_WRONLY | os.O_CREAT))
            running[pid] = work, time.monotonic() + work.wall_s, folder, place
        for pid, (work, until_s, folder, place) in list(running.items()):
            ended, status = os.waitpid(pid, os.WNOHANG)
            late = not ended and time.monotonic() > until_s
            if not ended and not late:
                continue
            _end_all(pid)
            if late:
                os.waitpid(pid, 0)
            del running[pid]
            by = os.WTERMSIG(status) if ended and os.WIFSIGNALED(status) else 0
            said = None
            if ended and status == 0:
                said = place.read_bytes()
            shutil.rmtree(folder, ignore_errors=True)
            yield Done(work.tag, said, late or by in (signal.SIGXCPU, signal.SIGPROF, signal.SIGKILL))
        time.sleep(BREATH_S)


def _end_all(group: int) -> None:
    """End a group of processes, if any of it is left."""
    with suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)
