"""Records that nobody here made: a friction damper under sine stroke (imperial units, two-sided, ramped)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.units import to_inside

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
FILES = ("friction_damper_1Hz.csv", "friction_damper_0.5Hz.csv")

pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason="REAL RECORDS NOT HERE: shared/data is not beside the repository"
)


def record_of(name: str) -> Record:
    time, inches, kip = np.loadtxt(DATA / name, delimiter=",", skiprows=1).T
    return make_record(time, to_inside(inches, "stroke", "in"), to_inside(kip, "force", "kip"))


def evaluated(name: str) -> tuple[RunEvaluation, list[dict[str, Any]]]:
    expected = json.loads((DATA / "friction_damper_expected.json").read_text(encoding="utf-8"))[name]
    return evaluate_run(record_of(name), RunFacts(name, "harmonic")), expected


@pytest.mark.parametrize("name", FILES)
def test_cycles_are_found(name: str) -> None:
    run, expected = evaluated(name)
    complete = [r for r in run.cycles if r.cycle.complete]
    assert len(complete) == len(expected) == 6
    assert [r.cycle.steady for r in complete] == [e["steady"] for e in expected]
    assert sum(r.cycle.steady for r in complete) == 2
    for result, known in zip(complete, expected, strict=True):
        q = result.quantities
        # The known strokes are extreme samples; fitted turning points lie a little inside.
        assert q.stroke_min_mm == pytest.approx(known["stroke_min_mm"], abs=0.02)
        assert q.stroke_max_mm == pytest.approx(known["stroke_max_mm"], abs=0.02)
        assert q.frequency_Hz == pytest.approx(known["frequency_Hz"], rel=0.01)
        within = 1e-3 if known["steady"] else 0.01
        assert q.absorbed_energy_J == pytest.approx(known["absorbed_energy_J"], rel=within)


@pytest.mark.parametrize("name", FILES)
def test_what_is_said_of_them(name: str) -> None:
    run, _ = evaluated(name)
    assert run.verdict is None
    assert run.requirements == ()
    damping = run.summary.values["damping"]
    assert damping.value is not None
    assert damping.value > 1.0
    assert damping.expanded_uncertainty is None
    assert any("not meaningful" in w for w in run.warnings)
    assert any("no expanded uncertainties" in w for w in run.warnings)
    assert any("no temperature" in w for w in run.warnings)
    assert run.record.breaks == ()


@pytest.mark.parametrize("name", FILES)
def test_nothing_is_held_against_them(name: str) -> None:
    run, _ = evaluated(name)
    assert run.findings == ()
