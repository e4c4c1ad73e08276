"""A campaign's folder from a wrong port to its end, by real processes on a stand that another one serves."""

from __future__ import annotations

import json
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bufferstand.recording.runfile.file import open_run
from tests.clean_stand import clean_stand_text
from tests.main_job.conftest import bufferstand

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"
SPECIMEN = "A-105-E-01"
HEAD = """[campaign]
id = "folder"
stand = "stand.toml"
specimen = "specimens/category-a-elastomer.toml"
[limits]
temperature_stop_C = 60.0
temperature_resume_C = 59.0
[guards]
lag_stop_s = 30.0
"""
STEP = """
[[step]]
kind = "harmonic"
name = "{name}"
prestress_mm = 20.0
amplitude_mm = {amplitude}
frequency_Hz = 2.0
cycles = {cycles}
"""


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@contextmanager
def served(lab: Path) -> Iterator[None]:
    """Serve the laboratory's stand, as in another terminal."""
    endpoints = lab / "endpoints.json"
    words = [
        "simulate-stand",
        str(lab / "stand.toml"),
        "--wires",
        str(lab / "wires"),
        "--endpoints",
        str(endpoints),
    ]
    process = subprocess.Popen([sys.executable, "-P", "-m", "bufferstand", *words], stdout=subprocess.DEVNULL)
    try:
        while not endpoints.exists():
            assert process.poll() is None
            time.sleep(0.05)
        yield
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)


def run_until_second_step(campaign: Path, out: Path) -> tuple[int, str]:
    """Start it, press Ctrl-C in its second step; return how it ended and what it said."""
    words = ["run", str(campaign), "--out", str(out), "--yes-move", SPECIMEN]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand", *words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while process.poll() is None and not list((out / "runs").glob("002-*")):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=300)
    return process.returncode, told


def test_from_a_refused_start_through_an_edit_to_the_end(tmp_path: Path) -> None:
    lab, out = tmp_path / "lab", tmp_path / "out"
    shutil.copytree(SAMPLES / "specimens", lab / "specimens")
    shutil.copytree(SAMPLES / "models", lab / "models")
    right, wrong = free_port(), free_port()
    stand, campaign = lab / "stand.toml", lab / "folder.toml"
    text = clean_stand_text()  # its round trips are this computer's, which must keep up
    stand.write_text(text.replace("port = 15020", f"port = {right}"))
    steps = STEP.format(name="one", amplitude=5, cycles=2) + STEP.format(name="two", amplitude=6, cycles=40)
    campaign.write_text(HEAD + steps)
    with served(lab):
        stand.write_text(text.replace("port = 15020", f"port = {wrong}"))
        run = ("run", campaign, "--out", out, "--yes-move", SPECIMEN)
        for _ in range(2):  # given once more without mending anything, it says the same
            refused = bufferstand(*run)
            assert refused.returncode == 4
            assert f"127.0.0.1:{wrong}" in refused.stderr.splitlines()[-1]
            assert "nothing is recorded: give the same command again when it is mended" in refused.stderr
        assert "the start before recorded nothing (refused: " in refused.stderr
        stand.write_text(stand.read_text().replace(str(wrong), str(right)))
        status, told = run_until_second_step(campaign, out)
        assert status == 3, told
        assert "it begins anew with the files as they are now" in told
        assert f"go on with it: bufferstand resume {out}" in told.splitlines()[-1]
        assert str(right) in (out / "inputs/stand.toml").read_text(), "no copy of the wrong port stays"
        again = bufferstand(*run)
        assert again.returncode == 2
        assert "this folder holds a campaign already (1 of 2 steps complete)" in again.stderr
        edited = campaign.read_text().replace("cycles = 40", "cycles = 3")
        campaign.write_text(edited + STEP.format(name="three", amplitude=7, cycles=2))
        asked = bufferstand("resume", out, "--yes-move", SPECIMEN)
        assert asked.returncode == 2
        assert "folder.toml (+9 −1 lines); add --take-edits" in asked.stderr.splitlines()[-1]
        unarmed = bufferstand("resume", out, "--take-edits")
        assert unarmed.returncode == 2
        assert f"add --yes-move {SPECIMEN}" in unarmed.stderr.splitlines()[-1]
        done = bufferstand("resume", out, "--take-edits", "--yes-move", SPECIMEN)
        assert done.returncode == 0, done.stderr
        assert "first motion  step 2 of 3 “two”" in done.stderr
    record = json.loads((out / "campaign.json").read_text())
    assert [step["status"] for step in record["steps"]] == ["complete"] * 3
    assert [len(step["runs"]) for step in record["steps"]] == [1, 1, 1], "the first was not repeated"
    assert len(list((out / "runs").glob("001-*.h5"))) == 1
    assert [start["arming"]["subject_id"] for start in record["starts"]] == [SPECIMEN] * 4
    edits = [start.get("edits", {}).get("how", "") for start in record["starts"]]
    assert edits == ["", "", "", "--take-edits"], "run takes the present files without asking"
    kept = out / record["starts"][-1]["edits"]["kept"] / "folder.toml"
    assert kept.read_text() == HEAD + steps
    last = open_run(out / record["steps"][-1]["runs"][0])
    assert last.metadata["arming"]["how"] == "--yes-move"
    run = last.metadata["run"]
    assert (run["simulated"], run["simulated_by"]) == (True, "the controller says so itself")
