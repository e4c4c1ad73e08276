"""What is shown of a sine's cycles: never more than are wanted, and the way in and out as what it is."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.daq.operator.progress import CampaignProgress
from bufferstand.drivers.interfaces import ControllerStatus, MotionState
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from tests.daq.cases import Lines
from tests.daq.run_in_process import facts_of, sample_plan

SAMPLES = Path(__file__).parents[2] / "sample_runs"
CAMPAIGN = f"""
[campaign]
id = "two-cycles"
stand = "{SAMPLES / "stand.toml"}"
specimen = "{SAMPLES / "specimens/category-a-elastomer.toml"}"
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 10.0
frequency_Hz = 0.5
cycles = 2
"""


class Snapshots(Lines):
    """Keeps every snapshot."""

    def __init__(self) -> None:
        super().__init__()
        self.all: list[CampaignProgress] = []

    def update(self, progress: CampaignProgress) -> None:
        self.all.append(progress)


def count_the_way_in_and_out(controller: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a controller count the growing and the fading cycle of a sine, as some do."""
    own, counted = controller.status, {"before": 0}

    def status() -> ControllerStatus:
        found: ControllerStatus = own()
        if found.state is not MotionState.WAVEFORM:
            return found
        counted["before"] = max(counted["before"], found.cycles_done)
        return replace(found, cycles_done=found.cycles_done + 1 + (found.cycles_done == 2))

    monkeypatch.setattr(controller, "status", status)


@pytest.mark.parametrize("counts_all", [pytest.param(False, marks=pytest.mark.long), True])
def test_no_more_cycles_are_shown_than_are_wanted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, counts_all: bool
) -> None:
    path = tmp_path / "campaign.toml"
    path.write_text(CAMPAIGN, encoding="utf-8")
    plan, stand_file = sample_plan(path)
    opened, shown = open_in_process(stand_file), Snapshots()
    if counts_all:
        count_the_way_in_and_out(opened.stand.controller, monkeypatch)
    outcome = run_campaign(
        plan, opened.stand, opened.clock, tmp_path / "out", facts_of(stand_file), progress=shown
    )
    assert outcome.status == "complete", outcome.reason
    sine = [one for one in shown.all if one.step == 1 and one.phase == "motion"]
    assert {one.cycle for one in sine} - {0} == {1, 2}
    assert all(one.cycle <= one.cycles == 2 for one in sine)
    texts = list(dict.fromkeys(one.cycles_text for one in sine))
    if counts_all:
        assert texts[-1] == "cycle 2 of 2, running out"
    else:
        # Two seconds each: one in, two of full amplitude, one out.
        assert texts == [
            "leading in to 2 cycles", "cycle 0 of 2", "cycle 1 of 2", "cycle 2 of 2, running out"
        ]  # fmt: skip
        lasts_s = dict.fromkeys(texts, 0.0)
        for before, one in pairwise(sine):
            lasts_s[one.cycles_text] += one.elapsed_s - before.elapsed_s
        assert list(lasts_s.values()) == pytest.approx([2.0, 2.0, 2.0, 2.0], abs=0.35)
