"""The commands, on real processes or, where only words are asked for, here: what they print, how they end."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest

from tests.main_job.conftest import bufferstand, here

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_runs"
RECORDED = ROOT.parent / "shared" / "data"
COMMANDS = [
    *("demo", "plan", "run", "resume", "check", "simulate-stand", "fault"),
    *("import", "evaluate", "skew", "report", "model", "runs", "verify"),
]


def write_ellipse(path: Path) -> float:
    """Write ten cycles of an elliptic loop; return its area π x_a F_a sin δ [J]."""
    time_s = np.arange(0.0, 10.0, 0.002)
    phase = 2.0 * np.pi * time_s - np.pi / 2.0
    stroke_mm = 30.0 + 20.0 * np.sin(phase)
    force_kN = 100.0 + 50.0 * np.sin(phase + 0.3)
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["time [s]", "stroke [mm]", "force [kN]"])
        writer.writerows(np.column_stack([time_s, stroke_mm, force_kN]).round(9).tolist())
    return math.pi * 20.0 * 50.0 * math.sin(0.3)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_every_command_has_an_example(name: str) -> None:
    done = (bufferstand if name == "demo" else here)(name, "--help")
    assert done.returncode == 0, done.stderr
    assert "Example:" in done.stdout


def test_import_and_evaluate_a_plain_csv(tmp_path: Path) -> None:
    area_J = write_ellipse(tmp_path / "ellipse.csv")
    imported = bufferstand(
        "import", tmp_path / "ellipse.csv", "--out", tmp_path / "runs", "--kind", "harmonic"
    )
    assert imported.returncode == 0, imported.stderr
    done = bufferstand("evaluate", tmp_path / "runs", "--json", "-", "--table", tmp_path / "cycles.csv")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)  # nothing else on standard output
    assert document["schema"] == "bufferstand/evaluation/1"
    (entry,) = document["runs"]
    used = [cycle for cycle in entry["cycles"] if cycle["index"] in entry["summary"]["cycles_used"]]
    assert len(used) >= 8
    for cycle in used:
        assert cycle["absorbed_energy_J"] == pytest.approx(area_J, rel=5e-4)
        assert cycle["loss_factor"] == pytest.approx(math.tan(0.3), rel=1e-3)
    with (tmp_path / "cycles.csv").open() as stream:
        assert len(list(csv.DictReader(stream))) == len(entry["cycles"])


@pytest.mark.parametrize("name", ["friction_damper_1Hz", "friction_damper_0.5Hz"])
def test_a_real_record_of_somebody_else(tmp_path: Path, name: str) -> None:
    if not RECORDED.is_dir():
        pytest.skip(f"the recorded data are not at {RECORDED}")
    imported = bufferstand(
        "import",
        RECORDED / f"{name}.csv",
        "--out",
        tmp_path,
        "--column",
        "stroke=Displacement [in]",
        "--column",
        "force=Friction Force [kip]",
    )
    assert imported.returncode == 0, imported.stderr
    done = bufferstand("evaluate", tmp_path, "--json", "-")
    (entry,) = json.loads(done.stdout)["runs"]
    expected = json.loads((RECORDED / "friction_damper_expected.json").read_text())[f"{name}.csv"]
    steady = [cycle for cycle in entry["cycles"] if cycle["steady"]]
    wanted = [cycle for cycle in expected if cycle["steady"]]
    assert len(steady) == len(wanted) == 2
    for found, known in zip(steady, wanted, strict=True):
        assert found["absorbed_energy_J"] == pytest.approx(known["absorbed_energy_J"], rel=0.01)
    assert any("not meaningful" in text and "two-sided" in text for text in entry["warnings"])
    assert entry["verdict"] is None


def test_plan_as_table_and_as_json() -> None:
    shown = bufferstand("plan", SAMPLES / "demo.toml")
    assert shown.returncode == 0, shown.stderr
    assert "quasi-static" in shown.stdout
    assert "40 °C stop is expected" in shown.stdout
    document = json.loads(here("plan", SAMPLES / "demo.toml", "--json").stdout)
    assert len(document["steps"]) == 13
    assert document["steps"][1]["prestress_mm"] == 20.0


def test_plan_refuses_what_breaks_a_limit_with_step_limit_and_way_out(tmp_path: Path) -> None:
    text = (SAMPLES / "demo.toml").read_text().replace('"stand.toml"', f'"{SAMPLES / "stand.toml"}"')
    text = text.replace('"specimens/', f'"{SAMPLES}/specimens/').replace(
        "prestress_mm = 78.0", "prestress_mm = 98.0"
    )
    (tmp_path / "c.toml").write_text(text)
    done = here("plan", tmp_path / "c.toml")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    for words in ("c.toml", "warming up", "stroke", "105"):
        assert words in done.stderr


def test_recorded_samples_are_listed_verified_evaluated_and_reported(tmp_path: Path) -> None:
    runs = SAMPLES / "runs"
    listed = bufferstand("runs", runs)
    assert listed.returncode == 0
    assert listed.stdout.count(".h5") == len(list(runs.glob("*.h5"))) > 2
    checked = bufferstand("verify", runs)
    assert checked.returncode == 0, checked.stdout
    written = bufferstand("report", runs, "--out", tmp_path / "report")
    assert written.returncode == 0, written.stderr
    assert sorted(path.suffix for path in (tmp_path / "report").iterdir()) == [".html", ".pdf"]


def test_verify_names_a_flipped_bit(tmp_path: Path) -> None:
    source = next((SAMPLES / "runs").glob("*.h5"))
    data = bytearray(source.read_bytes())
    data[len(data) // 2] ^= 0x10
    (tmp_path / "flipped.h5").write_bytes(data)
    done = here("verify", tmp_path / "flipped.h5")
    assert done.returncode == 2
    assert "flipped.h5" in done.stdout
    assert "DAMAGED" in done.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("evaluate", "nowhere.h5"), "nowhere.h5"),
        (("evalute", "x"), "did you mean “evaluate”"),
        (("plan", "nowhere.toml"), "nowhere.toml"),
        (("run", SAMPLES / "demo.toml"), "--out"),
        (("run", SAMPLES / "demo.toml", "--out", "x", "--speed", "4"), "--simulate"),
        (("import", ROOT / "README.md", "--out", "x"), "README.md"),
        (("import", ROOT / "README.md", "--out", "x", "--column", "stroke"), "NAME=HEADER"),
        (("resume", ROOT / "docs"), "campaign.json"),
        (("report", ROOT / "docs", "--out", "x"), "docs"),
        (("verify", ROOT / "docs"), "docs"),
        (("check", SAMPLES / "demo.toml"), "demo.toml"),
    ],
)
def test_bad_input_gets_one_line_and_status_2(
    words: tuple[str | Path, ...], message: str, tmp_path: Path
) -> None:
    run = bufferstand if words[0] == "evaluate" else here
    done = run(*[tmp_path / "x" if word == "x" and "--out" in words else word for word in words])
    assert done.returncode == 2, done.stdout + done.stderr
    assert message in done.stderr
    assert done.stderr.strip().count("\n") == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_check_of_a_stand_that_is_not_there_is_a_device_fault_that_says_where_to_look() -> None:
    done = bufferstand("check", SAMPLES / "stand.toml")
    assert done.returncode == 4
    assert "127.0.0.1:15020" in done.stdout
    assert "Traceback" not in done.stderr
