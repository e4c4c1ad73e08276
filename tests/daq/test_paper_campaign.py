"""The paper's campaign, all of its steps and cool-downs, on the in-process stand in virtual time."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from daq.acquisition import Pace
from daq.runner import run_campaign
from daq.session import RunSettings
from drivers.simulated.inprocess import open_in_process
from tests.daq.cases import SAMPLES
from tests.daq.run_in_process import facts_of, sample_plan

PASSES = Pace(tick_s=0.1)
"""Nobody waits for the reaction here: five times fewer passes than at a stand, the same samples."""


@pytest.mark.long
def test_the_papers_campaign_takes_less_than_two_minutes_of_a_processor(tmp_path: Path) -> None:
    plan, stand_file = sample_plan(SAMPLES / "paper.toml")
    opened = open_in_process(stand_file, log_truth=False)
    began_s = time.process_time()
    outcome = run_campaign(
        plan, opened.stand, opened.clock, tmp_path, facts_of(stand_file), settings=RunSettings(pace=PASSES)
    )
    took_s = time.process_time() - began_s
    assert (outcome.status, outcome.exit_status) == ("complete", 0), outcome.reason
    assert opened.clock.now_s() > 3600.0, "more than an hour of the stand"
    assert took_s < 120.0  # of a processor: the wall of a shared machine says nothing
    print(f"{len(outcome.runs)} runs, {opened.clock.now_s():.0f} s of the stand in {took_s:.1f} s")
