"""Which tests a run on several processors hands out together: those that share what takes seconds to make.

A fixture of a file, or a function with a cache, is made once by each worker that runs a test of that file.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SHARED_FILES = (
    "tests/main_job/",
    "tests/contract/controller/test_announced.py",
    "tests/evaluation/turns/test_end_forces.py",
    "tests/peers/",
)
"""Files whose tests share what takes seconds to make, and whose text does not show it."""
SHARED = re.compile(r"fixture\([^)]*scope=\"module\"(?P<cases>[^)]*params=)?|^@cache$", re.MULTILINE)


@cache
def _who_share(file: str) -> str:
    """Return which tests of a file share what is made once: ``all``, those of a ``case``, or none."""
    if file.startswith(SHARED_FILES):
        return "all"
    path = ROOT / file
    found = SHARED.findall(path.read_text(encoding="utf-8")) if path.is_file() else []
    return "case" if any(found) else "all" if found else ""


def scope(nodeid: str) -> str:
    """Return what a test is handed out with: itself, its file, or a case of a fixture of its file."""
    file, _, test = nodeid.partition("::")
    who = _who_share(file)
    if who == "case":  # its name stands first in the brackets
        return f"{file}::{test.partition('[')[2].rstrip(']').partition('-')[0]}"
    return file if who else nodeid
