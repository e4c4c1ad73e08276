"""`resume` after a kill over wires of several round trips, in virtual time: no sample is lost in silence."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, behind_a_wire, open_in_process
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.errors import ExitStatus
from bufferstand.foundation.motions import RampTo
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import Lines
from tests.daq.killed_over_a_wire import CYCLES_DONE, profile_of
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign

STEPS = """
[[step]]
kind = "static"
speed_mm_per_s = 20.0
force_limit_kN = 100.0
cycles = 1
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 6
"""
CYCLES_LEFT_S = 6.0
"""The step is done again: six cycles at 1 Hz."""
FORGOTTEN_S = 12.0
"""After so long the watchdog has acted, and the writer's lock is free."""


def left_behind(stand_file: StandFile, round_trip_s: float, how: str) -> InProcessStand:
    """Return a stand as a killed program leaves it: loaded, then released by its own watchdog, in fault."""
    opened = open_in_process(stand_file)
    controller = behind_a_wire(opened, stand_file, lambda: round_trip_s, profile_of(how)).controller
    controller.connect()
    controller.enable(force_limit_kN=200.0, stroke_limit_mm=100.0, watchdog_ms=2000)
    controller.start(RampTo(target_mm=20.0, speed_mm_per_s=20.0))
    opened.clock.sleep(1.5)
    assert opened.truth.arrays()["force_kN"][-1] > 5.0
    opened.clock.sleep(FORGOTTEN_S)
    assert not opened.device.controller.valve_on
    return opened


@pytest.mark.parametrize(
    ("round_trip_ms", "how"),
    [
        pytest.param(0.04, "together", marks=pytest.mark.long),
        pytest.param(5.0, "together", marks=pytest.mark.long),
        (10.0, "together"),
        (2.0, "apart"),
        pytest.param(4.5, "apart", marks=pytest.mark.long),
    ],
)
def test_a_killed_campaign_is_resumed_at_any_round_trip_that_keeps_up(
    tmp_path: Path, round_trip_ms: float, how: str
) -> None:
    file, out = campaign(tmp_path, STEPS), tmp_path / "out"
    words = ["-P", "-m", "tests.daq.killed_over_a_wire", str(file), str(out), str(round_trip_ms), how]
    killed = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert killed.returncode == -signal.SIGKILL, killed.stderr

    plan, stand_file = sample_plan(file)
    opened = left_behind(stand_file, round_trip_ms / 1e3, how)
    stand = behind_a_wire(opened, stand_file, lambda: round_trip_ms / 1e3, profile_of(how))
    began_us, shown = opened.truth.arrays()["time_us"][-1], Lines()
    outcome = run_campaign(plan, stand, opened.clock, out, facts_of(stand_file), progress=shown)
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    assert any(line.startswith("recovered 002-harmonic") for line in shown.lines)
    assert not opened.device.controller.valve_on

    static, part, again = sorted((out / "runs").glob("*.h5"))
    assert outcome.runs == (again,), "the static step was complete and stays so"
    assert [open_run(path).status for path in (static, part, again)] == ["complete", "recovered", "complete"]
    before = np.asarray(open_run(part).stream_of("force").time)
    assert np.all(np.diff(before) == 1000), "what was recorded before the kill has no hole"
    assert len(before) > 500 * CYCLES_DONE

    found, truth_us = open_run(again), opened.truth.arrays()["time_us"]
    time_us = np.asarray(found.stream_of("force").time)
    inside = (truth_us >= time_us[0]) & (truth_us <= time_us[-1])
    assert np.array_equal(truth_us[inside], time_us), "every sample of the second part is there, once"
    assert time_us[0] > began_us - 200_000, "the ring's history is not of this run"
    assert time_us[-1] - time_us[0] > 1e6 * CYCLES_LEFT_S
    assert found.gaps("controller") == []
    assert not [event.text for event in found.events if event.kind == "trip"]
