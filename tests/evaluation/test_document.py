"""The evaluation document, its table, and the shipped limits."""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bufferstand.evaluation.document.build import evaluation_document
from bufferstand.evaluation.document.tables import COLUMNS, cycle_table, write_table
from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.requirements.limit_set import load_limit_set, shipped_limit_set
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.finding.run_facts import run_files
from tests.evaluation.signals import STATED, Ellipse, StaticTest

CYCLE_KEYS = {
    "index", "start_s", "end_s", "complete", "steady", "stroke_min_mm", "stroke_max_mm", "prestress_mm",
    "amplitude_mm", "frequency_Hz", "force_min_kN", "force_max_kN", "speed_loading_max_mm_per_s",
    "speed_unloading_max_mm_per_s", "stored_energy_J", "absorbed_energy_J", "damping",
    "tangent_stiffness_kN_per_mm", "secant_stiffness_kN_per_mm", "dynamic_stiffness_kN_per_mm",
    "storage_stiffness_kN_per_mm", "loss_stiffness_kN_per_mm", "loss_factor", "stroke_distortion",
    "temperature_C",
}  # fmt: skip
REQUIREMENT_KEYS = {
    "standard", "edition", "id", "cycle", "requirement", "measured", "expanded_uncertainty", "lower_limit",
    "upper_limit", "unit", "conformance_probability", "verdict", "why",
}  # fmt: skip


def documents() -> dict[str, Any]:
    time, stroke, force = Ellipse().columns(1.0, 200.0, 4.5)
    broken = force.copy()
    broken[300:340] = np.nan  # a fifth of a cycle
    runs = [
        StaticTest().evaluate(draws=100),
        evaluate_run(make_record(time, stroke, broken), RunFacts("h", "harmonic", path="h.h5")),
        evaluate_run(
            make_record(*Ellipse().columns(2.0, 400.0, 4.5)),
            RunFacts("i", "harmonic", **STATED),  # type: ignore[arg-type]
        ),
    ]
    return evaluation_document(runs)


DOCUMENT = documents()


def test_it_is_json_without_nan() -> None:
    text = json.dumps(DOCUMENT, allow_nan=False)
    assert json.loads(text)["schema"] == "bufferstand/evaluation/1"


def test_keys_of_the_contract() -> None:
    assert set(DOCUMENT) >= {"schema", "software", "runs", "trends"}
    assert DOCUMENT["software"]["version"]
    for entry in DOCUMENT["runs"]:
        assert set(entry) >= {"run", "cycles", "summary", "requirements", "verdict", "warnings"}
        assert set(entry["run"]) >= {"path", "id", "sha256", "kind", "specimen"}
        for cycle in entry["cycles"]:
            assert set(cycle) >= CYCLE_KEYS
            assert set(cycle["temperature_C"]) == {"start", "max"}
        for row in entry["requirements"]:
            assert set(row) >= REQUIREMENT_KEYS
        for name, value in entry["summary"].items():
            if name != "cycles_used":
                assert set(value) == {"value", "expanded_uncertainty", "coverage_factor"}
    for trend in DOCUMENT["trends"]:
        assert set(trend) >= {
            "quantity", "prestress_mm", "amplitude_mm", "runs", "slope_per_Hz", "intercept"
        }  # fmt: skip


def test_missing_values_are_null() -> None:
    harmonic = DOCUMENT["runs"][1]
    broken = next(
        c for c in harmonic["cycles"] if not c["complete"] and c["why"][0].startswith("what is not on record")
    )
    assert broken["stored_energy_J"] is None
    assert broken["temperature_C"] == {"start": None, "max": None}
    assert harmonic["verdict"] is None
    assert harmonic["summary"]["damping"]["expanded_uncertainty"] is None


def test_trend_of_two_runs() -> None:
    assert [t["quantity"] for t in DOCUMENT["trends"]] == ["damping", "tangent_stiffness"]
    assert DOCUMENT["trends"][0]["runs"] == ["h", "i"]


def test_table(tmp_path: Path) -> None:
    table = cycle_table(DOCUMENT)
    assert list(table.columns) == list(COLUMNS)
    assert len(table) == sum(len(entry["cycles"]) for entry in DOCUMENT["runs"])
    assert table["damping"].dtype == np.float64
    assert table["steady"].dtype == bool
    first = DOCUMENT["runs"][0]["cycles"][0]
    assert table["stored_energy_J"][0] == first["stored_energy_J"]
    assert table["U(damping)"][0] == first["expanded_uncertainty"]["damping"]
    write_table(DOCUMENT, tmp_path / "t.csv")
    back = pd.read_csv(tmp_path / "t.csv")
    pd.testing.assert_series_equal(back["damping"], table["damping"])


def test_empty_table_has_its_columns() -> None:
    assert list(cycle_table({"runs": []}).columns) == list(COLUMNS)


def test_table_refusals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadInput, match=r"use .csv, .parquet or .xlsx"):
        write_table(DOCUMENT, tmp_path / "t.ods")
    monkeypatch.setattr("bufferstand.evaluation.document.tables.find_spec", lambda _: None)
    with pytest.raises(BadInput, match="install it"):
        write_table(DOCUMENT, tmp_path / "t.parquet")
    with pytest.raises(BadInput, match="cannot be written"):
        write_table(DOCUMENT, tmp_path / "nowhere" / "t.csv")


def test_run_files(tmp_path: Path) -> None:
    for name in ("a/runs/2.h5", "a/runs/1.h5", "b.h5"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    found = run_files([tmp_path / "a", tmp_path / "b.h5", tmp_path / "a" / "runs" / "1.h5"])
    assert [f.name for f in found] == ["1.h5", "2.h5", "b.h5"]
    with pytest.raises(BadInput, match="no such file"):
        run_files([tmp_path / "c"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadInput, match="no run files"):
        run_files([tmp_path / "empty"])


def test_shipped_limits_are_those_of_the_paper() -> None:
    limits = shipped_limit_set()
    windows = {w.id: (w.stroke_mm, w.lower_kN, w.upper_kN) for w in limits.force}
    assert windows == {
        "preload": (0.0, 10.0, 50.0),
        "force-at-25mm": (25.0, 30.0, 130.0),
        "force-at-60mm": (60.0, 100.0, 400.0),
        "force-at-100mm": (100.0, 350.0, 1000.0),
    }
    assert limits.energy.stored_min_J == 12500.0
    assert (limits.energy.ratio_first_min, limits.energy.ratio_later_min) == (0.5, 0.42)
    assert limits.impact.stored_min_J == {"A": 30e3, "B": 50e3, "C": 70e3}
    assert limits.date == date(2026, 1, 15)
    assert "paper" in limits.source or "buffers" in limits.source
    assert len(limits.sha256) == 64


def test_broken_limit_set_names_the_line(tmp_path: Path) -> None:
    source = Path(load_limit_set.__defaults__[0]) if load_limit_set.__defaults__ else Path()
    text = source.read_text(encoding="utf-8").replace("pause_max_s", "pause_maxi_s")
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    with pytest.raises(
        BadInput, match=r"line \d+: conditions.pause_maxi_s: unknown key .* did you mean “pause_max_s”"
    ):
        load_limit_set(tmp_path / "own.toml")
