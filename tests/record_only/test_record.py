"""Record-only mode as a technician uses it: the command on a stand of instruments, on real wires."""

from __future__ import annotations

import json
import shlex
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.stand_file.recording_stand import load_recording_stand
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.runfile.file import open_run
from tests.house.house_page import ROOT
from tests.record_only.bench import (
    ABSORBED_J,
    AMPLITUDE_MM,
    FREQUENCY_HZ,
    SPECIMEN,
    begun,
    call,
    command,
    force_kN,
    labjack,
    stand_text,
    until_recorded,
)


def written(folder: Path, text: str) -> Path:
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_recording_is_whole_and_its_figures_are_those_of_the_stand(tmp_path: Path) -> None:
    (tmp_path / "buffer.toml").write_text(SPECIMEN, encoding="utf-8")
    with labjack() as far:
        stand = written(tmp_path, stand_text(far))
        done = call(
            "record", stand, "--out", tmp_path / "runs", "--for", "8s", "--name", "one",
            "--specimen", tmp_path / "buffer.toml",
        )  # fmt: skip
    assert "none lost" in done.stderr
    path = tmp_path / "runs" / "one.h5"
    call("verify", path)
    run = open_run(path)
    assert run.status == "complete"
    assert run.metadata["run"]["record_only"] is True
    assert run.metadata["stand"]["devices"]["acquisition"].startswith("LabJack T7 serial 470012345")
    assert run.metadata["specimen"]["id"] == "buffer-7"
    assert run.gaps("acquisition") == []
    assert run.streams["acquisition"].rows >= 7500
    delivered = run.metadata["streams"]["acquisition"]["raw_units"]
    assert delivered == dict.fromkeys(run.streams["acquisition"].channels, "V")
    for channel in delivered:
        assert run.metadata["datasets"][f"entry/acquisition/{channel}"]["units"] == "V"
    found = json.loads(call("evaluate", path, "--json", "-").stdout)["runs"][0]
    cycles = [cycle for cycle in found["cycles"] if cycle["complete"] and cycle["steady"]]
    assert len(cycles) >= 6
    for cycle in cycles:
        assert cycle["absorbed_energy_J"] == pytest.approx(ABSORBED_J, rel=2e-3)
        assert cycle["amplitude_mm"] == pytest.approx(AMPLITUDE_MM, rel=1e-3)
        assert cycle["frequency_Hz"] == pytest.approx(FREQUENCY_HZ, rel=1e-3)


def test_ctrl_c_is_the_end_of_a_recording_without_a_time(tmp_path: Path) -> None:
    with labjack() as far:
        stand = written(tmp_path, stand_text(far))
        with begun(["record", stand, "--out", tmp_path, "--name", "one"]) as process:
            until_recorded(tmp_path / "one.journal", 2000)
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0
    run = open_run(tmp_path / "one.h5")
    assert (run.status, run.reason) == ("complete", "ended by Ctrl-C (SIGINT)")


def test_an_end_before_its_time_is_stopped(tmp_path: Path) -> None:
    with labjack() as far:
        stand = written(tmp_path, stand_text(far))
        with begun(["record", stand, "--out", tmp_path, "--name", "one", "--for", "10min"]) as process:
            until_recorded(tmp_path / "one.journal", 2000)
            call("stop", tmp_path)
            assert process.wait(60) == 3
    assert open_run(tmp_path / "one.h5").status == "stopped"


def test_kill_9_loses_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    with labjack() as far:
        stand = written(tmp_path, stand_text(far))
        with begun(["record", stand, "--out", tmp_path, "--name", "one"]) as process:
            held = until_recorded(tmp_path / "one.journal", 3000)
            process.kill()
            process.wait(60)
        said = call("verify", tmp_path / "one.journal", status=0)
        assert "bufferstand record --seal" in said.stdout + said.stderr
        call("record", stand, "--out", tmp_path, "--seal")
    run = open_run(tmp_path / "one.h5")
    assert run.status == "recovered"
    assert run.gaps("acquisition") == []
    assert run.streams["acquisition"].rows >= held
    force = run.series("force")
    assert np.ptp(force.value) > 100.0


def test_a_disk_that_takes_no_more_ends_it_with_what_was_kept(tmp_path: Path) -> None:
    """A file-size limit stands for the full disk: the journal fails, and whatever was acknowledged stays."""
    with labjack() as far:
        stand = written(tmp_path, stand_text(far))
        words = shlex.join(command("record", stand, "--out", tmp_path, "--name", "one", "--for", "60s"))
        done = subprocess.run(
            ["bash", "-c", f"ulimit -f 128; exec {words}"],  # in blocks of 1 KiB
            capture_output=True, text=True, timeout=200, cwd=ROOT, check=False,
        )  # fmt: skip
    assert done.returncode == 4, done.stderr
    assert "Traceback" not in done.stderr
    assert "recording failed" in done.stderr + done.stdout or "not sealed" in done.stderr
    if not (tmp_path / "one.h5").exists():
        call("record", stand, "--out", tmp_path, "--seal")
    run = open_run(tmp_path / "one.h5")
    assert run.status in ("failed", "recovered")
    assert run.streams["acquisition"].rows > 0


def test_a_limit_is_warned_of_and_asks_for_a_stop(tmp_path: Path) -> None:
    with labjack() as far:
        text = stand_text(far, keys='stop_output = "FIO2"\nstop_level = "low"')
        text = text.replace("force_max_kN = 600.0", "force_max_kN = 200.0\nask_for_stop = true")
        done = call("record", written(tmp_path, text), "--out", tmp_path, "--for", "4s", "--name", "one")
        lines = [(line, level) for _, line, level in far.device.outputs]
    assert "exceeds the limit of 200.00 kN" in done.stderr
    assert lines == [(2, 1), (2, 0)]
    kinds = [event.kind for event in open_run(tmp_path / "one.h5").events]
    assert kinds.count("stop-asked") == 2
    assert "note" in kinds


def test_without_a_limit_passed_nothing_is_asked(tmp_path: Path) -> None:
    assert force_kN(np.linspace(0.0, 1.0, 1000)).max() < 600.0
    with labjack() as far:
        text = stand_text(far, keys='stop_output = "FIO2"')
        text = text.replace("stroke_max_mm = 150.0", "stroke_max_mm = 150.0\nask_for_stop = true")
        done = call("record", written(tmp_path, text), "--out", tmp_path, "--for", "3s", "--name", "one")
        lines = [(line, level) for _, line, level in far.device.outputs]
    assert lines == [(2, 1)]
    assert "warning" not in done.stderr


def test_a_device_that_falls_silent_is_warned_of_and_the_hole_is_on_record(tmp_path: Path) -> None:
    with labjack() as far:
        stand = written(tmp_path, stand_text(far, keys="buffer_bytes = 4096"))
        with begun(["record", stand, "--out", tmp_path, "--name", "one", "--for", "9s"]) as process:
            until_recorded(tmp_path / "one.journal", 2000)
            far.hold_packets(2.5)
            _, said = process.communicate(timeout=60)
            assert process.returncode == 0, said
    run = open_run(tmp_path / "one.h5")
    gaps = run.gaps("acquisition")
    assert gaps
    assert sum(lost for _, lost in gaps) > 500
    assert "lost" in said
    # What follows the hole is where the device's clock puts it: the force goes on with its own phase.
    time_s, value = run.series("force").time_s, run.series("force").value
    turn = 2.0 * np.pi * FREQUENCY_HZ * time_s
    columns = np.column_stack((np.ones_like(turn), np.cos(turn), np.sin(turn)))
    fit, *_ = np.linalg.lstsq(columns, value, rcond=None)
    assert np.max(np.abs(columns @ fit - value)) < 2.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "force"', 'name = "force_2"', "a record needs force and stroke"),
        ("force_max_kN = 600.0", "force_max_kN = 600.0\nask_for_stop = true", "ask_for_stop needs an output"),
        ("force_max_kN", "force_max", "force_max"),
        ('unit = "kN"', 'unit = "N"', "write unit = “kN”"),
    ],
)
def test_a_stand_file_that_does_not_fit_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    far = labjack()
    with pytest.raises(BadInput) as caught:
        load_recording_stand(written(tmp_path, stand_text(far).replace(old, new)))
    assert message in str(caught.value)
    assert str(tmp_path / "stand.toml") in str(caught.value)


def test_a_stand_with_a_controller_is_for_campaigns(tmp_path: Path) -> None:
    sample = Path(__file__).parents[2] / "sample_runs" / "stand.toml"
    done = call("record", sample, "--out", tmp_path, status=2)
    assert "this stand file has a controller" in done.stderr
    assert "bufferstand run" in done.stderr


@pytest.mark.parametrize("words", [["--for", "10"], ["--for", "0s"], ["--for", "9h9"], ["--name", "../x"]])
def test_words_that_mean_nothing_are_refused(tmp_path: Path, words: list[str]) -> None:
    stand = written(tmp_path, stand_text(labjack()))
    done = call("record", stand, "--out", tmp_path, *words, status=2)
    assert "Traceback" not in done.stderr
    assert "write" in done.stderr


def test_nobody_at_the_address_is_one_message(tmp_path: Path) -> None:
    stand = written(tmp_path, stand_text(labjack()))
    done = call("record", stand, "--out", tmp_path, status=4)
    assert "acquisition at 127.0.0.1:1" in done.stderr
    assert not list(tmp_path.glob("*.h5"))
