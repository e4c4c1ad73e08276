"""Evaluation on a Dask cluster by address: the same tasks, the same results to the last bit.

What may happen meanwhile, and what is done: a worker dies (its tasks go to others), a file kills its worker
(it is tried alone, then reported), the scheduler is restarted (the tasks that have no result yet are handed
out again), a worker has other software (refused), no worker is left (given up after a while).
"""

from __future__ import annotations

import asyncio
import logging
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bufferstand.evaluation.archive.local_workers import DIED
from bufferstand.evaluation.archive.settings_and_software import (
    THREADS,
    EvaluationSettings,
    place,
    software,
)
from bufferstand.evaluation.archive.tasks import (
    File,
    OtherFile,
    OtherSoftware,
    Outcome,
    batches,
    difference_of,
    evaluate_batch,
    mark_of,
)
from bufferstand.foundation import BadInput, DeviceFault, how_to_add

distributed: Any
try:
    import distributed
except ModuleNotFoundError:
    distributed = None

LOST_S = 60.0
"""A cluster without a scheduler or a worker for so long is given up."""
_CONNECT_S = 10.0
_TICK_S = 1.0
_MOST_STARTS = 3
"""So often a task is handed out again for a cause that is not its own."""


@dataclass(frozen=True)
class ClusterWorkers:
    """A Dask cluster.

    Attributes
    ----------
    address : str
        Of its scheduler, ``tcp://HOST:PORT``.
    warn : callable
        Told what does not stop the evaluation, but should be known.
    lost_s : float
        How long to wait for a lost scheduler or for workers [s].

    Raises
    ------
    BadInput
        If Dask is not installed.
    """

    address: str
    warn: Callable[[str], None]
    lost_s: float = LOST_S

    def __post_init__(self) -> None:
        if distributed is None:
            raise BadInput(
                "a cluster needs the library distributed, which is not installed",
                file="--cluster",
                remedy=f"install it ({how_to_add('archive')})",
            )

    def evaluate(self, files: Sequence[File], settings: EvaluationSettings) -> Iterator[Outcome]:
        """Evaluate files and yield what became of each, in the order in which they are done.

        Raises
        ------
        BadInput
            If there is no scheduler at the address, or a worker has other software, or does not see the files
            or sees others.
        DeviceFault
            If scheduler or workers are lost and do not come back.
        """
        if not files:
            return
        # Workers have a current folder of their own.
        given = {str(Path(file.path).absolute()): file.path for file in files}
        seen = [_marked(File(path, file.size)) for path, file in zip(given, files, strict=True)]
        with _quiet(), _Session(self, seen[0].path) as session:
            for outcome in _worked_off(session, seen, settings):
                yield _renamed(outcome, given[outcome.path])


def _marked(file: File) -> File:
    """Return a file with what it is now, as this machine sees it; workers compare."""
    return replace(file, mark=mark_of(file.path))


def _renamed(outcome: Outcome, path: str) -> Outcome:
    run = None if outcome.run is None else replace(outcome.run, path=path)
    return replace(outcome, path=path, run=run)


def _worked_off(session: _Session, files: Sequence[File], settings: EvaluationSettings) -> Iterator[Outcome]:
    suspects: list[File] = []
    for batch, outcomes in session.results(batches(files, session.threads()), settings):
        if outcomes is None:
            suspects += batch
        else:
            yield from outcomes
    # One at a time: a worker that dies now died of the file that it had.
    for file in suspects:
        for _, outcomes in session.results([[file]], settings):
            yield from outcomes if outcomes is not None else [Outcome(file.path, None, DIED, lost=True)]


class _Session:
    """A connection to a scheduler that is made again when it is lost."""

    def __init__(self, cluster: ClusterWorkers, sample: str) -> None:
        self._address, self._lost_s, self._sample = cluster.address, cluster.lost_s, sample
        self._warn = cluster.warn
        self._client: Any = None

    def __enter__(self) -> _Session:
        self._connect(_CONNECT_S)
        deadline = time.monotonic() + self._lost_s
        while not self._workers():
            if time.monotonic() > deadline:
                self._close()
                raise BadInput(
                    f"no worker has joined the cluster within {self._lost_s:.0f} s",
                    file=self._address,
                    remedy="start workers: dask worker ADDRESS (docs/cluster.md)",
                )
            time.sleep(_TICK_S)
        try:
            self._check_workers()
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def _connect(self, timeout_s: float) -> None:
        try:
            self._client = distributed.Client(self._address, timeout=timeout_s)
        except (OSError, ValueError, TimeoutError) as error:
            raise BadInput(
                f"no scheduler answers there ({error})",
                file=self._address,
                remedy="check address and port; “dask scheduler” prints them when it starts",
            ) from None

    def _close(self) -> None:
        if self._client is not None:
            with suppress(Exception):
                self._client.close(timeout=2.0)
            self._client = None

    def _workers(self) -> Mapping[str, Any]:
        try:
            workers: Mapping[str, Any] = self._client.scheduler_info(n_workers=-1).get("workers", {})
        except (OSError, ValueError, TimeoutError):
            return {}  # the scheduler does not answer just now
        return workers

    def threads(self) -> int:
        """Return how many tasks the cluster does at a time."""
        return max(1, sum(int(worker.get("nthreads", 1)) for worker in self._workers().values()))

    def _check_workers(self) -> None:
        """Refuse a cluster of which a worker would give other figures, or none."""
        mine = place()
        for worker, found in self._asked(place).items():
            if isinstance(found, Exception):
                raise BadInput(
                    f"cannot evaluate: {found}",
                    file=f"worker {worker}",
                    remedy="install bufferstand in the environment that the workers are started in",
                )
            if difference := mine.software.difference(found.software):
                raise BadInput(
                    f"has {difference}",
                    file=f"worker {worker}",
                    remedy="give workers and this machine the same environment: figures would differ",
                )
            if not found.one_thread:
                raise BadInput(
                    f"is not run with {THREADS}=1, on which the last bit of figures hangs",
                    file=f"worker {worker}",
                    remedy="set it, or leave out --no-nanny: “dask worker” sets it then",
                )
            if mine.vector_instructions != found.vector_instructions:
                self._warn(
                    f"worker {worker} has a processor of other instructions "
                    f"({' '.join(found.vector_instructions)}) than this machine "
                    f"({' '.join(mine.vector_instructions)}): last digits may differ"
                )
        self._check_file(self._sample)

    def _check_file(self, path: str) -> None:
        """Refuse a cluster of which a worker does not see a file as this machine sees it now."""
        for worker, found in self._asked(difference_of, _marked(File(path, 0))).items():
            if isinstance(found, Exception):
                continue  # it is gone, or says so of the next task
            if found:
                raise BadInput(
                    f"worker {worker} {found}",
                    file=path,
                    remedy="mount the archive of this machine on all workers under this path",
                )

    def _asked(self, question: Callable[..., Any], *values: Any) -> dict[str, Any]:
        answers: dict[str, Any] = self._client.run(question, *values, on_error="return")
        return answers

    def results(
        self, tasks: Sequence[list[File]], settings: EvaluationSettings
    ) -> Iterator[tuple[list[File], list[Outcome] | None]]:
        """Yield each task with its outcomes, None where its worker died of it (or of one beside it)."""
        waiting = list(tasks)
        starts = 0
        while waiting:
            asked = software()
            futures = {
                self._client.submit(evaluate_batch, batch, settings, asked, pure=False): batch
                for batch in waiting
            }
            lost = False
            for future in self._as_they_end(futures):
                if future is None:
                    lost = True
                    break
                ended = _ended(future)
                if isinstance(ended, OtherFile):
                    self._check_file(ended.path)
                    continue  # it was changed meanwhile, is gone from here, too, or the worker is gone
                if ended == "again":
                    continue
                batch = futures[future]
                waiting.remove(batch)
                yield batch, ended
            for future in futures:
                with suppress(Exception):
                    future.release()
            if waiting:
                waiting = [[_marked(file) for file in batch] for batch in waiting]
                starts += 1
                if starts > _MOST_STARTS:
                    raise DeviceFault(
                        f"{self._address}: {len(waiting)} tasks were lost {starts} times; given up"
                    )
                if lost or self._client.status != "running":
                    self._connect_again()
                self._check_workers()

    def _as_they_end(self, futures: Mapping[Any, list[File]]) -> Iterator[Any]:
        """Yield futures as they end; None, and nothing more, when the scheduler is lost."""
        left = set(futures)
        alone_since: float | None = None
        while left:
            ended = {future for future in left if future.done()}
            left -= ended
            yield from ended
            if ended or not left:
                continue
            if self._client.status != "running":
                yield None
                return
            with suppress(TimeoutError, asyncio.TimeoutError, CancelledError):
                distributed.wait(list(left), timeout=_TICK_S, return_when="FIRST_COMPLETED")
            if self._workers():
                alone_since = None
                continue
            alone_since = alone_since or time.monotonic()
            if time.monotonic() - alone_since > self._lost_s:
                raise DeviceFault(
                    f"{self._address}: all workers are gone, and none came for {self._lost_s:.0f} s; "
                    "start workers and evaluate again: what is done is kept"
                )

    def _connect_again(self) -> None:
        self._close()
        deadline = time.monotonic() + self._lost_s
        while True:
            try:
                self._connect(_CONNECT_S)
                while not self._workers() and time.monotonic() < deadline:
                    time.sleep(_TICK_S)
            except BadInput:
                if time.monotonic() > deadline:
                    raise DeviceFault(
                        f"{self._address}: the scheduler is gone, and did not come back for "
                        f"{self._lost_s:.0f} s; start the cluster and evaluate again: what is done is kept"
                    ) from None
                time.sleep(_TICK_S)
            else:
                return


def _ended(future: Any) -> Any:
    """Return the outcomes of a task that has ended, None if its worker died of it, why not, or “again”."""
    try:
        return future.result()
    except distributed.KilledWorker:
        return None
    except OtherFile as error:
        return error
    except (CancelledError, OtherSoftware, OSError, TimeoutError):
        return (
            "again"  # the scheduler forgot it, the result was lost, or a worker joined that has to be refused
        )


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's log off the terminal: what matters of it is said in our words.

    Several of its loggers have a level and a handler of their own, and what ends in its event loop, which
    runs beside ours, is told by those of asyncio and Tornado.
    """
    its = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]
    loggers = [logging.getLogger(name) for name in (*its, "asyncio", "tornado.application")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", category=distributed.versions.VersionMismatchWarning)
        try:
            yield
        finally:
            for logger, level in zip(loggers, before, strict=True):
                logger.setLevel(level)
