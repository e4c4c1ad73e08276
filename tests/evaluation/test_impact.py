"""The impact test: category by stored energy, absorbed energy ratio."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evaluation.record import make_record
from evaluation.results import Options, RunEvaluation, RunFacts
from evaluation.run import evaluate_run
from tests.evaluation.signals import STATED


def impact(scale: float = 1.0, ratio: float = 0.7, **specimen: Any) -> RunEvaluation:
    """Return an impact of 32 kJ · scale that takes 0.2 s."""
    time = np.arange(0.0, 0.6, 2e-4)
    phase = np.clip((time - 0.2) / 0.2, 0.0, 1.0)
    stroke = 100.0 * np.sin(np.pi * phase)
    loading = scale * 640.0 * stroke / 100.0
    force = np.where(phase <= 0.5, loading, (1.0 - ratio) * loading)
    facts = RunFacts("impact-1", "impact", specimen={"id": "B", **specimen}, **STATED)  # type: ignore[arg-type]
    return evaluate_run(make_record(time, stroke, force), facts, Options(draws=200))


def verdicts(run: RunEvaluation) -> dict[str, str]:
    return {r.id: r.verdict for r in run.requirements}


@pytest.mark.parametrize(
    ("category", "scale", "expected"),
    [("A", 1.0, "pass"), ("B", 1.0, "fail"), ("B", 1.6, "pass"), ("C", 2.3, "pass"), ("A", 0.9, "fail")],
)
def test_category(category: str, scale: float, expected: str) -> None:
    run = impact(scale, category=category, kind="buffer", max_stroke_mm=105.0)
    assert verdicts(run) == {"stored-energy-category": expected, "absorbed-energy-ratio": "pass"}
    assert run.verdict == expected
    assert run.requirements[0].measured == pytest.approx(32000.0 * scale, rel=2e-3)


def test_ratio() -> None:
    run = impact(ratio=0.55, category="A")
    assert verdicts(run)["absorbed-energy-ratio"] == "fail"
    assert run.requirements[1].measured == pytest.approx(0.55, rel=5e-3)


def test_category_unknown() -> None:
    run = impact()
    assert verdicts(run)["stored-energy-category"] == "inconclusive"
    assert run.verdict == "inconclusive"


def test_no_impact_on_record() -> None:
    time = np.arange(0.0, 1.0, 1e-3)
    facts = RunFacts("impact-2", "impact", specimen={"category": "A"})
    run = evaluate_run(make_record(time, 0.0 * time, 0.0 * time), facts)
    assert set(verdicts(run).values()) == {"inconclusive"}
    assert run.verdict == "inconclusive"


def test_single_impact_has_a_summary() -> None:
    run = impact(category="A")
    assert run.summary.cycles_used == (1,)
    assert run.summary.values["stored_energy_J"].value == pytest.approx(32000.0, rel=2e-3)
