"""``bufferstand schema``: the schemas accept what the commands accept, and mark what these refuse."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from datetime import date, datetime
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from pydantic import ConfigDict, TypeAdapter

from bufferstand.cli.commands.schema import NAMES, schema_of
from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts import document_types

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_runs"
CHECKLIST = SAMPLES / "ring-spring-checklist.toml"
FILES = {
    "stand": [SAMPLES / "stand.toml"],
    "campaign": sorted(set(SAMPLES.glob("*.toml")) - {SAMPLES / "stand.toml", CHECKLIST}),
    "specimen": sorted((SAMPLES / "specimens").glob("*.toml")),
    "limit-set": sorted((ROOT / "evaluation").rglob("limit_sets/*.toml")),
    "inspection": [CHECKLIST],
    "profile": sorted((ROOT / "drivers").rglob("profiles/*.toml")),
    "model": sorted((SAMPLES / "models").glob("*.toml")),
}


def as_json(value: Any) -> Any:
    """Return what TOML holds as JSON would hold it."""
    if isinstance(value, dict):
        return {key: as_json(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [as_json(inner) for inner in value]
    return value.isoformat() if isinstance(value, datetime | date) else value


@pytest.mark.parametrize("name", NAMES)
def test_it_is_a_json_schema_of_the_draft_it_names(name: str) -> None:
    schema = schema_of(name)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["title"] == NAMES[name]


@pytest.mark.parametrize(
    ("name", "path"), [pytest.param(n, p, id=f"{n}-{p.stem}") for n, ps in FILES.items() for p in ps]
)
def test_shipped_files_are_as_their_schema_says(name: str, path: Path) -> None:
    content = as_json(tomllib.loads(path.read_text()))
    schema = jsonschema.Draft202012Validator(schema_of(name))
    schema.validate(content)
    assert not schema.is_valid({**content, "nonsense": 1})


def test_an_editor_is_told_what_a_key_means_and_its_bounds() -> None:
    specimen = schema_of("specimen")["$defs"]["Specimen"]["properties"]
    assert "Path of the spring model" in specimen["model"]["description"]
    assert "From 1 to 1000" in specimen["max_stroke_mm"]["description"]
    number = next(one for one in specimen["max_stroke_mm"]["anyOf"] if one["type"] == "number")
    assert (number["minimum"], number["maximum"]) == (1.0, 1000.0)


def test_a_mistyped_value_is_marked_at_its_place() -> None:
    content = tomllib.loads((SAMPLES / "demo.toml").read_text())
    content["step"][0]["cycles"] = "three"
    errors = list(jsonschema.Draft202012Validator(schema_of("campaign")).iter_errors(as_json(content)))
    assert [list(error.absolute_path)[:2] for error in errors] == [["step", 0]]


def test_the_document_holds_the_keys_of_its_schema_and_no_others(monkeypatch: pytest.MonkeyPatch) -> None:
    strict = ConfigDict(strict=True, extra="forbid")
    for name, described in vars(document_types).items():
        if name.endswith(("Entry", "Document")) and isinstance(described, type) and described is not dict:
            monkeypatch.setattr(described, "__pydantic_config__", strict, raising=False)
    made = json.dumps(evaluate_paths([SAMPLES / "runs"]))
    TypeAdapter(document_types.EvaluationDocument).validate_json(made)
    jsonschema.validate(json.loads(made), schema_of("evaluation"))


def test_the_command_prints_the_schema_and_nothing_else() -> None:
    told = subprocess.run(
        [sys.executable, "-P", "-m", "bufferstand", "schema", "report"], capture_output=True, check=True
    )
    assert json.loads(told.stdout) == schema_of("report")
    assert told.stderr == b""


def test_an_unknown_name_is_refused_in_one_line() -> None:
    told = subprocess.run(
        [sys.executable, "-P", "-m", "bufferstand", "schema", "stnad"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (told.returncode, told.stderr.count("\n")) == (2, 1)
    assert "limit-set" in told.stderr
