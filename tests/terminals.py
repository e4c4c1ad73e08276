"""A real terminal in which a command runs: keys are pressed at its other end, and what it shows is read."""

from __future__ import annotations

import os
import pty
import re
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATIENCE_S = 240.0
"""Nothing here is judged by the wall: only a hang ends after this time."""
_ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\x1b[()][A-Z0-9]|\r")


class Terminal:
    """The other end of a terminal in which a program runs."""

    def __init__(self, descriptor: int, process: subprocess.Popen[bytes]) -> None:
        self._descriptor = descriptor
        self.process = process
        self.raw = ""

    @property
    def text(self) -> str:
        """Everything that was shown so far, without colours and movements of the cursor."""
        return _ESCAPES.sub("", self.raw)

    def wait_for(self, pattern: str) -> str:
        """Read until something is shown after all that was awaited before; return all of the text."""
        until_s = time.monotonic() + PATIENCE_S
        while not re.search(pattern, self.text):
            assert time.monotonic() < until_s, f"never shown: {pattern}\n{self.text[-2000:]}"
            assert self._read(), f"ended before it showed: {pattern}\n{self.text[-2000:]}"
        return self.text

    def press(self, keys: str) -> None:
        os.write(self._descriptor, keys.encode())

    def end(self) -> int:
        """Read to the program's end; return its exit status."""
        until_s = time.monotonic() + PATIENCE_S
        while self._read():
            assert time.monotonic() < until_s, f"it does not end:\n{self.text[-2000:]}"
        return self.process.wait(PATIENCE_S)

    def _read(self) -> bool:
        if not select.select([self._descriptor], [], [], 1.0)[0]:
            return self.process.poll() is None
        try:
            came = os.read(self._descriptor, 65536)
        except OSError:  # Linux says so when the last program has closed the terminal
            return False
        self.raw += came.decode(errors="replace")
        return bool(came)


@contextmanager
def in_terminal(*words: str | Path) -> Iterator[Terminal]:
    """Run ``bufferstand`` in a terminal of 120 columns that it controls; it does not outlive this."""
    child, descriptor = pty.fork()
    if child == 0:  # pragma: no cover - another program from here on
        os.chdir(ROOT)
        environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "120", "LINES": "30"}
        command = [sys.executable, "-P", "-m", "bufferstand", *map(str, words)]
        os.execvpe(command[0], command, {**environment, "PYTHONPATH": str(ROOT)})
    process = _Forked(child)
    try:
        yield Terminal(descriptor, process)  # type: ignore[arg-type]
    finally:
        process.kill()
        os.close(descriptor)


class _Forked:
    """As much of a process as is needed of one that was forked into a terminal."""

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._status: int | None = None

    def poll(self) -> int | None:
        if self._status is None:
            pid, status = os.waitpid(self._pid, os.WNOHANG)
            self._status = os.waitstatus_to_exitcode(status) if pid else None
        return self._status

    def wait(self, timeout_s: float) -> int:
        until_s = time.monotonic() + timeout_s
        while (status := self.poll()) is None:
            assert time.monotonic() < until_s, "it does not end"
            time.sleep(0.05)
        return status

    def kill(self) -> None:
        if self.poll() is None:
            os.kill(self._pid, 9)
            self.wait(60.0)
