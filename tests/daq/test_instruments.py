"""A stand with three force channels and a pressure gauge: in virtual time, and over its wires."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.drivers.check.devices import check_stand
from bufferstand.drivers.check.verdict import Verdict
from bufferstand.drivers.simulated.faults.schedule import parse_fault
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import with_endpoints
from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.record.by_quantity import channels_of_quantity
from bufferstand.foundation.clock import WallClock
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import SAMPLES, Lines
from tests.daq.run_in_process import facts_of, sample_plan
from tests.drivers.test_instrument_catalogue import stand_with

STEP = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 5
"""


def written(folder: Path) -> Path:
    """Write a campaign on a stand with further instruments."""
    stand_with(folder)
    campaign, specimen = folder / "campaign.toml", SAMPLES / "specimens" / "category-a-elastomer.toml"
    content = f'[campaign]\nid = "test"\nstand = "stand.toml"\nspecimen = "{specimen}"\n{STEP}'
    campaign.write_text(content, encoding="utf-8")
    return campaign


@pytest.mark.slow
def test_each_is_recorded_as_a_stream_and_watched_for_silence(tmp_path: Path) -> None:
    plan, stand_file = sample_plan(written(tmp_path))
    opened, shown = open_in_process(stand_file), Lines()
    out = tmp_path / "out"
    outcome = run_campaign(plan, opened.stand, opened.clock, out, facts_of(stand_file), progress=shown)
    opened.stand.close()
    assert outcome.exit_status == 0, shown.lines
    (path,) = (out / "runs").glob("*harmonic*.h5")
    run = open_run(path)
    assert {"amplifier", "amplifier_2", "sensor"} <= run.streams.keys()
    (pressure,) = channels_of_quantity(run, "pressure")
    force = run.series("force")
    kN = np.interp(pressure.time_s, force.time_s, force.value)
    assert np.corrcoef(pressure.value, kN)[0, 1] > 0.999
    third = run.series("force_3")
    assert np.max(np.abs(third.value - np.interp(third.time_s, force.time_s, force.value))) < 8.0
    watched = {one["stream"] for one in run.metadata["limits"]["guards"]["silences"]}
    assert watched == {"amplifier", "amplifier_2", "sensor"}
    entry = evaluate_paths([path], Options(draws=100))["runs"][0]
    assert entry["summary"]["amplitude_mm"]["value"] == pytest.approx(5.0, abs=0.1)


@pytest.mark.slow
def test_a_silent_sensor_is_named(tmp_path: Path) -> None:
    plan, stand_file = sample_plan(written(tmp_path))
    opened, shown = open_in_process(stand_file, faults=[parse_fault("sensor=silent@1")]), Lines()
    out = tmp_path / "out"
    run_campaign(plan, opened.stand, opened.clock, out, facts_of(stand_file), progress=shown)
    opened.stand.close()
    said = [line for line in shown.lines if "sensor has delivered nothing for" in line]
    assert len(said) == 1, shown.lines


@pytest.mark.slow
def test_each_answers_on_its_own_wire(tmp_path: Path) -> None:
    stand_file = load_stand(stand_with(tmp_path))
    with start_process(tmp_path / "stand.toml", directory=tmp_path / "run") as process:
        assert process.served.instruments.keys() == {"amplifier", "amplifier_2", "sensor", "thermometers"}
        reached = with_endpoints(stand_file, process.served.endpoints())
        rows = check_stand(reached, WallClock(), watch_s=0.0)
    found = {(row.device, row.item): row for row in rows}
    for device, name in (("amplifier", "force_2"), ("amplifier_2", "force_3"), ("sensor", "pressure_1")):
        assert found[device, name].verdict is Verdict.OK, found[device, name]
    assert found["amplifier_2", "force − force_3"].verdict is Verdict.OK
