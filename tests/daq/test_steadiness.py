"""A step that ends when it has settled: seen live, by the same functions as evaluate the run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.motions.steadiness import last_cycle
from bufferstand.recording.runfile.file import open_run
from tests.daq.test_in_process import run

SETTLING = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0

[step.until_steady]
damping_percent = DAMPING
stiffness_percent = 5.0
window = 3
min_cycles = 4
max_cycles = 12
"""


def test_an_ellipse_has_the_damping_and_stiffness_of_its_closed_form() -> None:
    time_s = np.arange(2600) / 1000.0
    stroke = 20.0 + 5.0 * np.sin(2 * np.pi * time_s - 0.7)
    force = 3.0 * stroke + 5.0 * np.cos(2 * np.pi * time_s - 0.7)
    damping, stiffness = last_cycle(time_s, stroke, force)
    assert stiffness == pytest.approx(np.hypot(3.0, 1.0), rel=1e-3)
    assert damping > 0.0
    assert np.isnan(last_cycle(time_s[:300], stroke[:300], force[:300])).all()


@pytest.mark.slow
def test_a_step_ends_when_its_cycles_have_settled_and_is_complete(tmp_path: Path) -> None:
    outcome, opened, _ = run(tmp_path, SETTLING.replace("DAMPING", "20.0"))
    assert (outcome.status, outcome.exit_status) == ("complete", 0), outcome.reason
    found = open_run(outcome.runs[0])
    (text,) = [event.text for event in found.events if event.text.startswith("settled after")]
    record = load_record(tmp_path / "out")
    assert record is not None
    cycles = record.steps[0].cycles_done
    assert 4 <= cycles < 12
    assert text.startswith(f"settled after {cycles} cycles: damping 0.")
    assert not opened.device.controller.valve_on


@pytest.mark.slow
def test_a_step_that_does_not_settle_ends_after_its_most_cycles(tmp_path: Path) -> None:
    outcome, _, _ = run(tmp_path, SETTLING.replace("DAMPING", "0.001"))
    assert outcome.status == "complete"
    events = [event.text for event in open_run(outcome.runs[0]).events]
    assert "not settled after 12 cycles, the most that were planned" in events
