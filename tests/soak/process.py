"""What a process holds, from ``/proc``: memory, open handles, threads, children."""

from __future__ import annotations

import re
from pathlib import Path


def family(pid: int) -> list[int]:
    """Return a process and all that it has begun."""
    found = [pid]
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text(encoding="ascii").split():
            found += family(int(child))
    return found


def holds(pid: int) -> dict[str, float]:
    """Return what a process and its children hold together.

    Returns
    -------
    dict
        ``memory_MB`` (what they have filled themselves, ``Pss_Anon``; pages of programs and libraries are
        left out: their share falls and rises with other programs that use them), ``handles``, ``threads``,
        ``processes``.
    """
    processes = family(pid)
    return {
        "memory_MB": sum(_memory_kB(one) for one in processes) / 1024.0,
        "handles": float(sum(len(list(Path(f"/proc/{one}/fd").iterdir())) for one in processes)),
        "threads": float(sum(len(list(Path(f"/proc/{one}/task").iterdir())) for one in processes)),
        "processes": float(len(processes)),
    }


def _memory_kB(pid: int) -> int:  # noqa: N802 - the unit keeps its capitals
    return _kB(Path(f"/proc/{pid}/smaps_rollup"), "Pss_Anon")


def peak_MB() -> float:  # noqa: N802
    """Return the most memory this process has held since :func:`forget_peak` (resident)."""
    return _kB(Path("/proc/self/status"), "VmHWM") / 1024.0


def forget_peak() -> None:
    """Let the greatest memory of this process begin anew (proc(5), ``clear_refs``, 5)."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def _kB(file: Path, name: str) -> int:  # noqa: N802
    found = re.search(rf"^{name}:\s+(\d+) kB", file.read_text(encoding="ascii"), re.MULTILINE)
    if found is None:
        raise OSError(f"{file}: no {name}")
    return int(found[1])
