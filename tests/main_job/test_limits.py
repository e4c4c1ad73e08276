"""A laboratory's own limits and an inspector's checklist, from the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.requirements.checklist import asked_items
from bufferstand.evaluation.requirements.inspection import load_inspection
from bufferstand.evaluation.requirements.limit_set import FOLDER, find_limit_set
from tests.main_job.conftest import bufferstand

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"
SPECIMEN = """[specimen]
id = "B7"
kind = "buffer"
max_stroke_mm = 105.0
[test]
kind = "proof"
proof_load = "F2"
"""
INSPECTED = """[inspection]
specimen = "B7"
inspector = "N. N."
date = 2026-01-15
[[item]]
id = "serviceable-condition"
result = "in-order"
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Import a proof load F2 of 520 kN that leaves 0.3 mm."""
    folder = tmp_path_factory.mktemp("proof")
    time = np.arange(0.0, 14.0, 0.01)
    stroke = np.interp(time, [0.0, 2.0, 6.0, 10.0, 14.0], [0.0, 0.0, 20.0, 0.3, 0.3])
    force = np.interp(time, [0.0, 2.0, 6.0, 10.0, 14.0], [0.0, 0.0, 520.0, 0.0, 0.0])
    rows = "".join(f"{t:.2f},{x:.5f},{f:.5f}\n" for t, x, f in zip(time, stroke, force, strict=True))
    (folder / "proof.csv").write_text("time [s],stroke [mm],force [kN]\n" + rows, encoding="utf-8")
    (folder / "b7.toml").write_text(SPECIMEN, encoding="utf-8")
    done = bufferstand(
        "import", folder / "proof.csv", "--out", folder / "runs", "--specimen", folder / "b7.toml"
    )
    assert done.returncode == 0, done.stderr
    return folder / "runs"


def evaluated(*arguments: object) -> dict[str, Any]:
    done = bufferstand("evaluate", *arguments, "--json", "-")
    assert done.returncode == 0, done.stderr
    (entry,) = json.loads(done.stdout)["runs"]
    return dict(entry)


def verdicts(entry: dict[str, Any]) -> dict[str, str]:
    return {row["id"]: row["verdict"] for row in entry["requirements"]}


def test_own_limits_and_inspection(runs: Path, tmp_path: Path) -> None:
    shipped = evaluated(runs)
    assert verdicts(shipped) == {
        "proof-load-f2": "pass", "permanent-deformation": "inconclusive",
        "serviceable-condition": "not-tested",
    }  # fmt: skip
    assert shipped["inspection"] is None
    text = (FOLDER / "en15551-105mm.toml").read_text(encoding="utf-8")
    text = text.replace('id = "en15551-105mm"', 'id = "our-105mm"')
    text = text.replace('permanent_deformation_max_mm = "fill-in"', "permanent_deformation_max_mm = 0.5")
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    (tmp_path / "seen.toml").write_text(INSPECTED, encoding="utf-8")
    own = evaluated(runs, "--limits", tmp_path / "own.toml", "--inspection", tmp_path / "seen.toml")
    assert set(verdicts(own).values()) == {"pass"}
    assert own["verdict"] == "pass"
    assert own["limit_set"]["id"] == "our-105mm"
    assert own["limit_set"]["sha256"] != shipped["limit_set"]["sha256"]
    assert own["inspection"]["inspection"]["inspector"] == "N. N."


def test_a_shipped_set_by_its_name(runs: Path) -> None:
    entry = evaluated(runs, "--limits", "en15566-draw-gear")
    assert entry["verdict"] is None
    assert any("has nothing on proof runs" in text for text in entry["warnings"])


def test_refusals(runs: Path, tmp_path: Path) -> None:
    done = bufferstand("evaluate", runs, "--limits", "en15551-110mm")
    assert done.returncode == 2
    assert "no such limit set" in done.stderr
    assert "en15551-105mm" in done.stderr
    (tmp_path / "seen.toml").write_text(INSPECTED.replace("serviceable", "usable"), encoding="utf-8")
    done = bufferstand("evaluate", runs, "--inspection", tmp_path / "seen.toml")
    assert done.returncode == 2
    assert "serviceable-condition" in done.stderr


def test_shipped_checklist_has_every_item_open() -> None:
    items = asked_items(find_limit_set("ring-spring-maintenance"))
    template = load_inspection(SAMPLES / "ring-spring-checklist.toml", items)
    assert tuple(item.id for item in template.item) == items
    assert {item.result for item in template.item} == {"fill-in"}
