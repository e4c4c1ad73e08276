"""Simulated and real runs of one specimen are points of no trend together, and a set of both says so."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bufferstand.evaluation.across_runs.trends import find_trends
from bufferstand.evaluation.document.build import evaluation_document
from bufferstand.evaluation.facts.results import RunEvaluation
from tests.evaluation.test_trends import SWEEP


def marked(runs: list[RunEvaluation], *simulated: bool | None) -> list[RunEvaluation]:
    return [
        replace(run, facts=replace(run.facts, simulated=state))
        for run, state in zip(runs, simulated, strict=True)
    ]


def test_trends_of_simulated_and_of_real_runs_are_apart() -> None:
    mixed = evaluation_document(marked(SWEEP, True, False, True, False))
    assert [trend["runs"] for trend in mixed["trends"]] == [
        ["r0.1", "r1.0"], ["r0.1", "r1.0"], ["r0.5", "r2.0"], ["r0.5", "r2.0"],
    ]  # fmt: skip
    assert [entry["run"]["simulated"] for entry in mixed["runs"]] == [True, False, True, False]
    (said,) = mixed["warnings"]
    assert said.startswith("2 of 4 runs were made on a simulated stand, the others not")


@pytest.mark.parametrize("state", [True, False, None])
def test_of_a_set_of_one_kind_no_figure_changes_and_nothing_is_said(*, state: bool | None) -> None:
    alike = marked(SWEEP, *[state] * 4)
    assert find_trends(alike) == find_trends(SWEEP)
    assert evaluation_document(alike)["warnings"] == []


def test_what_nobody_knows_of_is_no_simulated_run() -> None:
    """An import beside a measured run, as always."""
    both = marked(SWEEP, None, False, None, False)
    assert find_trends(both) == find_trends(SWEEP)
    assert evaluation_document(both)["warnings"] == []
