"""Ctrl-C during the demo, as a terminal sends it: to every process of the group, the stand's included."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.verification import verify


def start_demo(folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand", "demo", "--out", str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # a process group of its own, as a shell makes one
    )


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_interrupted_demo_ends_safe_with_whole_files_and_one_line(
    tmp_path: Path, number: signal.Signals
) -> None:
    folder = tmp_path / "demo"
    process = start_demo(folder)
    assert process.stderr is not None
    lines: list[str] = []
    for line in process.stderr:
        lines.append(line)
        if line.startswith("step 2 of 13"):
            break
    while process.poll() is None and not list((folder / "runs").glob("002-*")):
        time.sleep(0.01)  # until the second run is being recorded
    os.killpg(process.pid, number)
    stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 3, [*lines, stderr]
    last = stderr.strip().splitlines()[-1]
    assert last.startswith("bufferstand: stopped by the operator: ")
    assert number.name in last
    assert re.search(r"safe stop: force -?0\.\d kN \(channel force, zero taken off\)", last)
    assert "valve off" in last
    assert "2 run files" in last
    assert "Traceback" not in stderr
    assert stdout == ""
    files = sorted((folder / "runs").iterdir())
    assert [file.suffix for file in files] == [".h5", ".h5"]  # no journal, no half-written file
    assert all(finding.level == "note" for file in files for finding in verify(file))
    assert [open_run(file).status for file in files] == ["complete", "stopped"]
    statuses = [step["status"] for step in json.loads((folder / "campaign.json").read_text())["steps"]]
    assert statuses[:3] == ["complete", "stopped", "pending"]
