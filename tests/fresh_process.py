"""Do a piece of work in a fresh process: what has gathered in a worker of the tests has no part in it."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bufferstand.foundation.how_called import with_same_imports

ROOT = Path(__file__).resolve().parents[1]
PATIENCE_S = 300.0
"""A piece of work takes seconds; a machine may be loaded."""
_CHILD = (
    "import sys; from pathlib import Path; from tests.fresh_process import answer; answer(Path(sys.argv[1]))"
)


def in_fresh_process(task: Callable[..., object], *facts: object) -> Any:
    """Return what a function of a module makes there; what it is given, and makes, can be pickled.

    Not in a forked process: what a thread of this one held would be held there for ever.

    Parameters
    ----------
    task : callable
        Called with an empty folder, which goes afterwards, and the facts.

    Raises
    ------
    subprocess.CalledProcessError
        If it raises.
    subprocess.TimeoutExpired
        If it takes longer than :data:`PATIENCE_S`.
    """
    folder = Path(tempfile.mkdtemp(prefix="fresh-")).resolve()
    try:
        (folder / "asked").write_bytes(pickle.dumps((task, facts)))
        (folder / "room").mkdir()
        command = [sys.executable, "-P", "-c", _CHILD, str(folder)]
        subprocess.run(command, env=with_same_imports(), cwd=ROOT, timeout=PATIENCE_S, check=True)
        return pickle.loads((folder / "made").read_bytes())
    finally:
        shutil.rmtree(folder)


def answer(folder: Path) -> None:
    """Do what is asked for, in the fresh process; and end there, whatever threads are left."""
    task, facts = pickle.loads((folder / "asked").read_bytes())
    (folder / "made").write_bytes(pickle.dumps(task(folder / "room", *facts)))
    sys.stdout.flush()
    os._exit(0)
