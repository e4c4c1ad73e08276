"""What a report warns of: limits passed, targets missed, conditions close to their edge; nothing planned."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.report.sections.attention import beyond_limits, missed_targets, near_conditions
from bufferstand.evaluation.report.sections.statements import warnings_section
from bufferstand.evaluation.report.source.source import ReportSource
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import requirement
from tests.evaluation_report.test_content import strings, with_evaluated, with_run
from tests.house.test_recipes import RUNS


def warned(source: ReportSource) -> list[str]:
    section = warnings_section(source)
    return [] if section is None else list(strings([dataclasses.asdict(block) for block in section.blocks]))


@pytest.mark.parametrize(("limit_kN", "passed"), [(500.0, True), (600.0, False)])
def test_a_force_above_the_limit_in_force_is_warned_of(report: Made, limit_kN: float, passed: bool) -> None:
    metadata = {**report.source.runs[0].metadata}
    metadata["limits"] = {"in_force": {"force_max_kN": {"value": limit_kN, "source": "[limits]"}}}
    source = with_run(report.source, 1, metadata=metadata)
    extreme = source.runs[0].extreme("force_max_kN")
    assert extreme is not None
    assert extreme.value is not None
    assert 500.0 < extreme.value < 600.0
    texts = [text for text in beyond_limits(source) if text.startswith("Run 1: the force")]
    assert bool(texts) is passed
    assert all("above the limit of 500 kN, set by [limits]." in text for text in texts)
    assert set(texts) <= set(warned(source))


def test_a_step_that_missed_its_target_is_warned_of(report: Made) -> None:
    row: dict[str, Any] = {"reached_mean_mm": 45.0, "cycles": 8, "cycles_off": "1-3"}
    run = dataclasses.replace(report.source.runs[2], strokes=(row, {**row, "cycles_off": ""}))
    assert missed_targets(run) == [
        "Run 3: the stroke missed its target in cycles 1-3 of 8; see Strokes and forces reached."
    ]


def condition(measured: float, cycle: int = 1, **more: Any) -> dict[str, Any]:
    row = requirement("temperature-range", cycle, "pass", measured=measured, unit="°C")
    return {**row, "lower_limit": 15.0, "upper_limit": 25.0, "expanded_uncertainty": 0.1, **more}


@pytest.mark.parametrize(
    ("rows", "near"),
    [
        ([condition(20.0), condition(24.6, 2)], "24.60 ± 0.10 °C, permitted 15 … 25 °C"),
        ([condition(24.0, expanded_uncertainty=1.5)], "24.0 ± 1.5 °C"),
        ([condition(20.0), condition(23.9, 2)], ""),
        ([condition(25.4, verdict="fail")], ""),
        ([condition(24.9, unit="cycles")], ""),
    ],
)
def test_a_condition_close_to_its_edge_is_warned_of_once(
    report: Made, rows: list[dict[str, Any]], near: str
) -> None:
    texts = near_conditions(with_evaluated(report.source, 1, requirements=rows))
    assert len(texts) == bool(near)
    assert all("Temperature of the test in cycle" in text and near in text for text in texts)


def test_a_lead_in_is_a_note_and_a_cycle_lost_on_the_way_is_a_warning(report: Made) -> None:
    (entry,) = evaluate_paths([RUNS / "005-harmonic-20mm-20mm-1.27Hz.h5"])["runs"]
    assert len([text for text in entry["notes"] if text.startswith(("cycle 1:", "cycle 8:"))]) == 2
    assert set(entry["notes"]) <= set(entry["warnings"])
    lost = "cycle 4: not evaluated, no figures: 80 samples lost"
    evaluated = {"warnings": [*entry["warnings"], lost], "notes": entry["notes"]}
    texts = warned(with_evaluated(report.source, 5, **evaluated))
    assert f"Run 5: {lost}." in texts
    assert not [text for text in texts if text.startswith("Run 5: cycle") and lost not in text]


def test_what_the_rows_of_requirements_say_is_a_note() -> None:
    (entry,) = evaluate_paths([RUNS / "001-static-5mm_s.h5"])["runs"]
    assert [text for text in entry["notes"] if "the requirement says why" in text]
    assert [text for text in entry["notes"] if "no edition and no clause of EN 15551" in text]
