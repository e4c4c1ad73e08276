"""What a process holds, from ``/proc``: memory, open handles, threads, children."""

from __future__ import annotations

import re
from pathlib import Path


def family(pid: int) -> list[int]:
    """Return a process and all that it has begun."""
    found = [pid]
    for task in sorted(Path(f"/proc/{pid}/task").glob("*")):
        try:
            children = (task / "children").read_text(encoding="ascii").split()
        except (FileNotFoundError, ProcessLookupError):  # a thread that has ended meanwhile
            continue
        for child in children:
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
    found = [one for one in map(_held, family(pid)) if one is not None]
    return {
        "memory_MB": sum(memory_kB for memory_kB, _, _ in found) / 1024.0,
        "handles": float(sum(handles for _, handles, _ in found)),
        "threads": float(sum(threads for _, _, threads in found)),
        "processes": float(len(found)),
    }


def shared_out_MB(pid: int) -> float:  # noqa: N802 - the unit keeps its capitals
    """Return what a process and its children hold [MB]: PSS, where shared pages are shared out."""
    return sum(_kB(Path(f"/proc/{one}/smaps_rollup"), "Pss") for one in family(pid)) / 1024.0


def _held(pid: int) -> tuple[int, int, int] | None:
    """Return memory [kB], handles and threads of a process; None of one that has ended meanwhile."""
    folder = Path(f"/proc/{pid}")
    try:
        return (
            _kB(folder / "smaps_rollup", "Pss_Anon"),
            len(list((folder / "fd").iterdir())),
            len(list((folder / "task").iterdir())),
        )
    except (FileNotFoundError, ProcessLookupError):
        return None


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
