"""Campaigns over wires of several round trips, with the driver of a real controller, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault, parse_fault
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, behind_a_wire, open_in_process
from bufferstand.foundation.errors import ExitStatus
from bufferstand.recording.runfile.file import open_run
from tests.daq.killed_over_a_wire import profile_of
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign

SHORT = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 4
[[step]]
kind = "static"
speed_mm_per_s = 20.0
force_limit_kN = 100.0
cycles = 1
"""


def run_over(
    folder: Path,
    round_trip_s: float,
    *,
    faults: Sequence[ScheduledFault] = (),
    profile: Profile | None = None,
    head: str = "",
    settings: RunSettings | None = None,
) -> tuple[CampaignOutcome, InProcessStand]:
    plan, stand_file = sample_plan(campaign(folder, head + SHORT))
    opened = open_in_process(stand_file, faults=faults)
    stand = behind_a_wire(opened, stand_file, lambda: round_trip_s, profile)
    outcome = run_campaign(plan, stand, opened.clock, folder / "out", facts_of(stand_file), settings=settings)
    stand.close()
    return outcome, opened


def stamps_of(path: Path) -> np.ndarray:
    return np.asarray(open_run(path).stream_of("force").time)


@pytest.mark.dose(2)
@pytest.mark.parametrize(
    "round_trip_ms", [0.04, 2.0, 10.0, *(pytest.param(ms, marks=pytest.mark.long) for ms in (1.0, 5.0))]
)
def test_a_campaign_runs_at_any_round_trip_that_keeps_up(tmp_path: Path, round_trip_ms: float) -> None:
    outcome, opened = run_over(tmp_path, round_trip_ms / 1e3)
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    truth = opened.truth.arrays()
    for path in outcome.runs:
        found = open_run(path)
        assert found.gaps("controller") == []
        time_us = stamps_of(path)
        assert np.all(np.diff(time_us) == 1000), "every sample is there, once"
        inside = (truth["time_us"] >= time_us[0]) & (truth["time_us"] <= time_us[-1])
        assert np.array_equal(truth["time_us"][inside], time_us)
        assert not [event.text for event in found.events if event.kind == "trip"]


@pytest.mark.parametrize(
    "round_trip_ms", [2.0, *(pytest.param(ms, marks=pytest.mark.long) for ms in (0.04, 5.0))]
)
def test_a_controller_without_function_23_takes_two_round_trips(tmp_path: Path, round_trip_ms: float) -> None:
    outcome, _ = run_over(tmp_path, round_trip_ms / 1e3, profile=profile_of("apart"))
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    assert all(np.all(np.diff(stamps_of(path)) == 1000) for path in outcome.runs)


@pytest.mark.parametrize(("round_trip_ms", "apart"), [(12.0, False), (6.0, True), (30.0, False)])
def test_a_wire_that_does_not_keep_up_is_refused_before_anything_moves(
    tmp_path: Path, round_trip_ms: float, apart: bool
) -> None:
    profile = profile_of("apart" if apart else "together")
    outcome, opened = run_over(tmp_path, round_trip_ms / 1e3, profile=profile)
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert "does not keep up: at most" in outcome.reason
    assert "a block must take less than 11.0 ms" in outcome.reason
    assert not opened.device.controller.valve_on
    assert opened.device.controller.echo_sequence == 0, "nothing was commanded"


MISSED = [(9.0, 1), (9.5, 2), (10.0, 1), (11.25, 5)]


def test_missed_cycles_are_gaps_in_their_place_and_no_emergency(tmp_path: Path) -> None:
    faults = [parse_fault(f"controller=clock-jump@{at_s},jump_s={n / 1e3}") for at_s, n in MISSED]
    outcome, _ = run_over(tmp_path, 0.002, faults=faults)
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    gaps = [gap for path in outcome.runs for gap in open_run(path).gaps("controller")]
    steps = np.concatenate([np.diff(stamps_of(path)) for path in outcome.runs])
    assert [lost for _, lost in gaps] == [n for _, n in MISSED]
    assert (steps[steps != 1000] // 1000 - 1).tolist() == [n for _, n in MISSED]
    texts = [event.text for path in outcome.runs for event in open_run(path).events]
    assert sum("that the controller missed" in text for text in texts) == len(MISSED)


def test_too_many_missed_cycles_stop(tmp_path: Path) -> None:
    faults = [parse_fault(f"controller=clock-jump@{at_s},jump_s={n / 1e3}") for at_s, n in MISSED]
    head = "[guards]\nmissed_cycles_max_per_min = 3\n"
    outcome, opened = run_over(tmp_path, 0.002, faults=faults, head=head)
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert "the controller missed 4 cycles of its loop within 60 s, more than 3" in outcome.reason
    assert not opened.device.controller.valve_on


def test_a_stand_that_waits_for_its_reader_is_not_refused_for_a_slow_wire(tmp_path: Path) -> None:
    """On a busy computer the round trip to a simulated stand is that of its processor time."""
    outcome, _ = run_over(tmp_path, 0.03, settings=RunSettings(waited_for=True))
    assert "keep up" not in outcome.reason
    assert "behind the stand" not in outcome.reason
    assert outcome.runs, "it has begun"


def test_one_that_only_says_so_is_not_refused_either_but_stays_under_the_lag_guard(tmp_path: Path) -> None:
    """It says so and loses samples nevertheless: its reader falls behind, and that stops the campaign."""
    outcome, _ = run_over(tmp_path, 0.03, settings=RunSettings(says_it_waits=True))
    assert "keep up" not in outcome.reason
    assert "the reader has been behind the stand" in outcome.reason
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT
