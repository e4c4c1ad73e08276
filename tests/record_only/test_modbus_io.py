"""Record-only mode with Modbus I/O alone: a WAGO node with force, stroke and a Pt100 whose wire breaks."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bufferstand.foundation.clock import steady_s
from bufferstand.recording.runfile.file import open_run
from tests.house.house_page import ROOT
from tests.peers.modbus_io.wago import Module, WagoNode, pt100_word, ten_volt_word
from tests.peers.modbus_io.wire import Server
from tests.record_only.bench import (
    ABSORBED_J,
    AMPLITUDE_MM,
    FREQUENCY_HZ,
    SPECIMEN,
    call,
    channel,
    command,
    force_kN,
    stroke_mm,
)

STAND = """
[stand]
id = "vendor"
name = "A stand that its maker's controller moves"

[limits]
force_max_kN = 600.0
stroke_max_mm = 150.0

[[acquisition]]
kind = "modbus-io"
description = "wago-750-10v"
answers = {{ first_word = 0 }}
host = "127.0.0.1"
port = {port}
rate_Hz = 50.0
stamp_within_s = 0.01

[[acquisition.input]]
point = "AI1"
channel = {force}

[[acquisition.input]]
point = "AI2"
channel = {stroke}

[[acquisition]]
kind = "modbus-io"
description = "wago-750-pt100"
answers = {{ first_word = 2 }}
host = "127.0.0.1"
port = {port}
rate_Hz = 5.0
device_id = 2

[[acquisition.input]]
point = "AI1"
channel = {{ name = "temperature_1", quantity = "temperature", unit = "°C", place = "specimen", calibration = {{ id = "Pt100", coefficients = [0.0, 1.0] }} }}
"""  # noqa: E501 - as a user writes it


def now(of: object) -> float:
    return float(of(np.array([steady_s()]))[0])  # type: ignore[operator]


def test_a_node_is_recorded_checked_evaluated_and_its_open_wire_is_no_temperature(tmp_path: Path) -> None:
    began_s = float("inf")
    node = WagoNode(
        [
            Module(
                [
                    lambda: ten_volt_word(now(force_kN) / 63.0),
                    lambda: ten_volt_word(now(stroke_mm) / 50.0),
                ]
            ),
            Module(
                [
                    lambda: pt100_word(
                        23.4 if steady_s() < began_s or (steady_s() - began_s) % 4.0 < 2.0 else 1e9
                    )
                ]
            ),
        ]
    )
    stand = tmp_path / "stand.toml"
    with Server(node) as far:
        stand.write_text(
            STAND.format(
                port=far.port,
                force=channel("force", "force", "kN", 63.0, ", u_delay_s = 2e-4"),
                stroke=channel("stroke_1", "stroke", "mm", 50.0, ", linearity = 0.1"),
            ),
            encoding="utf-8",
        )
        # On a busy computer late polls are gaps, and a check says so (exit status 4).
        checked = subprocess.run(
            command("check", stand, "--watch", "1"),
            capture_output=True,
            text=True,
            timeout=200,
            cwd=ROOT,
            check=False,
        )
        assert checked.returncode in {0, 4}, checked.stderr
        (tmp_path / "specimen.toml").write_text(SPECIMEN, encoding="utf-8")
        began_s = steady_s()
        done = call(
            "record", stand, "--out", tmp_path / "runs", "--for", "9s", "--name", "one",
            "--specimen", tmp_path / "specimen.toml",
        )  # fmt: skip
    assert "WAGO 750-456" in checked.stdout
    assert "is stamped with the middle of its poll" in checked.stdout
    assert "a wire is broken" in done.stderr
    run = open_run(tmp_path / "runs" / "one.h5")
    assert {name: stream.clock for name, stream in run.streams.items()} == {
        "acquisition": "host",
        "acquisition_2": "host",
    }
    described = run.metadata["stand"]["descriptions"]
    assert described["acquisition"]["id"] == "wago-750-10v"
    assert described["acquisition_2"]["point"][0]["fault"][0]["raw"] == 8500
    assert np.ptp(run.series("stroke_1").value) / 2.0 == pytest.approx(AMPLITUDE_MM, rel=0.02)
    warm = run.series("temperature_1").value
    assert set(np.round(warm[np.isfinite(warm)], 3)) == {23.4}
    found = json.loads(call("evaluate", run.path, "--json", "-").stdout)["runs"][0]
    assert len(found["cycles"]) >= 5
    whole = [cycle for cycle in found["cycles"] if cycle["complete"] and cycle["absorbed_energy_J"]]
    for cycle in whole:
        assert cycle["amplitude_mm"] == pytest.approx(AMPLITUDE_MM, rel=0.02)
        assert cycle["frequency_Hz"] == pytest.approx(FREQUENCY_HZ, rel=0.03)
    if whole:  # a busy computer polls too rarely for figures, and then says so
        assert np.median([one["absorbed_energy_J"] for one in whole]) == pytest.approx(ABSORBED_J, rel=0.05)
