"""How this program was called and installed, so that a command that is printed works as printed."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from shlex import quote

CALLED = "BUFFERSTAND_CALLED"
"""Environment variable in which a launcher says how it was called (``start.py``)."""
_STAMP = "bufferstand-stamp"
"""The file that ``start.py`` leaves in an environment of its own."""


def program() -> str:
    """Return the words that a command of this program begins with, as one can type them here.

    Returns
    -------
    str
        How the launcher was called; ``bufferstand`` where the shell finds that of this environment; else its
        path, or this Python with ``-m bufferstand``.
    """
    called = os.environ.get(CALLED)
    if called:
        return called
    script = Path(sys.executable).parent / "bufferstand"
    if not script.exists():
        return f"{quote(sys.executable)} -m bufferstand"
    found = shutil.which("bufferstand")
    if found is not None and script.samefile(found):
        return "bufferstand"
    return quote(_as_typed(script))


def how_to_add(extra: str) -> str:
    """Return the command that adds an optional extra to this installation."""
    if (Path(sys.prefix) / _STAMP).exists():
        start = Path(sys.prefix).parent / "start.py"
        return f"python3 {quote(_as_typed(start))} setup"
    return f"{quote(sys.executable)} -m pip install 'bufferstand[{extra}]'"


def _as_typed(path: Path) -> str:
    """Return a path from the present folder where it lies below it."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


def with_same_imports() -> dict[str, str]:
    """Return this process's environment, for one of its own that imports the same from the same places.

    It may run from a folder or an archive that only its ``sys.path`` names.
    """
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
