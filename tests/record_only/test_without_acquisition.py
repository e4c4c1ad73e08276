"""Record-only mode without an acquisition device: every instrument of the stand file is one to record."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.register_maps.amplifier_map import load_amplifier_map
from bufferstand.foundation.clock import steady_s
from bufferstand.recording.runfile.file import open_run
from tests.drivers.amplifiers import RegisterAmplifier
from tests.record_only.bench import AMPLIFIER, AMPLITUDE_MM, FREQUENCY_HZ, amplifier, call, stroke_mm

HEAD = """
[stand]
id = "vendor"
name = "A stand that its maker's controller moves"

[[sensor]]
kind = "modbus"
rate_Hz = 100.0
channel = {{ name = "stroke_1", quantity = "stroke", unit = "mm", calibration = {{ id = "wire", coefficients = [0.0, 1.0] }} }}
modbus = {{ map = "dms-float", host = "127.0.0.1", tcp_port = {port} }}
"""  # noqa: E501 - as a user writes it


@contextmanager
def draw_wire(folder: Path) -> Iterator[RegisterAmplifier]:
    """Have a transmitter with registers that measures the stroke of the same stand."""
    far = RegisterAmplifier(load_amplifier_map("dms-float", folder), 1000.0)
    ended = threading.Event()

    def measure() -> None:
        while not ended.wait(0.002):
            far.measure(float(stroke_mm(np.array([steady_s()]))[0]))

    thread = threading.Thread(target=measure)
    thread.start()
    try:
        yield far
    finally:
        ended.set()
        thread.join()
        far.close()


def test_an_amplifier_and_a_transmitter_are_recorded_and_evaluated(tmp_path: Path) -> None:
    with draw_wire(tmp_path) as wire, amplifier(tmp_path, steady_s):
        stand = tmp_path / "stand.toml"
        stand.write_text(HEAD.format(port=wire.port) + AMPLIFIER, encoding="utf-8")
        call("record", stand, "--out", tmp_path / "runs", "--for", "8s", "--name", "one")
    run = open_run(tmp_path / "runs" / "one.h5")
    assert {name: stream.clock for name, stream in run.streams.items()} == {
        "amplifier": "host",
        "sensor": "host",
    }
    stroke = run.series("stroke_1")
    assert np.ptp(stroke.value) / 2.0 == pytest.approx(AMPLITUDE_MM, rel=0.02)
    assert np.ptp(run.series("force").value) > 100.0
    found = json.loads(call("evaluate", run.path, "--json", "-").stdout)["runs"][0]
    # On a busy computer polls come late: cycles whose stroke is not known well enough are no figures.
    assert len(found["cycles"]) >= 5
    for cycle in found["cycles"]:
        if cycle["complete"]:
            assert cycle["amplitude_mm"] == pytest.approx(AMPLITUDE_MM, rel=0.02)
            assert cycle["frequency_Hz"] == pytest.approx(FREQUENCY_HZ, rel=0.03)
