"""A stroke zero that is lost where nothing leaps: the specimen is met earlier than before."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.contacts import TIGHT, Approach
from tests.evaluation.signals import BUFFER, STARTED

TEST = Approach()
STROKE_S = 2.0 * (102.0 + TEST.approach_mm) / TEST.speed_mm_per_s + 2.0
SLIPS_S = 1.0 + 0.5 * STROKE_S + 10.0
"""On the first way out."""
LASTS_S = 2.0
"""So slowly that it is no leap: the way out is faster by a share."""


def _run(by_mm: float, gain: float = 1.0, *, after: int = 1) -> RunEvaluation:
    """Evaluate a test whose stroke and force read other from behind that many strokes on."""
    time, stroke, force = TEST.columns()
    slips_s = SLIPS_S + (after - 1) * STROKE_S
    moved = np.clip((time - slips_s) / LASTS_S, 0.0, 1.0)
    facts = RunFacts("static-1", "static", specimen=BUFFER, started=STARTED, **TIGHT)
    record = make_record(time, stroke + by_mm * moved, force * (1.0 + (gain - 1.0) * moved))
    return evaluate_run(record, facts, Options(draws=100))


@pytest.mark.parametrize("after", [1, 2])
def test_a_zero_that_is_lost_without_a_leap_is_found_by_where_the_specimen_is_met(after: int) -> None:
    run = _run(-6.0, after=after)
    found = [one for one in run.findings if one.kind == "stroke-jump"]
    assert [one.size for one in found] == [pytest.approx(-6.0, abs=0.2)]
    assert f"between strokes {after} and {after + 1}" in found[0].text
    forces = {row.cycle: row.verdict for row in run.requirements if row.id == "force-at-25mm"}
    assert forces[after + 1] == "inconclusive"
    assert set(found[0].cycles) == set(range(after, 4))


@pytest.mark.parametrize(
    ("by_mm", "gain"),
    [
        pytest.param(0.0, 1.0, id="sound"),
        pytest.param(-1.0, 1.0, id="less than 2 % of the range"),
        pytest.param(6.0, 1.0, id="met later, as a specimen that took a set"),
        pytest.param(0.0, 1.1, id="a force that is greater by a share"),
        pytest.param(0.0, 0.9, id="a specimen that softened"),
    ],
)
def test_what_specimens_do_is_no_lost_zero(by_mm: float, gain: float) -> None:
    assert [one for one in _run(by_mm, gain).findings if one.kind == "stroke-jump"] == []


def test_a_specimen_that_recovers_from_a_set_is_no_lost_zero() -> None:
    time, stroke, force = TEST.columns()
    second = (time > SLIPS_S) & (time <= SLIPS_S + STROKE_S)
    ways = np.clip((time - SLIPS_S) / LASTS_S, 0.0, 1.0) * np.clip(
        (SLIPS_S + STROKE_S - time) / LASTS_S, 0.0, 1.0
    )
    assert np.all(ways[~second] == 0.0)
    facts = RunFacts("static-1", "static", specimen=BUFFER, started=STARTED, **TIGHT)
    run = evaluate_run(make_record(time, stroke + 4.0 * ways, force), facts, Options(draws=100))
    assert [one for one in run.findings if one.kind == "stroke-jump"] == []
