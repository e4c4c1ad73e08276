"""Largest speeds of noisy runs whose channels state nothing: a warning says how much of them is noise."""

from __future__ import annotations

import re

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import STATED

SPEED = 4.0 * 20.0 * 0.1
"""Of the triangle below [mm/s]."""


def noisy(noise_mm: float, **facts: object) -> RunEvaluation:
    """Return a run of triangles, 0.1 Hz, 20 mm, 200 samples a cycle."""
    time = np.arange(2200) / 20.0
    at = np.mod(0.1 * time, 1.0)
    stroke = 40.0 * np.minimum(at, 1.0 - at) + 30.0
    force = 5.0 * stroke + np.where(at > 0.5, -20.0, 20.0) * (1.0 - ((stroke - 40.0) / 10.0) ** 2)
    stroke = stroke + noise_mm * np.random.default_rng(2).standard_normal(time.size)
    return evaluate_run(
        make_record(time, stroke, force), RunFacts("n", "harmonic", **facts), Options(draws=200)  # type: ignore[arg-type]
    )  # fmt: skip


def said(run: RunEvaluation) -> list[str]:
    return [text for text in run.warnings if text.startswith("speeds: noise")]


@pytest.mark.parametrize("noise_mm", [0.05, 0.1])
def test_what_noise_makes_of_the_largest_speeds_is_said(noise_mm: float) -> None:
    run = noisy(noise_mm)
    speed = run.summary.values["speed_loading_max_mm_per_s"].value
    assert speed is not None
    (text,) = said(run)
    found = re.search(r"some (\d+) %", text)
    assert found is not None
    assert float(found[1]) / 100.0 == pytest.approx(speed / (SPEED / 2.0) - 1.0, rel=0.35)


def test_nothing_is_said_of_quiet_runs_nor_where_u_tells_it() -> None:
    assert said(noisy(5e-4)) == []
    assert said(noisy(0.1, **STATED)) == []
