"""A stopped process, a full disk, a slow disk, a clock that is set: the stand is safe, the samples stay."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.drivers.interfaces import MotionState
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.runfile.reading_apart import READER
from bufferstand.recording.runfile.run import Run
from tests.daq.killing import (
    LOADED,
    Bench,
    Tally,
    bench,
    complete_steps,
    nothing_lost,
    start,
    write_campaign,
)

PATIENCE_S = 120.0
DISK_MB = 90
"""Room for what is planned and the reserve, and little more."""


@pytest.fixture(scope="module")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with bench(tmp_path_factory.mktemp("stand") / "bench") as made:
        yield made


def until(done: Any, what: str, process: subprocess.Popen[str] | None = None) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < end_s, what
        assert process is None or process.poll() is None, what
        time.sleep(0.01)


def loaded_and_recording(stand: Bench, folder: Path) -> bool:
    acknowledged = list(folder.glob("*.ack"))
    return bool(acknowledged) and stand.status().state in LOADED and stand.status().force_kN > 1.0


def at_rest(stand: Bench) -> bool:
    status = stand.status()
    return status.state in (MotionState.OFF, MotionState.FAULT) and abs(status.force_kN) < 1.0


def log(folder: Path) -> str:
    return (folder / "log").read_text()


def runs(folder: Path) -> list[Run]:
    return [open_run(path) for path in sorted((folder / "out" / "runs").glob("*.h5"))]


def nothing_of(folder: Path) -> Tally:
    tally = Tally()
    nothing_lost(folder, {run.path.stem for run in runs(folder)}, tally)
    return tally


def ended(process: subprocess.Popen[str]) -> int:
    return process.wait(PATIENCE_S)


def said(run: Run, text: str) -> bool:
    return any(text in event.text for event in run.events)


def test_a_process_that_is_stopped_for_two_seconds(stand: Bench, tmp_path: Path) -> None:
    """Computer and stand share a busy machine: if the watchdog of 4 s runs out, that is said, and safe."""
    process = start(stand, tmp_path, write_campaign(tmp_path / "c.toml", 1, stand.stand_file))
    until(lambda: loaded_and_recording(stand, tmp_path), "it never recorded under load", process)
    os.kill(process.pid, signal.SIGSTOP)
    time.sleep(2.0)
    os.kill(process.pid, signal.SIGCONT)
    status = ended(process)
    until(lambda: at_rest(stand), "the stand did not come to rest")
    (run,) = runs(tmp_path)
    if status == 0:
        assert run.status == "complete"
    else:
        assert status == 4, log(tmp_path)
        assert run.status == "failed"
        # Which of them speaks first depends on what the computer does when the process goes on.
        reasons = ("watchdog", "behind the stand", "delivers no new samples")
        assert any(reason in run.reason for reason in reasons), run.reason
        assert any(reason in log(tmp_path) for reason in reasons)
    assert said(run, "this program stood still for") or "stood still" in log(tmp_path)
    assert nothing_of(tmp_path).acknowledged > 0


def test_a_slow_disk_and_a_clock_that_is_set_cost_nothing(stand: Bench, tmp_path: Path) -> None:
    process = start(
        stand,
        tmp_path,
        write_campaign(tmp_path / "c.toml", 1, stand.stand_file),
        hindered=("0.5:3.0", "3600"),
    )
    assert ended(process) == 0, log(tmp_path)
    assert at_rest(stand)
    (run,) = runs(tmp_path)
    assert run.status == "complete"
    assert run.metadata["recorder"]["late_syncs"] > 0
    assert run.metadata["recorder"]["worst_sync_s"] > 0.5
    (jump,) = [event for event in run.events if "civil time was set by +3600" in event.text]
    assert "samples keep their own clock" in jump.text
    assert set(np.diff(run.streams["controller"].time[:100])) == {1000}
    utc = [anchor.utc for anchor in run.anchors]
    assert utc == sorted(utc)  # forward by an hour: the only thing that shows it
    assert run.gaps("controller") == []
    assert nothing_of(tmp_path).recovered_beyond == 0


@pytest.mark.long
def test_a_disk_that_is_too_slow_stops_and_says_so(stand: Bench, tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path / "c.toml", 1, stand.stand_file, "disk_stop_s = 1.0\n")
    process = start(stand, tmp_path, campaign, hindered=("5.0:5.0", "0"))
    assert ended(process) == 4, log(tmp_path)
    assert at_rest(stand)
    assert "the disk is slow" in log(tmp_path)
    (run,) = runs(tmp_path)
    assert run.status == "failed"
    assert "samples have waited for it for" in run.reason
    assert nothing_of(tmp_path).acknowledged > 0


@contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    folder.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "tmpfs", str(folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    if made.returncode:
        pytest.skip(f"FULL DISK NOT TRIED, a tmpfs cannot be mounted here: {made.stderr.strip()}")
    try:
        yield folder
    finally:
        READER.close()  # it keeps the file that was read last
        subprocess.run(["umount", str(folder)], check=True)


def fill(filler: Path, process: subprocess.Popen[str]) -> None:
    """Take all the room there is, and what others give back, until the process has ended."""
    with filler.open("ab", buffering=0) as file:
        while process.poll() is None:
            for size in (1 << 20, 1 << 12):
                with contextlib.suppress(OSError):
                    while True:
                        file.write(b"x" * size)
            time.sleep(0.05)


def test_a_full_disk_stops_safely_and_the_runs_are_sealed_once_there_is_room(
    stand: Bench, tmp_path: Path
) -> None:
    """The first run lives on the 8 MiB that its journal reserved: enough for minutes; the second has none."""
    with small_disk(tmp_path / "disk") as disk:
        (disk / "out").mkdir()
        (tmp_path / "out").symlink_to(disk / "out")
        campaign = write_campaign(tmp_path / "c.toml", 2, stand.stand_file)
        process = start(stand, tmp_path, campaign)
        until(lambda: loaded_and_recording(stand, tmp_path), "it never recorded under load", process)
        fill(disk / "filler", process)
        assert ended(process) == 4, log(tmp_path)
        assert at_rest(stand)
        assert "No space left on device" in log(tmp_path).splitlines()[-1]
        (disk / "filler").unlink()
        assert ended(start(stand, tmp_path, campaign)) == 0, log(tmp_path)
        assert len(complete_steps(tmp_path / "out")) == 2
        assert {run.status for run in runs(tmp_path)} <= {"complete", "failed", "recovered", "stopped"}
        assert nothing_of(tmp_path).acknowledged > 0
