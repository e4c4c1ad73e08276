"""The judge sees what it is there to see: each kind of falsehood, put into a true document."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.document.python_api import evaluate, import_record
from bufferstand.recording.foreign.import_options import ImportOptions

from . import world
from .applied import Applied
from .chain import Scene
from .expected import conditions, covered, of_the_run
from .judge import judge
from .judgement import Judgement
from .kinds import statements


def _sound() -> Scene:
    """Return the first static record that keeps all conditions and meets the limit of the stored energy."""
    for number in range(200):
        scene = world.make(number, "clean")
        if scene.motion.kind != "static" or len(scene.cycles) != 3 or not scene.stated:
            continue
        states = [*of_the_run(scene).values()]
        states += [c for cycle in scene.cycles for c in conditions(scene, cycle).values()]
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
    return copy.copy(judged[0]), document, document["runs"][0]


def _said(j: Judgement) -> set[tuple[str, str]]:
    return {(category, what) for category, what, _ in j.findings}


def _row(run: dict[str, Any], name: str, cycle: int | None) -> dict[str, Any]:
    rows: list[dict[str, Any]] = run["requirements"]
    return next(r for r in rows if r["id"] == name and r["cycle"] == cycle)


def _clipped(**more: Any) -> Applied:
    return Applied(
        "clipped-force",
        "400 kN",
        kinds=("clipped",),
        words=(r"force", r"clip"),
        channel="force",
        figures="named",
        plain=True,
        **more,
    )


def test_a_true_document_has_no_falsehood(judged: tuple[Scene, dict[str, Any]]) -> None:
    assert not judge(*judged, []).falsehoods


@pytest.mark.parametrize(
    ("turned", "category"), [("fail", "false fail"), ("invalid", "false fail"), ("inconclusive", "needless")]
)
def test_a_turned_verdict_is_false(judged: tuple[Scene, dict[str, Any]], turned: str, category: str) -> None:
    scene, document, run = _falsified(judged)
    for name in ("stored-energy", "speed-limit"):
        _row(run, name, 2)["verdict"] = turned
        assert (category, f"{name} of stroke 2") in _said(judge(scene, document, []))


def test_a_verdict_of_the_run_that_is_not_its_rows_is_seen(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    run["verdict"] = "fail" if run["verdict"] != "fail" else "pass"
    assert ("document", "verdict of the run") in _said(judge(scene, document, []))


def test_a_pass_without_a_reading_of_the_temperature_is_false(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, _ = _falsified(judged)
    scene.temperatures_C, scene.faulty_C = [], []
    assert ("false pass", "temperature-range of stroke 1") in _said(judge(scene, document, []))


def test_a_code_of_a_sensor_covers_nothing(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene = copy.copy(judged[0])
    assert covered(scene, scene.cycles[0]) == "yes"
    scene.faulty_C = [np.ones_like(bad) for bad in scene.faulty_C]
    assert covered(scene, scene.cycles[0]) == "no"


def test_what_is_left_after_a_stroke_that_ends_in_a_rest_may_break_the_release(
    judged: tuple[Scene, dict[str, Any]],
) -> None:
    scene = judged[0]
    third = replace(scene.cycles[2], left_mm=3.4, closes=False)
    assert conditions(scene, third)["full-release"].state == "broken"
    assert conditions(scene, replace(third, whole=False))["full-release"].state == "ok"


def test_a_stroke_in_a_hole_that_hides_none_by_the_contract_is_not_asked_for(
    judged: tuple[Scene, dict[str, Any]],
) -> None:
    scene = copy.copy(judged[0])
    first = scene.cycles[0]
    rows = (scene.true_time_s < first.start_s) | (scene.true_time_s > first.end_s)
    scene.true_time_s = scene.true_time_s[rows]
    assert of_the_run(scene)["cycle-count"].state == "ok"  # as long as the others: it may be hidden
    fast = replace(first, start_s=first.top_s)
    scene.true_time_s = np.sort(
        np.append(scene.true_time_s, np.linspace(first.start_s, first.top_s, 9, endpoint=False))
    )
    scene.cycles = [fast, *scene.cycles[1:]]
    assert of_the_run(scene)["cycle-count"].state == "near"


def test_a_wrong_figure_and_a_lost_cycle_are_seen(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    run["cycles"][1]["absorbed_energy_J"] *= 1.2
    run["extremes"]["force_max_kN"]["value"] *= 1.2
    said = _said(judge(scene, document, []))
    assert {("gross", "absorbed_energy_J"), ("gross", "force_max_kN")} <= said
    run["cycles"] = run["cycles"][:1]
    assert ("needless", "cycle without figures") in _said(judge(scene, document, []))


def test_strokes_are_numbered_as_they_happened(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    for cycle in run["cycles"]:
        cycle["index"] += 1
    assert ("numbering", "stroke number") in _said(judge(scene, document, []))


def test_a_mean_over_strokes_that_differ_is_seen(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, _ = _falsified(judged)
    scene.cycles = copy.deepcopy(scene.cycles)
    scene.cycles[1].figures["stroke_max_mm"] = (60.0, 60.0)
    assert ("mixed", "cycles that do not belong together are one mean") in _said(judge(scene, document, []))


def test_a_fault_is_named_by_a_warning_of_its_channel_alone(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    run["warnings"].append("force: clipped at 400 kN")
    assert ("false alarm", "the word clip") in _said(judge(scene, document, []))
    scene.applied = [_clipped()]
    run["cycles"][0]["stored_energy_J"] *= 0.9
    assert "unnamed" not in {c for c, _ in _said(judge(scene, document, []))}
    run["warnings"][-1] = "stroke: clipped at 85 mm; the force is sound"
    assert ("unnamed", "clipped-force") in _said(judge(scene, document, []))


def test_a_finding_names_a_fault_of_its_kind_channel_and_time(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    first = scene.cycles[0]
    scene.applied = [_clipped(start_s=first.start_s, end_s=first.end_s)]
    run["cycles"][0]["stored_energy_J"] *= 0.9
    there = {
        "channel": "force",
        "start_s": first.start_s,
        "end_s": first.end_s,
        "text": "",
        "effect": "spoils",
    }
    for finding, named in (
        ({**there, "kind": "clipped"}, True),
        ({**there, "kind": "drift"}, False),
        ({**there, "kind": "clipped", "channel": "stroke"}, False),
        ({**there, "kind": "clipped", "start_s": scene.cycles[2].start_s, "end_s": None}, False),
    ):
        run["plausibility"] = [finding]
        said = {c for c, _ in _said(judge(scene, document, []))}
        assert ("unnamed" in said, "false alarm" in said) == (not named, not named)


def test_a_fault_without_effect_need_not_be_named_and_one_with_must(
    judged: tuple[Scene, dict[str, Any]],
) -> None:
    scene, document, run = _falsified(judged)
    scene.applied = [_clipped(falsifies=frozenset({"stored_energy_J"}))]
    assert ("quiet", "clipped-force") in _said(judge(scene, document, []))
    for cycle in run["cycles"]:
        cycle["stored_energy_J"] *= 0.9
    said = _said(judge(scene, document, []))
    assert {("unnamed", "clipped-force"), ("spoilt", "stored_energy_J")} <= said


def test_a_pass_by_luck_is_without_ground(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    row = _row(run, "stored-energy", 2)
    row["measured"] *= 1.2
    assert ("gross", "stored-energy") in _said(judge(scene, document, []))
    scene.applied = [_clipped()]
    assert ("unfounded", "stored-energy of stroke 2") in _said(judge(scene, document, []))


def test_what_a_record_holds_besides_is_held(judged: tuple[Scene, dict[str, Any]]) -> None:
    scene, document, run = _falsified(judged)
    run["cumulated_energy_J"]["absorbed"] *= 1.2
    run["residual_strokes"][0]["residual_mm"] += 3.0
    change = next(e for e in run["settling"] if e["quantity"] == "stored_energy_J")
    change["last"] *= 1.2
    change["expanded_uncertainty"] = 1.0
    said = {(c, w, d.split(":")[0]) for c, w, d in judge(scene, document, []).findings}
    assert ("gross", "absorbed_energy_J", "cumulated") in said
    assert {"residual_mm", "settling stored_energy_J"} <= {w for c, w, _ in said if c == "gross"}


@pytest.mark.parametrize(("told_s", "right"), [(0.30, True), (0.27, True), (0.2, False), (0.4, False)])
def test_a_lateness_is_rightly_told_by_its_size(
    judged: tuple[Scene, dict[str, Any]], told_s: float, right: bool
) -> None:
    scene, document, run = _falsified(judged)
    late = statements.force_late(np.random.default_rng(0), copy.copy(scene))
    finding = {
        "kind": "delay",
        "channel": "force",
        "start_s": None,
        "end_s": None,
        "text": "",
        "size": told_s,
    }
    assert late.right is not None
    scene.applied = [
        replace(late, right=lambda size: abs(size - 0.3) <= statements.told_within_s(scene, 0.3))
    ]
    run["plausibility"] = [finding]
    assert (("false alarm", "delay of force") in _said(judge(scene, document, []))) == (not right)
