"""``bufferstand run --simulate`` in a real terminal: real keys, what is on the screen, and how it ends."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.operator.notes import read_notes
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import SAMPLES
from tests.daq.test_in_process import campaign
from tests.terminals import PATIENCE_S, Terminal, in_terminal

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


@contextmanager
def running(path: Path, out: Path) -> Iterator[Terminal]:
    """Run a campaign on a simulated stand in a terminal."""
    with in_terminal("run", path, "--out", out, "--simulate", "--speed", "2") as terminal:
        yield terminal


def statuses(out: Path) -> Mapping[str, str]:
    record = load_record(out)
    assert record is not None
    return {step.name: step.status for step in record.steps}


@pytest.mark.slow
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


@pytest.mark.slow
def test_without_a_terminal_it_is_a_plain_log(tmp_path: Path) -> None:
    path, out = campaign(tmp_path, SHORT), tmp_path / "out"
    command = [
        sys.executable,
        "-P",
        "-m",
        "bufferstand",
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
