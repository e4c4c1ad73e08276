"""A mapping file describes an export once; impact and proof records carry what evaluation needs."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import Imported, import_file
from bufferstand.recording.foreign.mapping import load_mapping
from bufferstand.recording.runfile.file import open_run

from . import makers

LAB = """
name = "Rig 3, export of release 2.1"
kind = "impact"

[file]
encoding = "Windows-1252"
separator = ";"
decimal = ","
missing = ["---"]

[columns.time]
header = "Zeit"
unit = "ms"

[columns.stroke]
header = "Weg links"
unit = "mm"
invert = true
uncertainty = { linearity = 0.25, zero = 0.1 }

[columns.force]
header = "Kraft"
scale = 150.0
offset = -3.0
unit = "kN"
raw_unit = "V"
delay_s = 0.0004
certificate = "K-2026-17"
calibrated = 2026-01-15
uncertainty = { accuracy_percent = 0.5, zero = 0.5 }

[columns.temperature]
header = "Temp. Gehäuse"
unit = "°C"
optional = true
"""


def written(tmp_path: Path, text: str, name: str = "lab.toml") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def impact_csv(tmp_path: Path, *, temperature: bool = False) -> Path:
    """A sine impact of 105 mm in 0.2 s, 640 kN, written in volts with a sign turned, and one lost reading."""
    time_s = np.arange(0.0, 0.6, 2e-4)
    phase = np.clip((time_s - 0.2) / 0.2, 0.0, 1.0)
    stroke = 100.0 * np.sin(np.pi * phase)
    noise = np.random.default_rng(9).normal(size=(2, time_s.size))
    kept = np.where(phase <= 0.5, 1.0, 0.3 + 0.7 * np.exp((stroke - 100.0) / 2.0))
    force = 6.4 * kept * stroke + 0.05 * noise[0]
    stroke = stroke + 0.002 * noise[1]
    force = np.roll(force, 2)  # the amplifier's delay of 0.4 ms, which the mapping states
    rows = ["Datei;Stoß 12", "Zeit [ms];Weg links;Kraft" + (";Temp. Gehäuse" if temperature else "")]
    for number, (t, x, f) in enumerate(zip(time_s * 1e3, -stroke, (force + 3.0) / 150.0, strict=True)):
        cell = "---" if number == 2500 else f"{x:.9f}"
        rows.append(f"{t:.1f};{cell};{f:.12f}{';21,5' if temperature else ''}".replace(".", ","))
    path = tmp_path / "impact.csv"
    path.write_bytes("\r\n".join([*rows, ""]).encode("cp1252"))
    return path


def test_an_impact_by_a_mapping_is_evaluated_with_its_uncertainty(tmp_path: Path) -> None:
    specimen = written(
        tmp_path,
        '[specimen]\nid = "B-9"\ncategory = "A"\nmax_stroke_mm = 105.0\n'
        "[test]\nimpact_speed_km_h = 11.5\nimpact_mass_t = 80.0\n",
        "impact.toml",
    )
    mapping = written(tmp_path, LAB)
    made = import_file(impact_csv(tmp_path), tmp_path / "runs", ImportOptions(mapping=mapping))
    run = open_run(made.path)
    assert (run.kind, run.metadata["run"]["kind_source"]) == ("impact", "mapping")
    assert run.series("force").value.max() == pytest.approx(640.0, rel=1e-3)
    assert run.metadata["datasets"]["entry/record/force"]["units"] == "V"
    original = run.metadata["original"]
    assert original["mapping"]["sha256"] == hashlib.sha256(mapping.read_bytes()).hexdigest()
    assert original["mapping"]["name"] == "Rig 3, export of release 2.1"
    assert original["columns"]["stroke_1"]["inverted"] is True
    assert original["columns"]["stroke_1"]["unit_from"] == "mapping"
    assert "stroke_1: 1 empty or NaN cell(s), the first in line 2503" in made.warnings
    force = run.streams["record"].channels["force"]
    assert (force.delay_s, force.calibration.certificate) == (0.0004, "K-2026-17")
    assert force.calibration.date is not None
    assert specimen.name == original["specimen_file"]

    (entry,) = evaluate_paths([made.path], Options(draws=200))["runs"]
    rows = {row["id"]: row for row in entry["requirements"]}
    assert rows["stored-energy-category"]["measured"] == pytest.approx(32000.0, rel=3e-3)
    assert rows["stored-energy-category"]["expanded_uncertainty"] > 0.0
    assert rows["stored-energy-category"]["verdict"] in ("pass", "conditional-pass")
    assert rows["impact-speed"]["measured"] == 11.5


def test_an_optional_column_is_taken_where_it_is(tmp_path: Path) -> None:
    options = ImportOptions(mapping=written(tmp_path, LAB))
    run = open_run(import_file(impact_csv(tmp_path, temperature=True), tmp_path / "runs", options).path)
    assert run.series("temperature_1").value[0] == 21.5


def test_options_go_before_the_mapping(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("t [s],x [mm],y [mm],F [kN]\n0,1,2,3\n1,2,3,4\n")
    mapping = written(
        tmp_path,
        'kind = "static"\n[columns.time]\nheader = "t"\n[columns.stroke]\nheader = "x"\ninvert = true\n'
        '[columns.force]\nheader = "F"\n',
    )
    options = ImportOptions(
        mapping=mapping, column={"stroke": "y"}, unit={"force": "N"}, kind="proof", invert=["force"]
    )
    run = open_run(import_file(path, tmp_path / "runs", options).path)
    assert run.kind == "proof"
    assert run.series("stroke").value.tolist() == [-2.0, -3.0]
    assert run.series("force").value.tolist() == [-0.003, -0.004]


def test_a_proof_load_carries_which_it_was(tmp_path: Path) -> None:
    path = tmp_path / "proof.csv"
    path.write_text(makers.table(makers.METRIC, makers.motion()))
    written(
        tmp_path,
        '[specimen]\nid = "B-9"\n[test]\nkind = "proof"\nproof_load = "longitudinal"\n',
        "proof.toml",
    )
    run = open_run(import_file(path, tmp_path / "runs").path)
    assert run.kind == "proof"
    assert run.metadata["test"]["proof_load"] == "longitudinal"


def test_a_rate_by_the_mapping(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("stroke [mm],force [kN]\n1,2\n2,3\n3,4\n")
    options = ImportOptions(mapping=written(tmp_path, "sample_rate_Hz = 50\n"))
    run = open_run(import_file(path, tmp_path / "runs", options).path)
    assert run.series("force").time_s.tolist() == [0.0, 0.02, 0.04]
    assert run.metadata["original"]["time_from"] == {"record": "sample rate"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[columns.stroke]\nheaders = 'x'", "line 2: columns.stroke.headers: unknown key"),
        ("[columns.weg]\nheader = 'x'", "“weg” is no name of a channel; use time, stroke"),
        ("[columns.stroke]\nheader='x'\nnumber=2", "give either header or number, not both"),
        ("[columns.stroke]\nscale = 0.0\nunit = 'mm'", "scale must not be 0"),
        ("[columns.stroke]\nscale = 2.0", "with scale or offset, say the unit of the value"),
        ("[columns.time]\nformat = '%H'", "a format is for a time whose unit is “date-time”"),
        ("[columns.stroke]\n[columns.stroke_1]", "one channel is named twice"),
        ("time_zone = 'Wien'", "no such time zone"),
        ("[file]\nseparator = '|'", "line 2: file.separator"),
        ("[file]\nencoding = 'UTF8'", "line 2: file.encoding"),
        ("kind = 'sine'", "line 1: kind"),
        ("sample_rate_Hz = 1.0\n[columns.time]\nheader = 't'", "it states a sample rate and a time column"),
        ("[columns.force]\nheader = 'G'", "columns.force of lab.toml: no header is “G”; the headers are"),
        ("[columns.speed]\nunit = 'mm/s'", "columns.speed of lab.toml: the record has no such column"),
        ("[columns.force]\nnumber = 9", "columns.force of lab.toml: the record has 3 columns only"),
    ],
)
def test_mappings_that_cannot_be(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "record.csv"
    path.write_text("time [s],stroke [mm],force [kN]\n0,1,2\n1,2,3\n")
    mapping = written(tmp_path, text + "\n")
    with pytest.raises(BadInput) as caught:
        import_file(path, tmp_path / "runs", ImportOptions(mapping=mapping))
    assert message in caught.value.message()
    assert not (tmp_path / "runs").exists()


def test_the_documented_mapping_is_one(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "docs" / "import.md").read_text(encoding="utf-8")
    example = text.split("```toml\n", 1)[1].split("```", 1)[0]
    mapping: Any = load_mapping(written(tmp_path, example))
    assert "stroke" in mapping.columns


def test_what_was_decided_is_given_back(tmp_path: Path) -> None:
    made: Imported = import_file(
        impact_csv(tmp_path), tmp_path / "runs", ImportOptions(mapping=written(tmp_path, LAB))
    )
    assert made.decisions == open_run(made.path).metadata["original"]
    assert made.decisions["separator"] == ";"
    assert made.decisions["encoding"] == "Windows-1252"
    assert made.decisions["preamble"] == ["Datei;Stoß 12"]
