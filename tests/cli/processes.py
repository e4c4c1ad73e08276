"""The command as a process of its own, with nobody at a terminal."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def bufferstand(*words: str | Path, timeout_s: float = 240.0) -> subprocess.CompletedProcess[str]:
    """Run the command; standard input is empty."""
    return subprocess.run(
        [sys.executable, "-P", "-m", "bufferstand", *map(str, words)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )
