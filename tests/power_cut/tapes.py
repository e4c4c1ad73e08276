"""The tapes that the power is cut on, each made once, in a process of its own."""

from __future__ import annotations

import os
import pickle
import shutil
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path

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
    """Do a workload in a forked process: it takes over clocks and functions for the rest of its life.

    Parameters
    ----------
    workload : str
        A key of :data:`WORKLOADS`.
    before : callable
        Called there first; may break something on purpose.
    """
    folder = Path(tempfile.mkdtemp(prefix="tape-")).resolve()
    told = folder / "told"
    (folder / "disk").mkdir()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", DeprecationWarning
        )  # of a fork beside threads: they have no part in it
        child = os.fork()
    if child == 0:
        status = 1
        try:
            before()
            done = WORKLOADS[workload](folder / "disk")
            told.write_bytes(pickle.dumps(done))
            status = 0
        except BaseException:  # noqa: BLE001 - nothing of this process may go on as the one it was forked from
            traceback.print_exc()
        finally:
            os._exit(status)
    os.waitpid(child, 0)
    try:
        done = pickle.loads(told.read_bytes())
        assert isinstance(done, Done)
        return done
    finally:
        shutil.rmtree(folder)
