"""A device that falls silent and stays so: the recording must not be called complete, nor none lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.drivers.amplifiers.host_stamps import JUMP_S, HostStamps
from bufferstand.recording.runfile.file import open_run
from tests.record_only.bench import begun, labjack, stand_text, until_recorded

QUICK = "[limits]\nsilence_s = 1.0\n"


def test_a_device_that_is_off_at_the_end_is_a_fault_of_the_recording(tmp_path: Path) -> None:
    with labjack() as far:
        stand = tmp_path / "stand.toml"
        stand.write_text(stand_text(far).replace("[limits]\n", QUICK), encoding="utf-8")
        process = begun(["record", stand, "--out", tmp_path, "--name", "one", "--for", "8s"])
        until_recorded(tmp_path / "one.journal", 1000)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 4, said
    last = next(line for line in said.splitlines() if line.startswith("acquisition: ") and "samples" in line)
    assert "nothing in the last" in last
    run = open_run(tmp_path / "one.h5")
    assert run.status == "failed"
    assert "acquisition has delivered nothing for the last" in run.reason


def test_a_device_that_comes_back_is_told_of_and_is_no_fault(tmp_path: Path) -> None:
    with labjack() as far:
        stand = tmp_path / "stand.toml"
        text = stand_text(far, keys="buffer_bytes = 4096").replace("[limits]\n", QUICK)
        stand.write_text(text, encoding="utf-8")
        with begun(["record", stand, "--out", tmp_path, "--name", "one", "--for", "9s"]) as process:
            until_recorded(tmp_path / "one.journal", 1000)
            far.hold_packets(2.5)
            _, said = process.communicate(timeout=60)
    assert process.returncode == 0, said
    assert "acquisition delivers again, after" in said
    assert "nothing in the last" not in said
    assert open_run(tmp_path / "one.h5").status == "complete"


@pytest.mark.parametrize("silence_s", [1.5 * JUMP_S, 8.0])
def test_values_that_a_silence_swallowed_are_counted(silence_s: float) -> None:
    """A stream without sequence numbers: what should have come by its rate, and did not, is lost."""
    stamps = HostStamps(250.0)
    stamps.stamp(250, 1.0)
    stamps.stamp(1, 1.0 + silence_s)
    assert stamps.passed == pytest.approx(250.0 * silence_s - 1.0, abs=1.0)
    stamps.stamp(1, 1.004 + silence_s)
    assert stamps.passed == 0
