"""Whether the specimen was released: a stroke that is left is told from a zero that is off, or not at all."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bufferstand.evaluation.facts.results import RequirementResult, RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.contacts import TIGHT, Approach
from tests.evaluation.signals import BUFFER, STARTED, StaticTest

LOADED = Approach(approach_mm=-0.2, contact_mm=3.0, rate_Hz=20.0)
"""It begins in contact, 3.2 mm behind the recorded zero, and every stroke does."""


FACTS = RunFacts("static-1", "static", specimen=BUFFER, started=STARTED, **TIGHT)  # type: ignore[arg-type]


def released(run: RunEvaluation) -> list[RequirementResult]:
    return [row for row in run.requirements if row.id == "full-release"]


def test_a_zero_that_is_off_is_no_residual_stroke() -> None:
    run = LOADED.evaluate(draws=0)
    assert run.first_contact is not None
    assert run.first_contact.stroke_mm is None
    rows = released(run)
    assert {row.verdict for row in rows} == {"inconclusive"}
    assert "that it is no zero of the stroke that is off, the record does not show" in rows[0].why
    assert "invalid" not in {row.verdict for row in run.requirements}


def test_a_zero_that_is_right_is_not_asked_for() -> None:
    assert {row.verdict for row in released(replace(LOADED, contact_mm=0.0).evaluate(draws=0))} == {"pass"}


@pytest.mark.parametrize(("contact_mm", "first"), [(0.0, "pass"), (3.0, "inconclusive")])
def test_a_stroke_that_is_left_shows_beside_one_that_began_deeper(contact_mm: float, first: str) -> None:
    """Whatever the zero is, and though the approach is not on record."""
    time, stroke, force = StaticTest(residual_mm=4.0, rate_Hz=20.0).columns()
    run = evaluate_run(make_record(time, stroke + contact_mm, force), FACTS, Options(draws=0))
    assert run.first_contact is not None
    assert run.first_contact.stroke_mm is None
    assert [row.verdict for row in released(run)] == [first, "fail", "fail"]


def test_a_preload_that_pulls_is_none() -> None:
    """It begins in contact, 4.2 mm behind the recorded zero."""
    run = replace(LOADED, contact_mm=4.0, preload_kN=12.0, slope=6.0).evaluate(draws=0)
    rows = [row for row in run.requirements if row.id == "preload"]
    assert {row.verdict for row in rows} == {"inconclusive"}
    assert rows[0].measured is not None
    assert rows[0].measured < 0.0
    assert "no specimen pulls" in rows[0].why
