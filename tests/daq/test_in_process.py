"""The runner on the simulated stand's physics in virtual time, and as a program that is interrupted."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.drivers.interfaces import MotionState
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.verification import verify
from tests.clean_stand import clean_stand_text
from tests.daq.cases import SAMPLES, Lines
from tests.daq.run_in_process import facts_of, sample_plan

WARMING = """
[[step]]
kind = "harmonic"
prestress_mm = 60.0
amplitude_mm = 20.0
frequency_Hz = 1.2
cycles = 40
"""
GENTLE = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 8
"""


NO_TOUCH = "[zero]\ntouch = false\n"
"""What is timed by the stand's clock begins with the first step then."""


def campaign(folder: Path, steps: str, *, initial_C: float = 21.0, zero: str = NO_TOUCH) -> Path:
    """Write a campaign for the shipped stand with a specimen of some temperature."""
    stand = clean_stand_text()
    model = SAMPLES / "models" / "category-a-elastomer.toml"
    stand = stand.replace('model = "models/category-a-elastomer.toml"', f'model = "{model}"')
    stand = stand.replace("initial_C = 21.0", f"initial_C = {initial_C}")
    (folder / "stand.toml").write_text(stand, encoding="utf-8")
    specimen = SAMPLES / "specimens" / "category-a-elastomer.toml"
    path = folder / "campaign.toml"
    path.write_text(
        f'[campaign]\nid = "test"\nstand = "stand.toml"\nspecimen = "{specimen}"\n{zero}{steps}',
        encoding="utf-8",
    )
    return path


def run(
    folder: Path, steps: str, *, initial_C: float = 21.0, faults: Sequence[ScheduledFault] = ()
) -> tuple[CampaignOutcome, InProcessStand, Lines]:
    plan, stand_file = sample_plan(campaign(folder, steps, initial_C=initial_C))
    opened = open_in_process(stand_file, faults=faults)
    shown = Lines()
    facts = facts_of(stand_file)
    outcome = run_campaign(plan, opened.stand, opened.clock, folder / "out", facts, progress=shown)
    opened.stand.close()
    return outcome, opened, shown


PROOF = """
[[step]]
kind = "static"
proof_load = "F3"
force_limit_kN = 206.0
speed_mm_per_s = 20.0
"""


def test_a_proof_step_is_recorded_and_judged_as_the_proof_load_that_it_names(tmp_path: Path) -> None:
    outcome, _, _ = run(tmp_path, PROOF)
    assert outcome.exit_status == 0
    found = open_run(outcome.runs[0])
    assert (found.kind, found.step["proof_load"]) == ("proof", "F3")
    (entry,) = evaluate_paths([outcome.runs[0]], Options(draws=50))["runs"]
    verdicts = {row["id"]: row["verdict"] for row in entry["requirements"]}
    assert verdicts["proof-load-f3"] == "pass", "206 kN of at least 200"
    # The tolerance is the maker's, and nobody has looked at the buffer yet.
    assert (verdicts["permanent-deformation"], verdicts["serviceable-condition"]) == (
        "inconclusive",
        "not-tested",
    )
    deformation = next(r for r in entry["requirements"] if r["id"] == "permanent-deformation")
    assert deformation["measured"] == pytest.approx(0.0, abs=0.5), "the record begins and ends relieved"


def test_forty_degrees_stop_the_stand_at_zero_force_with_the_data_kept(tmp_path: Path) -> None:
    outcome, opened, _ = run(tmp_path, WARMING, initial_C=38.5)
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert "has reached the stop threshold of 40 °C" in outcome.reason
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.safe
    assert opened.truth.arrays()["force_kN"][-1] == pytest.approx(0.0, abs=0.5)
    assert not opened.device.controller.valve_on
    found = open_run(outcome.runs[0])
    assert (found.status, found.reason) == ("stopped", outcome.reason)
    assert [finding for finding in verify(outcome.runs[0]) if finding.level not in ("ok", "note")] == []
    trip = next(event for event in found.events if event.kind == "trip")
    for name in ("temperature_1", "temperature_2"):
        reading = found.series(name)
        assert reading.value[reading.time_s <= trip.time_s].max() < 40.5  # one a second: it never runs away
        assert reading.value.max() < 41.5  # afterwards the plate only follows what the spring has already
    assert found.series("temperature_1").value.max() >= 40.0
    stop = next(event for event in found.events if event.kind == "safe stop")
    assert stop.time_s - trip.time_s < 80.0 / 20.0 + 2.0  # 80 mm at 20 mm/s
    force = found.series("force")
    assert abs(force.value[-1]) < 2.0  # the release is in the run
    assert force.value[force.time_s < trip.time_s].max() > 150.0


@pytest.mark.parametrize(
    ("fault", "said", "exit_status", "guard"),
    [
        (
            ScheduledFault("temperature_1", "silent", 2.0),
            "temperature_1 (spring plate 3) has given no true",
            4,
            "t",
        ),
        (ScheduledFault("temperature_2", "power-on", 2.0), "power-on value", 4, "t"),
        (ScheduledFault("controller", "lost", 3.0, 7.0), "the controller or its wire failed", 4, "c"),
    ],
)
def test_a_fault_of_the_stand_ends_safe(
    tmp_path: Path, fault: ScheduledFault, said: str, exit_status: int, guard: str
) -> None:
    outcome, opened, _ = run(tmp_path, GENTLE, faults=[fault])
    assert outcome.exit_status == exit_status
    assert said in outcome.reason
    assert outcome.safe_stop is not None
    found = open_run(outcome.runs[0])
    assert found.status == ("failed" if guard == "c" else "stopped")
    opened.clock.sleep(8.0)
    truth = opened.truth.arrays()
    assert truth["force_kN"][-1] == pytest.approx(0.0, abs=0.5)
    assert not opened.device.controller.valve_on
    assert len(found.series("force").value) > 1000


def test_an_outage_of_the_wire_beyond_its_leeway_is_told_truthfully(tmp_path: Path) -> None:
    outcome, _, _ = run(tmp_path, GENTLE, faults=[ScheduledFault("controller", "lost", 5.0, 7.5)])
    assert outcome.exit_status == 4
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.safe  # the wire came back within the safe stop's patience
    assert outcome.safe_stop.state is MotionState.FAULT, "its own watchdog has unloaded it"
    assert "the controller or its wire failed" in outcome.reason
    assert "its watchdog (2 s) acts by itself" in outcome.reason


def test_silence_of_the_air_sensor_or_of_the_amplifier_does_not_stop(tmp_path: Path) -> None:
    faults = [ScheduledFault("temperature_3", "silent", 3.0), ScheduledFault("amplifier", "silent", 3.0)]
    outcome, _, shown = run(tmp_path, GENTLE, faults=faults)
    assert outcome.status == "complete"
    assert any(line.startswith("note: temperature_3 (air beside the stand)") for line in shown.lines)


def test_the_same_campaign_gives_the_same_samples(tmp_path: Path) -> None:
    runs = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        outcome, _, _ = run(tmp_path / name, GENTLE.replace("cycles = 8", "cycles = 1"))
        runs.append(open_run(outcome.runs[0]))
    for channel in ("force", "stroke_1", "command", "force_2", "temperature_1"):
        one, two = (found.series(channel) for found in runs)
        assert np.array_equal(one.value, two.value)
    assert runs[0].gaps("controller") == []


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_a_signal_to_a_running_campaign_ends_it_safe_with_whole_files(
    tmp_path: Path, number: signal.Signals
) -> None:
    path = campaign(tmp_path, GENTLE + WARMING)
    command = [sys.executable, "-m", "tests.daq.run_in_process", str(path), str(tmp_path / "out")]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=SAMPLES.parent
    ) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        for line in child.stdout:
            if line.startswith("MOVING"):
                break
        child.send_signal(number)
        child.send_signal(number)  # an impatient second one changes nothing
        rest, errors = child.communicate()
    assert child.returncode == 3, errors
    assert "Traceback" not in errors
    force, valve_on = rest.splitlines()[-1].removeprefix("END ").split()
    assert float(force) == pytest.approx(0.0, abs=0.5)
    assert valve_on == "False"
    files = sorted((tmp_path / "out" / "runs").iterdir())
    assert [file.suffix for file in files] == [".h5"]
    found = open_run(files[0])
    assert found.status == "stopped"
    assert found.reason.startswith("stopped by the operator: ")
    assert [finding for finding in verify(files[0]) if finding.level not in ("ok", "note")] == []


HOLD_AT_FORCE = """
[[step]]
kind = "hold"
force_kN = 100.0
duration_s = 3.0
record = true
"""


def test_a_hold_at_a_force_stands_where_the_force_is_reached(tmp_path: Path) -> None:
    outcome, _, _ = run(tmp_path, HOLD_AT_FORCE)
    assert (outcome.status, outcome.exit_status) == ("complete", 0), outcome.reason
    force = open_run(outcome.runs[0]).series("force").value
    assert 100.0 <= force.max() < 101.5  # 1 mm/s, about 5 kN/mm, and a pass of the loop late
    command = open_run(outcome.runs[0]).series("command").value
    top = command.max()
    assert np.count_nonzero(command == top) >= 3000, "it stands there for three seconds"
