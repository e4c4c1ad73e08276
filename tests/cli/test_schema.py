"""``bufferstand schema``: the schemas accept what the commands accept, and mark what these refuse."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from datetime import date, datetime
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from pydantic import ConfigDict, TypeAdapter

from bufferstand.cli.commands import schema as command
from bufferstand.cli.commands.schema import NAMES
from bufferstand.evaluation.catalogue.every_quantity import QUANTITIES
from bufferstand.evaluation.catalogue.quantity import Quantity
from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts import document_types, quantity_entries
from bufferstand.evaluation.facts.run_facts import Options

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
    "train": sorted((SAMPLES / "trains").glob("*.toml")),
}


@cache
def schema_of(name: str) -> dict[str, Any]:
    return command.schema_of(name)


@cache
def evaluated() -> str:
    """Return the evaluation document of all samples."""
    return json.dumps(evaluate_paths([SAMPLES / "runs"], Options(draws=100)))


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


@pytest.mark.slow
def test_the_document_holds_the_keys_of_its_schema_and_no_others(monkeypatch: pytest.MonkeyPatch) -> None:
    strict = ConfigDict(strict=True, extra="forbid")
    for name, described in {**vars(document_types), **vars(quantity_entries)}.items():
        if name.endswith(("Entry", "Document")) and isinstance(described, type):
            monkeypatch.setattr(described, "__pydantic_config__", strict, raising=False)
    TypeAdapter(document_types.EvaluationDocument).validate_json(evaluated())
    jsonschema.validate(json.loads(evaluated()), schema_of("evaluation"))


def part_of_schema(name: str) -> dict[str, Any]:
    """Return the schema of a part of the document."""
    return {"$ref": f"#/$defs/{name}", "$defs": schema_of("evaluation")["$defs"]}


@pytest.mark.parametrize("entry", QUANTITIES, ids=QUANTITIES.names)
def test_a_quantity_is_in_the_schema_as_the_catalogue_has_it(entry: Quantity) -> None:
    parts = schema_of("evaluation")["$defs"]
    found = parts["CycleEntry"]
    for key in entry.path:
        found = found["properties"][key]
        found = parts[found["$ref"].rpartition("/")[2]] if "$ref" in found else found
    for told in (found, parts["SummaryEntry"]["properties"][entry.name]):
        assert (told["title"], told["unit"]) == (entry.label, entry.unit)
        assert entry.meaning in told["description"]
    assert [kind["type"] for kind in found["anyOf"]] == ["number", "null"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "valid"),
    [
        ({}, True),
        ({"damping": None}, True),
        ({"dampnig": 0.4}, False),
        ({"damping": "much"}, False),
        ({"complete": "yes"}, False),
        ({"temperature_C": {"start": None, "max": 31.5}}, True),
        ({"temperature_C": {"start": None}}, False),
        ({"temperature_C": {"start": None, "max": None, "least": 3.0}}, False),
        ({"expanded_uncertainty": {"dampnig": 0.01}}, False),
        ({"missing": {"U(damping)": "too few samples"}}, True),
        ({"missing": {"U(dampnig)": "too few samples"}}, False),
    ],
)
def test_a_cycle_with_a_key_or_a_type_of_its_own_is_marked(change: dict[str, Any], valid: bool) -> None:
    cycle = json.loads(evaluated())["runs"][0]["cycles"][0]
    assert jsonschema.Draft202012Validator(part_of_schema("CycleEntry")).is_valid(cycle | change) is valid


def test_a_cycle_without_one_of_its_keys_is_marked() -> None:
    schema = jsonschema.Draft202012Validator(part_of_schema("CycleEntry"))
    cycle = json.loads(evaluated())["runs"][0]["cycles"][0]
    for key in cycle:
        assert not schema.is_valid({name: value for name, value in cycle.items() if name != key}), key


def test_a_summary_with_a_key_or_a_type_of_its_own_is_marked() -> None:
    schema = jsonschema.Draft202012Validator(part_of_schema("SummaryEntry"))
    summary = json.loads(evaluated())["runs"][0]["summary"]
    assert schema.is_valid(summary)
    assert not schema.is_valid(summary | {"dampnig": summary["damping"]})
    assert not schema.is_valid(summary | {"damping": 0.4})
    assert not schema.is_valid(summary | {"damping": summary["damping"] | {"k": 2}})
    assert not schema.is_valid(summary | {"cycles_used": ["first"]})


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
