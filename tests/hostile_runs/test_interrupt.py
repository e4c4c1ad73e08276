"""A signal ends a command while HDF5 runs in circles, and with it all its processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.hostile_runs.crafting import ROOT
from tests.hostile_runs.damage import circle, small_run

pytestmark = pytest.mark.slow

LONG_S = 120.0
"""No wait takes so long but that of a test that fails."""
_PATIENT = """
import sys
from bufferstand.recording.runfile import reading_apart as apart
apart.LEAST_S = 1e6
from bufferstand.cli.main import main
main(sys.argv[1:])
"""
"""The command with so much time for each file that only a signal can end it."""
_STOPPED = 3


def _started_by(pid: int) -> Iterator[int]:
    """Yield all processes below one."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
                parents[int(entry.name)] = int(fields[1])
    waiting = [pid]
    while waiting:
        now = waiting.pop()
        below = [child for child, parent in parents.items() if parent == now]
        yield from below
        waiting += below


def _in_circles(pid: int) -> list[int]:
    """Return the readers below a process that have been running for a while."""
    found = []
    for one in _started_by(pid):
        with suppress(OSError):
            fields = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
            ticks = int(fields[11]) + int(fields[12])
            reads = b"reader_process" in Path(f"/proc/{one}/cmdline").read_bytes()
            if reads and ticks > 1.5 * os.sysconf("SC_CLK_TCK"):
                found.append(one)
    return found


def _until(what: str, holds: object) -> None:
    end = time.monotonic() + LONG_S
    while not holds():  # type: ignore[operator]
        assert time.monotonic() < end, what
        time.sleep(0.05)


def _is_gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


@pytest.mark.dose(5)
@pytest.mark.parametrize(
    ("words", "number"),
    [
        (("verify",), signal.SIGINT),
        (("runs", "--no-cache"), signal.SIGINT),
        (("verify",), signal.SIGTERM),
        (("evaluate", "--no-cache"), signal.SIGINT),
        (("evaluate", "--no-cache", "--jobs", "2"), signal.SIGINT),
        (("report", "--out", "report"), signal.SIGINT),
        (("verify",), signal.SIGHUP),
        (("model", "fit", "--out", "model.toml"), signal.SIGINT),
        (("evaluate", "--no-cache", "--jobs", "2"), signal.SIGKILL),
    ],
    ids=lambda value: value.name if isinstance(value, signal.Signals) else " ".join(value),
)
def test_a_signal_ends_a_command_while_hdf5_reads(
    words: tuple[str, ...], number: signal.Signals, tmp_path: Path
) -> None:
    files = [circle(small_run(tmp_path / f"{name}.h5"), sealed=True) for name in "ab"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", _PATIENT, *words, *(files if "--jobs" in words else files[:1])],
        cwd=tmp_path,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        _until("HDF5 runs in circles", lambda: _in_circles(process.pid))
        readers = _in_circles(process.pid)
        process.send_signal(number)
        _, told = process.communicate(timeout=LONG_S)
    finally:
        process.kill()
        process.wait()
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
    else:
        assert process.returncode == _STOPPED, told
        assert "Traceback" not in told
    for reader in readers:
        _until("the reader ends with the command", lambda pid=reader: _is_gone(pid))
