"""Evaluation on the cores of this machine, in separate processes: a crash of one does not stop the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

from bufferstand.evaluation.archive.settings_and_software import EvaluationSettings, software
from bufferstand.evaluation.archive.tasks import File, Outcome, batches, evaluate_batch
from bufferstand.evaluation.archive.worker_processes import handed_out, spawned_workers
from bufferstand.foundation.operating_system import usable_cores

DIED = "the process that evaluated it died: out of memory, or a library crashed on what is in it"
_HERE_FILES = 3
_HERE_BYTES = 8_000_000
_AHEAD = 2
"""Tasks handed out ahead, a process: the next is there when one is done, and few are suspect if it dies."""


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
    with spawned_workers(jobs) as pool:
        running: dict[Future[list[Outcome]], list[File]] = {}
        while waiting or running:
            broken = False
            while waiting and len(running) < _AHEAD * jobs and not broken:
                try:
                    future = handed_out(pool, evaluate_batch, waiting[0], settings, software())
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
        with spawned_workers(1) as pool:
            while left:
                file = left.pop(0)
                try:
                    yield from handed_out(pool, evaluate_batch, [file], settings, software()).result()
                except BrokenProcessPool:
                    yield Outcome(file.path, None, DIED, lost=True)
                    break
