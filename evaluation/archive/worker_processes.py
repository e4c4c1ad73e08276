"""Processes that work for this one: a crash of one does not stop the others."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import wait as wait_for_end
from typing import Any, TypeVar

from bufferstand.evaluation.archive.settings_and_software import THREADS
from bufferstand.foundation.operating_system import let_signals_come, signals_held

Result = TypeVar("Result")

_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(8 << 20), "MALLOC_TRIM_THRESHOLD_": str(64 << 20)}
"""A process that makes and drops the same small arrays for each run keeps their memory (glibc's mallopt), or
the system would fill every page of them with zeros anew: 5 % of an evaluation. Large arrays go back."""


@contextmanager
def spawned_workers(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Open a pool of fresh processes (spawned: nothing of this one's threads and locks is copied).

    They end with this process, however it ends, and leave interrupts to it.

    Parameters
    ----------
    jobs : int
        How many.

    Yields
    ------
    ProcessPoolExecutor
        For :func:`handed_out`. What was not begun when the block is left is not done.
    """
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


def handed_out(pool: ProcessPoolExecutor, work: Callable[..., Result], *arguments: Any) -> Future[Result]:
    """Hand out a task, which may start a process, while signals wait: none finds it half started.

    A process inherits which signals wait. So an interrupt from the terminal, which goes to all processes,
    is for this one alone from the first moment on, not only when the others have loaded Python.

    Parameters
    ----------
    pool : ProcessPoolExecutor
        One of :func:`spawned_workers`.
    work : callable
        A function of a module, which the process imports.
    arguments
        What it is called with; they are pickled.

    Returns
    -------
    Future

    Raises
    ------
    BrokenProcessPool
        If a process of the pool has died.
    """
    with signals_held():
        return pool.submit(work, *arguments)


def _end_with_parent() -> None:
    """In a process that evaluates: ignore interrupts, let other signals end it, and end with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    let_signals_come()
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
