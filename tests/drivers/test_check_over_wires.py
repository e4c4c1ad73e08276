"""What `check` says of a wire, in virtual time."""

from __future__ import annotations

import pytest

from drivers.check import check_devices
from drivers.check_rows import CheckRow
from drivers.check_verdict import Verdict
from drivers.simulated.inprocess import open_in_process
from drivers.simulated.virtual_link import behind_a_wire
from drivers.stand_file import load_stand
from tests.drivers.conftest import SAMPLE_STAND


def rows_over(trip_s: float) -> dict[str, CheckRow]:
    """Check the controller of the shipped stand over a wire."""
    stand_file = load_stand(SAMPLE_STAND)
    opened = open_in_process(stand_file, log_truth=False)
    controller = behind_a_wire(opened, stand_file, lambda: trip_s).controller
    rows = check_devices(stand_file, controller, (), opened.clock, watch_s=1.0)
    return {row.item: row for row in rows}


@pytest.mark.parametrize(
    ("trip_ms", "verdict"),
    [
        (0.04, Verdict.OK),
        (5.0, Verdict.OK),
        (10.0, Verdict.OK),
        (10.7, Verdict.FAULT),
        (11.5, Verdict.FAULT),
        (20.0, Verdict.FAULT),
    ],
)
def test_it_says_whether_the_wire_keeps_up(trip_ms: float, verdict: Verdict) -> None:
    rows = rows_over(trip_ms / 1e3)
    row = rows["keeping up"]
    assert row.verdict is verdict, row
    assert row.figures["block_round_trip_ms"] == pytest.approx(trip_ms, abs=0.01)
    assert row.figures["samples_per_block"] == 14.0
    assert row.figures["longest_round_trip_ms"] == pytest.approx(10.576, abs=0.01)
    assert (row.figures["most_Hz"] > 1000.0) is (trip_ms < 11.0)
    if verdict is Verdict.OK:
        assert rows["sample rate"].verdict is Verdict.OK, rows["sample rate"]
