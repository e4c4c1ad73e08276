"""A simulated campaign on a computer that has no time for it: slower, but whole."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest

from bufferstand.recording.runfile.file import open_run
from tests.main_job.conftest import bufferstand
from tests.main_job.test_run import write_campaign

BUSY = "while True: pass"
LOST = r"(\d+) samples? .* lost .*, (?:(\d+) of them )?(?:a )?cycles? that the controller missed"


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """Keep so many processes busy, as eagerly as those under test."""
    with ExitStack() as stack:
        started = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(processes)]
        for process in started:
            stack.callback(process.wait)
            stack.callback(process.kill)
        yield


def assert_whole(out: Path, runs: int) -> None:
    """See that every run is complete and no sample is missing but of cycles that the controller missed."""
    files = sorted((out / "runs").glob("*.h5"))
    assert len(files) == runs
    for path in files:
        run = open_run(path)
        steps = np.rint(np.diff(run.series("force").time_s) * 1e3).astype(int)
        assert steps.min() == 1, path.name
        missed = [re.match(LOST, event.text) for event in run.events]
        assert sum(steps - 1) == sum(int(found[2] or found[1]) for found in missed if found), path.name


@pytest.mark.parametrize(
    ("speed", "steps"), [("1", 1), ("100", 2), pytest.param("1", 2, marks=pytest.mark.long)]
)
def test_a_campaign_beside_six_busy_processes(tmp_path: Path, speed: str, steps: int) -> None:
    campaign, out = write_campaign(tmp_path, stop=40.0, cycles=3, steps=steps), tmp_path / "out"
    with busy(6):
        done = bufferstand("run", campaign, "--out", out, "--simulate", "--speed", speed)
    assert done.returncode == 0, done.stderr
    assert_whole(out, steps)
    for path in (out / "runs").glob("*.h5"):
        said = [event for event in open_run(path).events if event.kind == "trip"]
        assert not said, said


@pytest.mark.long
def test_the_demo_ten_times_beside_eight_busy_processes(tmp_path: Path) -> None:
    for turn in range(10):
        with busy(8):
            done = bufferstand("demo", "--out", tmp_path / str(turn))
        assert done.returncode == 0, f"turn {turn}: {done.stderr}"
        assert_whole(tmp_path / str(turn), 13)
