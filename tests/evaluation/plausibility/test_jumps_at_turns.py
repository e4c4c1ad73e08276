"""Jumps of the force where nothing is like it: in a single event, at a turn, between two strokes."""

from __future__ import annotations

import numpy as np
import pytest

from evaluation.record import make_record
from evaluation.results import Options, RunEvaluation, RunFacts
from evaluation.run import evaluate_run
from tests.evaluation.plausibility.records import of_kind


def impact(offset_kN: float, at_s: float, *, rests_mm: float = 0.0) -> RunEvaluation:
    """Return an impact of a buffer with a preload of 30 kN, 81 mm deep, whose force moves at a moment."""
    time_s = np.arange(0.0, 2.5, 0.0005)
    way_in = np.sin(0.5 * np.pi * np.clip((time_s - 0.4) / 0.14, 0.0, 1.0))
    way_out = np.cos(0.5 * np.pi * np.clip((time_s - 0.54) / 0.36, 0.0, 1.0))
    stroke = np.where(time_s < 0.54, 81.0 * way_in, rests_mm + (81.0 - rests_mm) * way_out)
    lost = np.where(time_s < 0.54, 0.0, 0.5 * (1.0 - np.exp(-(81.0 - stroke) / 2.0)))
    force = (1.0 - lost) * (30.0 * np.clip(stroke / 0.2, 0.0, 1.0) + 0.07 * stroke**2)
    random = np.random.default_rng(2)
    force = force + offset_kN * (time_s > at_s) + 0.1 * random.standard_normal(time_s.size)
    record = make_record(time_s, stroke + 0.01 * random.standard_normal(time_s.size), force)
    return evaluate_run(record, RunFacts("i", "impact", specimen={"category": "A"}), Options(draws=0))


@pytest.mark.parametrize("offset_kN", [-40.0, 50.0])
@pytest.mark.parametrize("at_s", [0.54, 0.7, 1.2])
def test_the_force_at_rest_after_an_impact_is_not_that_before(offset_kN: float, at_s: float) -> None:
    run = impact(offset_kN, at_s)
    (jump,) = of_kind(run, "offset-jump") or of_kind(run, "gain-jump")
    assert jump.start_s - 0.001 < at_s < jump.end_s + 0.001
    assert jump.size == pytest.approx(offset_kN, abs=4.0)
    assert run.verdict == "inconclusive"


@pytest.mark.parametrize("rests_mm", [0.0, 0.1, 0.25])
def test_a_preload_that_rests_on_the_cell_after_an_impact_is_no_jump(rests_mm: float) -> None:
    run = impact(0.0, 0.0, rests_mm=rests_mm)
    assert not of_kind(run, "offset-jump")
    assert not of_kind(run, "gain-jump")
