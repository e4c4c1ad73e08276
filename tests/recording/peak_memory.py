"""How much memory a test's process had at most."""

from __future__ import annotations

from pathlib import Path


def peak_MB() -> float:  # noqa: N802 - the unit keeps its capitals
    """Return the most memory that this program ever had [MB].

    Not ``ru_maxrss``: a child begins with that of the process that started it, however large that was.
    """
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return float(status["VmHWM"].split()[0]) * 1024 / 1e6
