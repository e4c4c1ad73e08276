"""Tables and the C header for tools without FMI."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.model.export import command
from bufferstand.foundation.errors import BadInput
from bufferstand.model.export.build import ARITHMETIC, WARNINGS
from bufferstand.model.export.c_source import export_c
from bufferstand.model.export.losses import C_SOURCE, FANCHER, FMU, TABLES
from bufferstand.model.export.tables import default_temperatures, export_tables, slow_table
from bufferstand.model.simulation import band_history, force_history
from bufferstand.model.spring import ViscousBranch
from tests.model.cases import parallel_curves, path, spring
from tests.model_export.cases import BUFFER, HOOK, springs, stepped

ROOT = Path(__file__).parents[2]
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


def rows_of(file: Path) -> list[dict[str, float]]:
    lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(lines)]


@pytest.mark.parametrize("name", springs())
@pytest.mark.parametrize("temperature_C", [10.0, 25.0, 62.0])
def test_a_table_holds_the_forces_of_the_slow_spring(name, temperature_C):
    model = springs()[name]
    slow = replace(model, viscous=ViscousBranch())
    table = slow_table(model, temperature_C).columns
    x = table["stroke_mm"]
    for column, band in (("loading_kN", 1.0), ("unloading_kN", 0.0)):
        expected = force_history(slow, x, np.full_like(x, band), np.zeros_like(x), temperature_C)
        assert table[column][x > 0.0] == pytest.approx(expected[x > 0.0], abs=1e-9)


@pytest.mark.parametrize("name", ["buffer", "hook", "insulated"])
@pytest.mark.parametrize("temperature_C", [15.0, 60.0])
def test_transition_stiffness_is_the_slope_after_a_reversal(name, temperature_C):
    """Measured on the exact step itself, 1 µm beyond the reversal."""
    model = replace(springs()[name], viscous=ViscousBranch())
    table = slow_table(model, temperature_C, 7.0).columns
    for k, x in enumerate(table["stroke_mm"][2:-1].tolist(), start=2):
        for column, band, dx in (
            ("transition_loading_kN_per_mm", 0.0, 1e-3),
            ("transition_unloading_kN_per_mm", 1.0, -1e-3),
        ):
            stroke = np.array([x, x + dx])
            p = band_history(model.tables, stroke, band)
            force = force_history(model, stroke, p, np.zeros(2), temperature_C)
            assert (force[1] - force[0]) / dx == pytest.approx(table[column][k], rel=5e-3)


def test_transition_of_parallel_curves_in_closed_form():
    """a = b = (k_t - k)/h = 8/40: length 5 mm, and k_t is what was put in."""
    table = slow_table(spring(parallel_curves()), 25.0).columns
    assert table["transition_length_loading_mm"] == pytest.approx(np.full(101, 5.0), rel=1e-9)
    assert table["transition_length_unloading_mm"] == pytest.approx(np.full(101, 5.0), rel=1e-9)
    assert table["transition_loading_kN_per_mm"] == pytest.approx(np.full(101, 11.0), rel=1e-9)


def test_csv_and_json_say_the_same_and_what_they_lose(tmp_path):
    model = springs()["hook"]
    written = export_tables(model, tmp_path / "new", "hook", (5.0, 40.0))
    assert [p.name for p in written] == ["hook-tables.csv", "hook-tables.json", "hook-fancher.csv"]
    rows, content = rows_of(written[0]), json.loads(written[1].read_text(encoding="utf-8"))
    assert [t["temperature_C"] for t in content["tables"]] == [5.0, 40.0]
    flat = [
        {"temperature_C": t["temperature_C"]} | {name: t[name][k] for name in t if name != "temperature_C"}
        for t in content["tables"]
        for k in range(len(t["stroke_mm"]))
    ]
    assert rows == flat
    assert rows[-1]["stroke_mm"] == model.curves.end_mm
    assert content["lost"] == list(TABLES)
    for file, lost in ((written[0], TABLES), (written[2], FANCHER)):
        for sentence in lost:
            assert f"# Lost: {sentence}" in file.read_text(encoding="utf-8")
    assert default_temperatures(model) == (25.0, 75.0)


def test_an_endless_transition_is_null_not_a_number(tmp_path):
    model = spring(parallel_curves(k_t=3.0))
    content = json.loads(export_tables(model, tmp_path, "flat")[1].read_text(encoding="utf-8"))
    assert set(content["tables"][0]["transition_length_loading_mm"]) == {None}


@pytest.mark.parametrize("name", ["buffer", "hook", "bare"])
def test_fanchers_step_on_its_table_is_eq_4(tmp_path, name):
    """The tool's own law F1 = E1 + (F0 - E1) exp(-|dx|/beta), read off the CSV, against the exact step."""
    model = replace(springs()[name], viscous=ViscousBranch())
    rows = rows_of(export_tables(model, tmp_path, name)[2])
    column = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    end = model.curves.end_mm
    x = path(0.3 * end, 0.8 * end, 0.5 * end, 0.7 * end, 0.2 * end, 0.6 * end, step_mm=0.01)
    exact = force_history(model, x, band_history(model.tables, x), np.zeros_like(x), 25.0)
    force = [exact[0]]
    at = {key: np.interp(x, column["stroke_mm"], column[key]) for key in column}
    for k in range(1, len(x)):
        way = "load" if x[k] > x[k - 1] else "unload"
        envelope = at[f"envelope_{way}_kN"][k]
        force.append(
            envelope + (force[-1] - envelope) * np.exp(-abs(x[k] - x[k - 1]) / at[f"beta_{way}_mm"][k])
        )
    assert np.abs(np.array(force) - exact).max() < 5e-3 * np.ptp(exact)


@needs_gcc
@pytest.mark.parametrize("name", ["spectrum", "hook"])
def test_the_c_header_gives_the_bits_of_the_stepper(tmp_path, name):
    model = springs()[name]
    header, example = export_c(model, tmp_path, f"7 {name}")
    command_ = ["gcc", *ARITHMETIC, *WARNINGS, example.name, "-o", "example", "-lm"]
    subprocess.run(command_, cwd=tmp_path, check=True)
    told = subprocess.run([tmp_path / "example"], check=True, capture_output=True, text=True).stdout
    found = np.array([[float(v) for v in line.split(",")] for line in told.splitlines()])
    reference = model.temperature.reference_C
    expected = stepped(model, found[:, 1], 0.001, reference, reference)
    assert len(found) == 2000
    assert np.array_equal(found[:, 2], expected[:, 0])
    assert np.array_equal(found[:, 3], expected[:, 1])
    text = header.read_text(encoding="utf-8")
    assert all(f"Lost: {sentence}" in text for sentence in C_SOURCE)


@pytest.mark.parametrize("lost", [FMU, TABLES, FANCHER, C_SOURCE])
def test_the_page_for_users_says_what_each_export_loses(lost):
    page = " ".join((ROOT / "docs" / "model-export.md").read_text(encoding="utf-8").split())
    for sentence in lost:
        assert sentence in page


class TestCommand:
    def run(self, *arguments):
        return CliRunner().invoke(command, [str(a) for a in arguments], catch_exceptions=False)

    def test_writes_all_three_at_once(self, tmp_path):
        done = self.run(BUFFER, "--fmu", tmp_path / "b.fmu", "--tables", tmp_path, "--c", tmp_path / "c")
        assert done.exit_code == 0
        named = [Path(line) for line in done.stdout.splitlines()]
        assert all(p.is_file() for p in named)
        assert len(named) == 6
        assert done.stderr == ""

    def test_a_table_outside_the_identified_range_is_a_warning(self, tmp_path):
        done = self.run(HOOK, "--tables", tmp_path, "--temperature", "-40")
        assert done.exit_code == 0
        assert "warning: temperatures of -40.0 … 25.0 °C leave" in done.stderr

    @pytest.mark.parametrize(
        ("arguments", "told"),
        [
            ((), "nothing to write"),
            (("--fmu", "x.fmu", "--temperature", "20"), "add --tables"),
        ],
    )
    def test_what_makes_no_sense_is_refused(self, arguments, told):
        with pytest.raises(BadInput, match=told):
            self.run(BUFFER, *arguments)
