"""The tapes that the power is cut on, each made once, in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

from tests.fresh_process import in_fresh_process
from tests.power_cut.workloads import WORKLOADS, Done

SHARES = ("campaign", "recordings", "by hand", "campaign", "recordings")
"""Which workload a cut is of, in turn."""


def share(number: int) -> str:
    """Return the workload of a cut."""
    return SHARES[number % len(SHARES)]


@cache
def tape_of(workload: str) -> Done:
    """Return what a workload does."""
    return made(workload)


def made(workload: str, before: Callable[[], object] = list) -> Done:
    """Do a workload in a fresh process: it takes over clocks and functions for the rest of its life.

    Parameters
    ----------
    workload : str
        A key of :data:`WORKLOADS`.
    before : callable
        A function of a module, called there first; may break something on purpose.

    Raises
    ------
    subprocess.TimeoutExpired
        If it takes longer than :data:`tests.fresh_process.PATIENCE_S`.
    """
    done = in_fresh_process(_done, workload, before)
    assert isinstance(done, Done)
    return done


def _done(folder: Path, workload: str, before: Callable[[], object]) -> Done:
    before()
    (folder / "disk").mkdir()
    return WORKLOADS[workload](folder / "disk")
