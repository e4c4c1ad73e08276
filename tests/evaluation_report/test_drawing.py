"""Figures drawn in another process beside this one."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
import pytest

import bufferstand.evaluation.report.drawing as drawing_module
from bufferstand.evaluation.figures import Plot, TimelineStep, Trace, draw, stroke_plot
from bufferstand.evaluation.report.drawing import drawing
from bufferstand.evaluation.wording import ENGLISH, Language, language_of


def _plots(count: int) -> list[Plot]:
    return [
        stroke_plot(
            [Trace("stroke", np.arange(3.0), np.array([0.0, float(number), 0.0]))],
            [TimelineStep(f"step {number}", 0.0, 2.0)],
        )
        for number in range(1, count + 1)
    ]


@pytest.fixture
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing_module, "usable_cores", lambda: 2)


def _die(plot: Plot, language: Language) -> str:
    del plot, language
    os._exit(1)


@pytest.mark.slow
@pytest.mark.usefixtures("two_cores")
@pytest.mark.parametrize("language", ["en", "cs"])
def test_whoever_draws_a_figure_it_is_the_same(language: str) -> None:
    plots, spoken = _plots(10), language_of(language)
    with drawing(plots, spoken, None) as drawn:
        assert drawn() == [draw(plot, spoken) for plot in plots]


@pytest.mark.usefixtures("two_cores")
def test_the_other_process_draws_the_first_half(monkeypatch: pytest.MonkeyPatch) -> None:
    here: list[Plot] = []

    def draw_here(plot: Plot, language: Language) -> str:
        here.append(plot)
        return draw(plot, language)

    plots = _plots(10)
    original = drawing_module.handed_out
    monkeypatch.setattr(drawing_module, "handed_out", lambda pool, _, *given: original(pool, draw, *given))
    monkeypatch.setattr(drawing_module, "draw", draw_here)
    with drawing(plots, ENGLISH, 2) as drawn:
        drawn()
    assert here == plots[5:]


@pytest.mark.slow
@pytest.mark.usefixtures("two_cores")
def test_what_a_process_that_dies_had_begun_is_drawn_here(monkeypatch: pytest.MonkeyPatch) -> None:
    plots, spoken = _plots(10), ENGLISH
    original = drawing_module.handed_out
    monkeypatch.setattr(drawing_module, "handed_out", lambda pool, _, *given: original(pool, _die, *given))
    with drawing(plots, spoken, None) as drawn:
        assert drawn() == [draw(plot, spoken) for plot in plots]


@pytest.mark.parametrize(("count", "jobs"), [(10, 1), (3, None)])
def test_no_process_is_begun_where_it_is_not_worth_it_or_not_wanted(
    count: int, jobs: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(jobs: int) -> Sequence[str]:
        raise AssertionError(jobs)

    monkeypatch.setattr(drawing_module, "spawned_workers", refuse)
    plots, spoken = _plots(count), ENGLISH
    with drawing(plots, spoken, jobs) as drawn:
        assert drawn() == [draw(plot, spoken) for plot in plots]
