"""``run`` and ``resume`` on the simulated stand's wires: exit statuses, folders, what is kept."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from bufferstand.recording.runfile.file import open_run
from tests.main_job.conftest import bufferstand, here

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"
STEP = "[[step]]\n"
CAMPAIGN = """
[campaign]
id = "short"
stand = "{samples}/stand.toml"
specimen = "{samples}/specimens/category-a-elastomer.toml"
[limits]
temperature_stop_C = {stop}
temperature_resume_C = {resume}
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 10.0
frequency_Hz = 1.0
cycles = 3
[[step]]
kind = "harmonic"
prestress_mm = 78.0
amplitude_mm = 15.0
peak_speed_mm_per_s = 80.0
cycles = {cycles}
"""


def write_campaign(folder: Path, *, stop: float, cycles: int, steps: int = 2) -> Path:
    path = folder / "campaign file.toml"
    head, *written = CAMPAIGN.format(samples=SAMPLES, stop=stop, resume=stop - 0.5, cycles=cycles).split(STEP)
    path.write_text(STEP.join([head, *written[:steps]]), encoding="utf-8")
    return path


def test_complete_campaign_ends_with_0_and_is_not_run_twice_into_one_folder(tmp_path: Path) -> None:
    campaign, out = write_campaign(tmp_path, stop=40.0, cycles=3), tmp_path / "out"
    done = bufferstand("run", campaign, "--out", out, "--simulate", "--speed", "6")
    assert done.returncode == 0, done.stderr
    assert [open_run(path).status for path in sorted((out / "runs").glob("*.h5"))] == ["complete"] * 2
    again = bufferstand("run", campaign, "--out", out, "--simulate")
    assert again.returncode == 2
    assert "holds a campaign already" in again.stderr
    resumed = bufferstand("resume", out, "--simulate", "--speed", "6")
    assert resumed.returncode == 0, resumed.stderr
    assert len(list((out / "runs").glob("*.h5"))) == 2  # nothing was repeated


def test_temperature_stop_ends_with_3_at_zero_force_and_keeps_the_data(tmp_path: Path) -> None:
    campaign, out = write_campaign(tmp_path, stop=22.5, cycles=200), tmp_path / "out"
    done = bufferstand("run", campaign, "--out", out, "--simulate", "--speed", "6")
    assert done.returncode == 3, done.stderr
    last = done.stderr.strip().splitlines()[-1]
    assert "has reached the stop threshold of 22.5 °C" in last
    assert re.search(r"safe stop: force -?0\.\d kN \(channel force, zero taken off\)", last), last
    assert "valve off" in last
    run = open_run(sorted((out / "runs").glob("*.h5"))[-1])
    assert run.status == "stopped"
    assert "22.5 °C" in run.reason
    force, temperature = run.series("force").value, run.series("temperature_1").value
    assert force.max() > 300.0
    assert abs(float(np.mean(force[-200:]))) < 1.0
    (trip,) = [event for event in run.events if event.data.get("guard") == "temperature_1"]
    assert trip.data["value"] == temperature[temperature >= 22.5][0]  # the first reading that is too warm
    record = json.loads((out / "campaign.json").read_text())
    assert [step["status"] for step in record["steps"]] == ["complete", "stopped"]
    # A new simulated stand has its specimen at room temperature: it goes on, and gets too warm once more.
    resumed = bufferstand("resume", out, "--simulate", "--speed", "6")
    assert resumed.returncode == 3, resumed.stderr


@pytest.mark.long
def test_a_polled_stand_a_hundred_times_as_fast_waits_for_who_polls_it(tmp_path: Path) -> None:
    """It completes, slower than asked; every poll that was due was made."""
    text = (SAMPLES / "stand.toml").read_text("utf-8")
    text = text.replace('profile = "ring"', 'profile = "polling"')
    text = text.replace('model = "models/', f'model = "{SAMPLES}/models/')
    (tmp_path / "stand.toml").write_text(text, encoding="utf-8")
    campaign, out = write_campaign(tmp_path, stop=40.0, cycles=3, steps=1), tmp_path / "out"
    text = campaign.read_text("utf-8").replace(f"{SAMPLES}/stand.toml", str(tmp_path / "stand.toml"))
    campaign.write_text(text, encoding="utf-8")
    done = bufferstand("run", campaign, "--out", out, "--simulate", "--speed", "100")
    assert done.returncode == 0, done.stderr
    (path,) = (out / "runs").glob("*.h5")
    run = open_run(path)
    assert run.status == "complete"
    assert run.gaps("controller") == []
    assert not [event for event in run.events if event.kind == "trip"]
    stroke = run.series("stroke_1")
    steps_s = np.diff(stroke.time_s)
    assert np.median(steps_s) == pytest.approx(0.01, abs=0.002)
    assert steps_s.max() <= 0.05
    # Polls are stamped by the stand's own time, whatever this computer took: the sine has its frequency.
    above = stroke.value > 20.0
    cycles_s = np.diff(stroke.time_s[1:][above[1:] & ~above[:-1]])
    full = cycles_s[np.abs(cycles_s - 1.0) < 0.2]
    assert full.size >= 3
    assert np.median(full) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("speed", ["0", "1000", "fast"])
def test_absurd_speeds_are_refused(tmp_path: Path, speed: str) -> None:
    campaign = write_campaign(tmp_path, stop=40.0, cycles=3)
    done = here("run", campaign, "--out", tmp_path / "out", "--simulate", "--speed", speed)
    assert done.returncode == 2
    assert "--speed" in done.stderr
    assert not (tmp_path / "out").exists()
