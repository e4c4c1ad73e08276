"""``bufferstand model fit | simulate | compare`` on real processes; their refusals here."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.model.file import load_model
from tests.main_job.conftest import bufferstand, here

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"
MODEL = SAMPLES / "models" / "category-a-elastomer.toml"
RUN = SAMPLES / "runs" / "007-harmonic-50mm-15mm-0.849Hz.h5"


def test_simulate_writes_a_table_that_import_and_simulate_read(tmp_path: Path) -> None:
    sine = ("--prestress", "30", "--amplitude", "10", "--frequency", "1", "--cycles", "3")
    done = bufferstand(
        "model", "simulate", MODEL, *sine, "--out", tmp_path / "s.csv", "--picture", tmp_path / "s.svg"
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "s.svg").read_text().lstrip().startswith("<?xml")
    imported = bufferstand("import", tmp_path / "s.csv", "--out", tmp_path / "runs", "--kind", "harmonic")
    assert imported.returncode == 0, imported.stderr
    again = bufferstand("model", "simulate", MODEL, "--run", tmp_path / "s.csv", "--isothermal")
    assert again.returncode == 0, again.stderr
    assert "40.0 mm" in again.stdout


def test_compare_draws_loops_and_temperatures(tmp_path: Path) -> None:
    done = bufferstand("model", "compare", MODEL, RUN, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "damping within" in done.stdout
    assert {file.name for file in tmp_path.iterdir()} == {
        f"{RUN.stem}-loops.png",
        f"{RUN.stem}-temperature.png",
    }


def test_fit_writes_a_model_and_a_campaign_that_plan_takes(tmp_path: Path) -> None:
    done = bufferstand(
        *("model", "fit", RUN, "--out", tmp_path / "m.toml", "--knots", "6", "--no-validation"),
        *("--missing-runs", tmp_path / "more.toml", "--stand", SAMPLES / "stand.toml"),
        *("--specimen", SAMPLES / "specimens" / "category-a-elastomer.toml"),
    )
    assert done.returncode == 0, done.stderr
    model = load_model(tmp_path / "m.toml")
    assert model.identified.stroke_mm[1] == pytest.approx(63.5, abs=0.2)
    assert model.curves.end_mm == 105.0  # the specimen's max_stroke_mm
    assert "from 63.5 to 105 mm the curves are continued by their own shape, not measured" in done.stderr
    assert "stop of 500 kN/mm (assumed, not measured)" in done.stderr
    assert "Not told by these runs:" in done.stdout
    planned = bufferstand("plan", tmp_path / "more.toml")
    assert planned.returncode == 0, planned.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("fit", SAMPLES / "models", "--out", "m.toml"), "no run file"),
        (("fit", RUN, "--out", "m.json"), "ends with .toml"),
        (("simulate", MODEL), "there is no stroke to follow"),
        (
            ("simulate", MODEL, "--prestress", "5", "--amplitude", "9", "--frequency", "1"),
            "would leave the specimen",
        ),
        (("simulate", MODEL, "--run", MODEL), "model"),
        (("compare", RUN, RUN), "h5"),
        (("fot",), "did you mean “fit”"),
    ],
)
def test_bad_input_is_one_message(arguments: tuple[object, ...], says: str) -> None:
    done = here("model", *map(str, arguments))
    assert done.returncode == 2
    assert says in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
