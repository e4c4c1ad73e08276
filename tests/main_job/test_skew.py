"""``bufferstand skew`` and ``evaluate --moving-mass`` on real processes and imported records."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.test_alignment import elastic
from tests.main_job.conftest import bufferstand

SKEW_S = 8e-4


@pytest.fixture(scope="module")
def spring(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of runs on an elastic spring at 0.5 and 2 Hz whose force is 0.8 ms late."""
    folder = tmp_path_factory.mktemp("spring")
    files = []
    for frequency in (0.5, 2.0):
        record = elastic(frequency, SKEW_S, loss=0.003, cycles=6.5, rate_Hz=500.0)
        files.append(folder / f"{frequency:g}Hz.csv")
        with files[-1].open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(["time [s]", "stroke [mm]", "force [kN]"])
            columns = (record.time_s, record.stroke_mm, record.force_kN)
            writer.writerows(np.column_stack(columns).round(9).tolist())
    done = bufferstand("import", *files, "--out", folder / "runs", "--kind", "harmonic")
    assert done.returncode == 0, done.stderr
    return folder / "runs"


def test_skew_is_measured_and_what_to_write_is_said(spring: Path) -> None:
    done = bufferstand("skew", spring)
    assert done.returncode == 0, done.stderr
    assert "the force is 0.8000 ms late" in done.stdout
    assert "delay_s = 0.000800" in done.stdout
    assert "what 1 ms changes" in done.stdout


def test_skew_as_json(spring: Path) -> None:
    done = bufferstand("skew", spring, "--json", "-")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["skew"]["delay_s"] == pytest.approx(SKEW_S, rel=1e-3)
    assert result["skew"]["reference_loss"] == pytest.approx(0.003, rel=0.02)
    assert [effect["frequency_Hz"] for effect in result["effect_of_1_ms"]] == pytest.approx(
        [0.5, 2.0], rel=1e-3
    )
    for effect in result["effect_of_1_ms"]:
        energy = effect["absorbed_energy_J_per_ms"]
        assert energy["by_shifting"] == pytest.approx(energy["closed_form"], rel=2e-3)


def test_a_record_that_is_no_reference_is_refused(spring: Path) -> None:
    done = bufferstand("skew", spring / "0.5Hz.h5", "--reference-loss", "-1")
    assert done.returncode == 2
    assert "must not be negative" in done.stderr
    assert "Traceback" not in done.stderr


def test_moving_mass(spring: Path) -> None:
    document = json.loads(
        bufferstand("evaluate", spring / "2Hz.h5", "--moving-mass", "150", "--json", "-").stdout
    )
    correction = document["runs"][0]["inertia_correction"]
    assert (correction["moving_mass_kg"], correction["source"]) == (150.0, "option")
    assert correction["largest_force_kN"] == pytest.approx(150e-6 * (4.0 * np.pi) ** 2 * 15.0, rel=0.02)
    refused = bufferstand("evaluate", spring / "2Hz.h5", "--moving-mass", "-1")
    assert refused.returncode == 2
    assert "moving mass" in refused.stderr
