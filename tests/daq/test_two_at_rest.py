"""A force at rest that the second way to it does not show: both are said, before motion and behind it."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path

import pytest

from bufferstand.daq.guards.wiring.forces.zero_difference import apart_at_rest, doubt_at_rest
from bufferstand.daq.zero.limits import ZeroLimits, zero_refusal
from bufferstand.foundation.channels.zero import ChannelZero, Zero
from bufferstand.protocols.campaign_file.zero_table import ZeroTable
from tests.daq.touch_stands import HELD, run_stand, wrong

RESTS = {"force_zero_kN": 0.6}
"""What the cell shows without a load, and both ways with it [kN]."""


def test_a_force_at_rest_that_the_second_one_does_not_show_is_doubted_and_not_unloaded(
    tmp_path: Path,
) -> None:
    ran = run_stand(tmp_path, RESTS, wrong("force", scale=12.0))
    assert (ran.outcome.status, ran.outcome.exit_status) == ("refused", 4)
    assert (ran.trip["sensor"], ran.trip["doubt"]) == ("force, force_2", "disagrees")
    assert "name = “force”, calibration" in ran.trip["setting"]
    assert "more than zero_force_max_kN = 5 kN" in ran.outcome.reason
    assert "and force_2 +0." in ran.outcome.reason
    assert "unload" not in ran.outcome.reason
    assert ran.outcome.safe_stop is not None
    assert "need be no load" in ran.outcome.safe_stop.line
    # The amplifier's sample is the first to come over a wire, and alone would show no force.
    assert not ran.outcome.safe_stop.safe
    assert "(channel force, no zero taken off; force_2 shows 0." in ran.outcome.safe_stop.line


def test_a_load_that_both_show_is_to_be_unloaded(tmp_path: Path) -> None:
    ran = run_stand(tmp_path, {"force_zero_kN": 7.0})
    assert "unload the specimen" in ran.outcome.reason
    assert not ran.trip.get("doubt")
    assert ran.outcome.safe_stop is not None
    assert "need be no load" not in ran.outcome.safe_stop.line


def test_a_second_force_that_is_far_off_is_said_where_the_touch_takes_it_off(tmp_path: Path) -> None:
    ran = run_stand(tmp_path, miswired=wrong("amplifier", zero=6.0), steps=HELD)
    assert ran.outcome.exit_status == 0, ran.outcome.reason
    assert any("WARNING: force reads" in line and "force_2 +6." in line for line in ran.lines)


@pytest.mark.parametrize(
    ("force_kN", "second_kN", "counted", "apart"),
    [
        (6.5, 0.5, False, True), (6.5, 6.2, False, False), (3.0, 0.0, False, False), (3.0, 0.0, True, True),
        (-9.0, 0.7, False, True), (0.5, 9.0, False, True), (100.0, 91.0, True, False),
        (math.nan, 0.0, False, False), (7.0, None, False, False),
    ],
)  # fmt: skip
def test_within_class_and_zero_both_agree(
    force_kN: float, second_kN: float | None, counted: bool, apart: bool
) -> None:
    doubt = doubt_at_rest(force_kN, second_kN, counted=counted)
    assert (doubt is not None) is apart
    if doubt is not None and second_kN is not None:
        larger = "force" if abs(force_kN) > abs(second_kN) else "force_2"
        assert doubt.sensor.startswith(f"{larger}, ")
        assert doubt.text in apart_at_rest(force_kN, second_kN, counted=counted)


@pytest.mark.parametrize(("second_kN", "said"), [(0.5, True), (6.4, False)])
def test_a_zero_that_is_refused_says_what_the_second_force_reads(second_kN: float, said: bool) -> None:
    values = {"force": 6.5, "force_2": second_kN}
    channels = tuple(ChannelZero(name=name, unit="kN", value=value, u=0.1) for name, value in values.items())
    zero = Zero(how="tare", found=datetime.now(UTC), channel=channels)
    why = zero_refusal(zero, ZeroTable(), ZeroLimits(5.0, 5.0, 1.0))
    assert ("force_2 +0.50 kN of one transducer" in why) is said
    assert "unload the specimen" in why
