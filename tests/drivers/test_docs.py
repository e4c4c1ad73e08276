from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.drivers.controllers.command_port import REJECT_TEXTS
from bufferstand.drivers.delivery_rate.blocks import WORK_S, Delivery
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.drivers.thermometers.ds18b20 import ReadingFault

TEXT = (Path(__file__).parents[2] / "docs" / "drivers.md").read_text(encoding="utf-8")
SENSORS = (Path(__file__).parents[2] / "docs" / "sensors.md").read_text(encoding="utf-8")


def test_codes_have_a_meaning(profile: Profile) -> None:
    description = profile.find("reject_code").description
    assert all(f"{code} " in description for code in REJECT_TEXTS)
    assert len(ReadingFault) == 13
    assert "Thirteen different faults" in SENSORS


def numbers_below(heading: str) -> list[list[float]]:
    """Return the rows of the table that begins with a heading; units are left out."""
    rows = TEXT[TEXT.index(heading) :].split("\n\n")[0].splitlines()[2:]
    cells = [
        [cell.strip().removesuffix(" ms").replace(" ", "") for cell in row.split("|")[1:-1]] for row in rows
    ]
    return [[float(cell) for cell in row] for row in cells]


def test_what_a_network_carries_is_what_is_reckoned() -> None:
    rows = numbers_below("| controller answers in |")
    assert len(rows) == 5
    for trip_ms, together_Hz, apart_Hz in rows:
        trip_s = trip_ms / 1e3
        assert Delivery(14, trip_s, 1000.0, trip_s, trip_s).most_Hz == pytest.approx(together_Hz, rel=0.02)
        apart = Delivery(14, 2.0 * trip_s, 1000.0, trip_s, trip_s, WORK_S)
        assert apart.most_Hz == pytest.approx(apart_Hz, rel=0.02)
    longest_ms = Delivery(14, 0.01, 1000.0, 0.01, 0.01).longest_trip_s * 1e3
    assert f"a block must take less than {longest_ms:.1f} ms" in TEXT


def test_what_a_line_carries_is_what_is_reckoned() -> None:
    waits_s = 0.0024  # of pymodbus, measured
    rows = numbers_below("| baud | bytes of a block")
    assert len(rows) == 5
    for baud, block_ms, most_Hz, campaign_Hz in rows:
        byte_s = 11.0 / baud
        assert 264 * byte_s * 1e3 == pytest.approx(block_ms, rel=0.01)
        assert 14 / (264 * byte_s) == pytest.approx(most_Hz, rel=0.01)
        block_s, status_s, feed_s = ((bytes_ + 7) * byte_s + waits_s for bytes_ in (264, 70, 16))
        carried = Delivery(14, block_s, 300.0, status_s, feed_s, WORK_S)
        assert carried.most_Hz == pytest.approx(campaign_Hz, rel=0.02)
