"""The judge sees what it is there to see: each kind of falsehood, put into a true document."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest

from evaluation.api import ImportOptions, evaluate, import_record

from . import world
from .chain import Applied, Scene
from .expected import conditions, of_the_run
from .judge import judge
from .judgement import Judgement


def _sound() -> Scene:
    """Return the first static record that keeps all conditions and meets the limit of the stored energy."""
    for number in range(200):
        scene = world.make(number, "clean")
        if scene.motion.kind != "static" or len(scene.cycles) != 3 or not scene.stated:
            continue
        states = [*of_the_run(scene).values()]
        states += [c for cycle in scene.cycles for c in conditions(scene, cycle, 0.0).values()]
        if all(c.state == "ok" and c.shown == "yes" for c in states):
            return scene
    raise AssertionError("no sound record")


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, dict[str, Any]]:
    folder: Path = tmp_path_factory.mktemp("judged")
    scene = _sound()
    files = world.write(scene, folder)
    imported = import_record(files.record, folder / "runs", ImportOptions(mapping=files.mapping))
    return scene, evaluate(imported.path, draws=400)


def _falsified(judged: tuple[Scene, dict[str, Any]]) -> tuple[Scene, dict[str, Any], dict[str, Any]]:
    document = copy.deepcopy(judged[1])
    return judged[0], document, document["runs"][0]


def _categories(j: Judgement) -> set[str]:
    return {category for category, _, _ in j.findings}


def _row(run: dict[str, Any], name: str, cycle: int | None) -> dict[str, Any]:
    rows: list[dict[str, Any]] = run["requirements"]
    return next(r for r in rows if r["id"] == name and r["cycle"] == cycle)


def test_a_turned_verdict_is_false(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    for turned, category in (("fail", "false fail"), ("invalid", "false fail"), ("inconclusive", "needless")):
        _row(run, "stored-energy", 2)["verdict"] = turned
        assert category in _categories(judge(scene, document, []))


def test_a_pass_without_a_reading_of_the_temperature_is_false(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, _ = _falsified(judged)
    scene = copy.copy(scene)
    scene.temperatures_C = []
    assert ("false pass", "temperature-range of stroke 1") in {
        f[:2] for f in judge(scene, document, []).findings
    }


def test_a_wrong_figure_and_a_lost_cycle_are_seen(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    run["cycles"][1]["absorbed_energy_J"] *= 1.2
    assert ("gross", "absorbed_energy_J") in {f[:2] for f in judge(scene, document, []).findings}
    run["cycles"] = run["cycles"][:1]
    assert ("needless", "cycle without figures") in {f[:2] for f in judge(scene, document, []).findings}


def test_a_fault_needs_its_name_and_a_clean_record_none(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    run["warnings"].append("force: clipped at 400 kN")
    assert "false alarm" in _categories(judge(scene, document, []))
    scene = copy.copy(scene)
    scene.applied = [Applied("clipped-force", "400 kN", r"clip", "judged")]
    assert "unnamed" not in _categories(judge(scene, document, []))
    run["warnings"].pop()
    assert "unnamed" in _categories(judge(scene, document, []))
