"""``bufferstand run --simulate`` in a real terminal: real keys, what is on the screen, and how it ends."""

from __future__ import annotations

import os
import pty
import re
import select
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from daq.folder import load_record
from daq.notes import read_notes
from recording.runfile import open_run
from tests.daq.cases import SAMPLES
from tests.daq.test_in_process import campaign

ROOT = SAMPLES.parent
LONG = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 2.0
cycles = 400
"""
SHORT = LONG.replace("cycles = 400", "cycles = 20")
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
        while self._read():
            pass
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
def running(path: Path, out: Path) -> Iterator[Terminal]:
    """Run a campaign on a simulated stand in a terminal of 120 columns that it controls."""
    child, descriptor = pty.fork()
    if child == 0:  # pragma: no cover - another program from here on
        os.chdir(ROOT)
        environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "120", "LINES": "30"}
        command = [sys.executable, "-P", "-m", "cli", "run", str(path), "--out", str(out), "--simulate"]
        os.execvpe(command[0], [*command, "--speed", "2"], {**environment, "PYTHONPATH": str(ROOT)})
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
            self.wait(10.0)


def statuses(out: Path) -> Mapping[str, str]:
    record = load_record(out)
    assert record is not None
    return {step.name: step.status for step in record.steps}


def test_keys_in_a_real_terminal_and_what_it_shows(tmp_path: Path) -> None:
    path, out = campaign(tmp_path, LONG), tmp_path / "out"
    with running(path, out) as terminal:
        terminal.wait_for(r"keys: Ctrl-C stop now · c stop after the cycle · s stop after the step · n note")
        shown = terminal.wait_for(r"cycle [1-9]\d* of 400")
        for part in (
            r"step 1 of 1", r"20 ± 5 mm, 2 Hz", r"motion", r"\d\.\d kN", r"\d\.\d\d mm", r"°C \(stop 40 °C\)",
            r"\d:\d\d gone, about \d+:\d\d left", r"recorded +\d+ samples +\d+ on disk",
        ):  # fmt: skip
            assert re.search(part, shown), part
        assert "\x1b[" in terminal.raw, "it is drawn, not listed"
        terminal.press("q")  # no such key: it says which there are
        terminal.press("nhand warm to the touch\r")
        terminal.wait_for("operator: hand warm to the touch")
        terminal.press("c")
        terminal.wait_for("stopping after the cycle")
        assert terminal.end() == 3
        text = terminal.text
    assert text.count("keys: Ctrl-C stop now") >= 2
    assert "stopped by the operator: key c" in text
    assert "safe stop: force" in text
    assert "Traceback" not in text
    (note,) = read_notes(out)
    assert (note.text, note.step) == ("hand warm to the touch", 1)
    (run,) = (out / "runs").glob("*.h5")
    found = open_run(run)
    assert found.status == "stopped"
    assert any(event.kind == "operator" and "hand warm" in event.text for event in found.events)
    force = found.series("force").value
    assert abs(force[-1]) < 2.0, "it was stopped after the cycle and released"


@pytest.mark.parametrize(
    ("key", "reason", "left"),
    [("s", "key s", "pending"), ("\x03", "Ctrl-C (SIGINT)", "pending")],
)
@pytest.mark.long
def test_the_other_keys_stop_it_too(tmp_path: Path, key: str, reason: str, left: str) -> None:
    path, out = campaign(tmp_path, SHORT + LONG.replace("= 2.0", "= 1.5")), tmp_path / "out"
    with running(path, out) as terminal:
        terminal.wait_for(r"cycle [1-9]\d* of 20")
        terminal.press(key)
        assert terminal.end() == 3
        text = terminal.text
    assert f"stopped by the operator: {reason}" in text
    first = "complete" if key == "s" else "stopped"
    assert statuses(out) == {"20 ± 5 mm, 2 Hz": first, "20 ± 5 mm, 1.5 Hz": left}


def test_without_a_terminal_it_is_a_plain_log(tmp_path: Path) -> None:
    path, out = campaign(tmp_path, SHORT), tmp_path / "out"
    command = [
        sys.executable,
        "-P",
        "-m",
        "cli",
        "run",
        str(path),
        "--out",
        str(out),
        "--simulate",
        "--speed",
        "2",
    ]
    done = subprocess.run(
        command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
        stdin=subprocess.DEVNULL, timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "\x1b" not in done.stderr + done.stdout
    lines = done.stderr.splitlines()
    assert any(line.startswith("step 1 of 1: 20 ± 5 mm, 2 Hz (about ") for line in lines)
    assert any(re.match(r"  took .* \(planned: .*\); about 0\.0 s left", line) for line in lines)
    assert "keys:" not in done.stderr, "nobody is there to press one"
    assert done.stdout.startswith("campaign complete: 1 run file in ")
    assert "bufferstand plan … --against" in done.stdout
