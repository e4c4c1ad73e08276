"""Evaluation on the cores of this machine, in separate processes: a crash of one does not stop the others."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait as wait_for_end

from bufferstand.evaluation.archive.settings_and_software import THREADS, EvaluationSettings, software
from bufferstand.evaluation.archive.tasks import File, Outcome, batches, evaluate_batch

DIED = "the process that evaluated it died: out of memory, or a library crashed on what is in it"
_HERE_FILES = 3
_HERE_BYTES = 8_000_000
_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(8 << 20), "MALLOC_TRIM_THRESHOLD_": str(64 << 20)}
"""A process that makes and drops the same small arrays for each run keeps their memory (glibc's mallopt), or
the system would fill every page of them with zeros anew: 5 % of an evaluation. Large arrays go back."""
_ENDING = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
_AHEAD = 2
"""Tasks handed out ahead, a process: the next is there when one is done, and few are suspect if it dies."""


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


@dataclass(frozen=True)
class LocalWorkers:
    """This machine.

    Attributes
    ----------
    jobs : int or None
        Processes; None: one a core, and none at all where starting them would take longer than the work.
    """

    jobs: int | None = None

    def evaluate(self, files: Sequence[File], settings: EvaluationSettings) -> Iterator[Outcome]:
        """Evaluate files and yield what became of each, in the order in which they are done."""
        here = len(files) <= _HERE_FILES and sum(file.size for file in files) <= _HERE_BYTES
        jobs = min(self.jobs or usable_cores(), len(files))
        if not files or self.jobs == 1 or (self.jobs is None and (here or jobs == 1)):
            for file in files:
                yield from evaluate_batch([file], settings, software())
            return
        suspects: list[File] = []
        waiting = batches(files, jobs)
        while waiting:
            yield from _in_pool(waiting, suspects, settings, jobs)
        yield from _one_by_one(suspects, settings)


def _in_pool(
    waiting: list[list[File]], suspects: list[File], settings: EvaluationSettings, jobs: int
) -> Iterator[Outcome]:
    """Work off the tasks that wait; if a process dies, leave the rest, and what was at hand as suspect."""
    with _pool(jobs) as pool:
        running: dict[Future[list[Outcome]], list[File]] = {}
        while waiting or running:
            broken = False
            while waiting and len(running) < _AHEAD * jobs and not broken:
                try:
                    future = _submitted(pool, waiting[0], settings)
                except BrokenProcessPool:
                    broken = True
                    continue
                running[future] = waiting.pop(0)
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                batch = running.pop(future)
                try:
                    yield from future.result()
                except BrokenProcessPool:
                    suspects += batch
                    broken = True
            if broken:
                suspects += [file for batch in running.values() for file in batch]
                return


def _one_by_one(files: Sequence[File], settings: EvaluationSettings) -> Iterator[Outcome]:
    """Evaluate each file with a process to itself: if that dies, the file is the reason."""
    left = list(files)
    while left:
        with _pool(1) as pool:
            while left:
                file = left.pop(0)
                try:
                    yield from _submitted(pool, [file], settings).result()
                except BrokenProcessPool:
                    yield Outcome(file.path, None, DIED, lost=True)
                    break


@contextmanager
def _pool(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Open a pool of fresh processes (spawned: nothing of this one's threads and locks is copied)."""
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), initializer=_end_with_parent)
    try:
        memory = {name: os.environ.get(name, value) for name, value in _MEMORY.items()}
        with _environment({THREADS: "1", **memory}):  # processes are started as tasks come, and must see it
            yield pool
    except BaseException:
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _submitted(
    pool: ProcessPoolExecutor, batch: Sequence[File], settings: EvaluationSettings
) -> Future[list[Outcome]]:
    """Hand out a task, which may start a process, while signals wait: none finds it half started.

    A process inherits which signals wait. So an interrupt from the terminal, which goes to all processes,
    is for this one alone from the first moment on, not only when the others have loaded Python.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
    try:
        return pool.submit(evaluate_batch, batch, settings, software())
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_parent() -> None:
    """In a process that evaluates: ignore interrupts, let other signals end it, and end with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for_end([parent.sentinel])
        os._exit(1)  # nobody waits for the result, and whoever reads the output waits for this process


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
