"""One ellipse in many formats and unit systems: read to the same motion, evaluated to the same figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import import_file
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.verification import verify

from . import makers

RELATIVE = 1e-6


def figures(value: Any, name: str = "") -> dict[str, Any]:
    """Return all leaves of an evaluation by their paths."""
    if isinstance(value, dict):
        return {k: v for key, item in value.items() for k, v in figures(item, f"{name}.{key}").items()}
    if isinstance(value, list):
        return {k: v for i, item in enumerate(value) for k, v in figures(item, f"{name}[{i}]").items()}
    return {name: value}


def evaluated(folder: Path, form: str) -> dict[str, Any]:
    name, write = makers.FORMATS[form]
    folder.mkdir()
    made = import_file(write(folder / name), folder / "out", ImportOptions(kind="harmonic"))
    assert verify(made.path) == []
    (entry,) = evaluate_paths([made.path])["runs"]
    return {key: entry[key] for key in ("cycles", "summary")}


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return evaluated(tmp_path_factory.mktemp("reference") / "csv", "CSV")


def test_the_ellipse_is_what_its_closed_form_says(reference: dict[str, Any]) -> None:
    complete = [cycle for cycle in reference["cycles"] if cycle["complete"]]
    assert len(complete) == makers.CYCLES
    for cycle in complete:
        assert cycle["absorbed_energy_J"] == pytest.approx(makers.ABSORBED_J, rel=1e-4)
        assert cycle["amplitude_mm"] == pytest.approx(makers.AMPLITUDE_MM, rel=1e-4)
        assert cycle["loss_factor"] == pytest.approx(np.tan(makers.DELTA), rel=5e-4)
        assert cycle["temperature_C"]["max"] == pytest.approx(makers.TEMPERATURE_C)


@pytest.mark.parametrize("form", [form for form in makers.FORMATS if form != "CSV"])
def test_every_format_evaluates_to_the_same_figures(
    tmp_path: Path, form: str, reference: dict[str, Any]
) -> None:
    found, wanted = figures(evaluated(tmp_path / "run", form)), figures(reference)
    assert found.keys() == wanted.keys()
    compared = 0
    for name, value in wanted.items():
        if isinstance(value, float) and value != 0.0:
            assert found[name] == pytest.approx(value, rel=RELATIVE, abs=1e-9), name
            compared += 1
        else:
            assert found[name] == value or name.endswith("why"), name
    assert compared > 80


def test_streams_of_other_rates_keep_their_own_time(tmp_path: Path) -> None:
    for form in ("TDMS", "MDF4"):
        name, write = makers.FORMATS[form]
        run = open_run(import_file(write(tmp_path / name), tmp_path / form).path)
        assert list(run.streams) == ["record", "record_2"]
        assert run.streams["record"].rate_Hz == pytest.approx(makers.RATE_HZ)
        assert run.streams["record_2"].rate_Hz == pytest.approx(makers.RATE_HZ / 10.0)
        slow = run.series("temperature_1")
        assert slow.time_s == pytest.approx(makers.motion()["time"][::10], abs=1e-12)
        assert run.metadata["run"]["started_utc"] == makers.STARTED.isoformat()
        assert run.metadata["original"]["started_from"] == "record"
