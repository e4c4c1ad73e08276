"""The tapes that the power is cut on, each made once, in a process of its own."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

from bufferstand.foundation.how_called import with_same_imports
from tests.power_cut.workloads import WORKLOADS, Done

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 300.0
"""A workload takes seconds; a machine may be loaded."""
_CHILD = (
    "import sys; from pathlib import Path; from tests.power_cut.tapes import answer; "
    "answer(Path(sys.argv[1]))"
)

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

    Not in a forked one: what a thread of this process held would be held there for ever.

    Parameters
    ----------
    workload : str
        A key of :data:`WORKLOADS`.
    before : callable
        A function of a module, called there first; may break something on purpose.

    Raises
    ------
    subprocess.TimeoutExpired
        If it takes longer than :data:`PATIENCE_S`.
    """
    done = apart(_done, workload, before)
    assert isinstance(done, Done)
    return done


def apart(task: Callable[..., object], *facts: object) -> object:
    """Return what a function of a module makes in a fresh process; so must what it is given be.

    Raises
    ------
    subprocess.TimeoutExpired
        If it takes longer than :data:`PATIENCE_S`.
    """
    folder = Path(tempfile.mkdtemp(prefix="tape-")).resolve()
    try:
        (folder / "asked").write_bytes(pickle.dumps((task, facts)))
        command = [sys.executable, "-P", "-c", _CHILD, str(folder)]
        subprocess.run(command, env=with_same_imports(), cwd=ROOT, timeout=PATIENCE_S, check=True)
        return pickle.loads((folder / "made").read_bytes())
    finally:
        shutil.rmtree(folder)


def answer(folder: Path) -> None:
    """Do what :func:`apart` asks for, in its process; and end there, whatever threads are left."""
    task, facts = pickle.loads((folder / "asked").read_bytes())
    (folder / "made").write_bytes(pickle.dumps(task(folder, *facts)))
    os._exit(0)


def _done(folder: Path, workload: str, before: Callable[[], object]) -> Done:
    before()
    (folder / "disk").mkdir()
    return WORKLOADS[workload](folder / "disk")
