"""Which stored zero a start of a campaign offers, and when a damaged one matters."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.cli.campaign.preparation import prepare
from bufferstand.cli.campaign.running import zero_to_offer
from bufferstand.daq.zero.file import stored_path
from bufferstand.foundation.errors import BadInput
from tests.daq.test_in_process import NO_TOUCH, campaign

STEP = """
[[step]]
kind = "hold"
stroke_mm = 5.0
duration_s = 1.0
"""


@pytest.mark.parametrize("zero", ["", '[zero]\non_resume = "take-over"\n'])
def test_a_damaged_zero_stops_no_campaign_that_touches_off(tmp_path: Path, zero: str) -> None:
    prepared = prepare(campaign(tmp_path, STEP, zero=zero))
    stored_path(prepared.stand_home).write_text("how = [", encoding="utf-8")
    assert zero_to_offer(prepared) is None


def test_it_stops_one_that_takes_it_over_and_is_named(tmp_path: Path) -> None:
    prepared = prepare(campaign(tmp_path, STEP, zero=NO_TOUCH))
    path = stored_path(prepared.stand_home)
    path.write_text("how = [", encoding="utf-8")
    with pytest.raises(BadInput) as caught:
        zero_to_offer(prepared)
    assert caught.value.file == str(path)
