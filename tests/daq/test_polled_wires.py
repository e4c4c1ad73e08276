"""A polled controller whose reads take long: refused or said by its figures, and counted in the run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.acquisition.polled_periods import PolledPeriods
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.delivery_rate.polls import PollDelivery
from bufferstand.drivers.register_maps.profile import load_profile
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, behind_a_wire, open_in_process
from bufferstand.foundation.errors import ExitStatus
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import Lines
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign

POLLING = load_profile("polling")
SHORT = """
[[step]]
kind = "harmonic"
prestress_mm = 10.0
amplitude_mm = 3.0
frequency_Hz = 1.0
cycles = 2
"""


def run_polled(folder: Path, trip_s: float) -> tuple[CampaignOutcome, InProcessStand, Lines]:
    plan, stand_file = sample_plan(campaign(folder, SHORT))
    opened = open_in_process(stand_file, log_truth=False)
    clock, stand = opened.clock, behind_a_wire(opened, stand_file, lambda: trip_s, POLLING)
    shown = Lines()
    outcome = run_campaign(plan, stand, clock, folder / "out", facts_of(stand_file), progress=shown)
    stand.close()
    return outcome, opened, shown


@pytest.mark.parametrize("trip_ms", [5.0, 10.5])
def test_reads_that_do_not_fit_into_the_period_are_refused_by_their_figures(
    tmp_path: Path, trip_ms: float
) -> None:
    """At 10.5 ms no poll would ever count: it is refused before the silence of its samples is judged."""
    outcome, opened, _ = run_polled(tmp_path, trip_ms / 1e3)
    assert (outcome.status, outcome.exit_status) == ("refused", ExitStatus.DEVICE_FAULT)
    assert "the controller does not keep up: at most" in outcome.reason
    assert f"(2 reads of {trip_ms:.2f} ms, so {2.0 * trip_ms:.2f} ms a poll in" in outcome.reason
    assert "state rate_Hz =" in outcome.reason
    assert "power" not in outcome.reason
    assert opened.device.controller.echo_sequence == 0, "nothing was commanded"


def test_what_just_fits_is_said_and_the_run_says_how_many_periods_have_no_sample(tmp_path: Path) -> None:
    outcome, _, shown = run_polled(tmp_path, 0.0046)
    assert outcome.status == "complete", outcome.reason
    assert any("WARNING: the controller: at most 90 polls/s of 100" in line for line in shown.lines)
    (path,) = outcome.runs
    found = open_run(path)
    time_us = np.asarray(found.stream_of("force").time)
    periods = round((time_us[-1] - time_us[0]) / 1e4) + 1
    (event,) = (event for event in found.events if event.kind == "polls")
    assert 0 < periods - len(time_us) < 0.1 * periods
    assert event.text == f"{periods - len(time_us)} of {periods} polling periods have no sample"
    assert event.data["without_sample"] == periods - len(time_us)


def test_periods_are_counted_from_the_first_sample_of_a_run_to_its_last() -> None:
    counted = PolledPeriods(100.0)
    assert (counted.periods, counted.without_sample) == (0, 0)
    for first, stamps_ms, lost in ((7, [70, 80, 100], 3), (17, [170, 181], 6)):
        time_us = np.array(stamps_ms, dtype=np.int64) * 1000
        counted.take(ScaledBlock("controller", first, time_us, {}, lost, 0.0))
    assert counted.sentence() == (
        "7 of 12 polling periods have no sample, 6 of them are counted as lost in gaps"
    )
    counted.begin()
    assert counted.periods == 0


@pytest.mark.parametrize(
    ("reads", "trip_s", "most_Hz"),
    [
        (2, 0.001, (1 - 1 / 8 - 0.001 / 0.25 - 6 * 0.001) / 0.002),
        (1, 0.005, (1 - 1 / 8 - 0.005 / 0.25 - 6 * 0.005) / 0.005),
        (2, 0.0101, 0.0),  # its reads come further apart than 10 ms: no poll counts
        (1, 0.5, 0.0),
    ],
)
def test_polls_have_what_status_watchdog_and_commands_leave(
    reads: int, trip_s: float, most_Hz: float
) -> None:
    assert PollDelivery(reads, reads * trip_s, 100.0).most_Hz == pytest.approx(most_Hz, rel=1e-9)


def test_a_tenth_of_the_periods_may_be_left_out_and_that_is_said() -> None:
    fine, some, many = (PollDelivery(2, poll_s, 100.0) for poll_s in (0.008, 0.009, 0.0095))
    assert (fine.keeps_up, fine.remark) == (True, "")
    assert fine.text.startswith("keeps up: at most 104 polls/s of 100 (2 reads of 4.00 ms")
    assert some.keeps_up
    assert some.remark.endswith("or a quicker wire")
    assert "some periods will have no sample" in some.remark
    assert not many.keeps_up
    assert many.text.startswith("does not keep up: at most 87 polls/s of 100")
