"""The paper's whole grid on the in-process stand in virtual time, and sooner in the planner's order."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.daq.cases import SAMPLES
from tests.daq.orders import campaign_as_given, measure
from tests.daq.run_in_process import sample_plan


@pytest.mark.long
def test_the_papers_grid_takes_less_than_two_minutes_and_the_planners_order_wins(tmp_path: Path) -> None:
    soonest = measure(SAMPLES / "paper-full.toml", tmp_path / "soonest")
    given = measure(campaign_as_given(tmp_path), tmp_path / "given")
    for found in (soonest, given):
        outcome = found.outcome
        assert (outcome.status, outcome.exit_status) == ("complete", 0), outcome.reason
        assert len(outcome.runs) >= sum(step.run_kind is not None for step in found.plan.steps)
        assert found.waited_s > 3600.0, "its cool-downs are in it"
        assert found.stand_s == pytest.approx(found.plan.expected_duration_s, rel=0.15)
    assert soonest.processor_s < 120.0  # of a processor: the wall of a shared machine says nothing
    ordering = soonest.plan.ordering
    assert ordering is not None
    reported, measured = (1.0 - one / other for one, other in (
        (ordering.chosen_s, ordering.given_s), (soonest.stand_s, given.stand_s)
    ))  # fmt: skip
    assert measured > 0.2
    assert measured == pytest.approx(reported, abs=0.08)
    print(f"{soonest.stand_s:.0f} s of {given.stand_s:.0f} s: {measured:.0%} less (planned {reported:.0%})")


@pytest.mark.slow
def test_the_margin_is_said_by_the_plan() -> None:
    plan, _ = sample_plan(SAMPLES / "paper-full.toml")
    assert plan.ordering is not None
    assert plan.ordering.chosen_s < 0.75 * plan.ordering.given_s
    assert "% less)" in plan.ordering.sentence()
