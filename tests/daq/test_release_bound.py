"""A release on a wrong force ends where nothing presses the specimen; one under a load goes on."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.motions.release_bound import GROWN_MM, UNTOUCHED_MM, ReleaseBound
from tests.daq.touch_stands import STATIC, run_stand, wrong

CONTACT_MM = 1.5


def ended_mm(force_at: np.ndarray, ways_mm: np.ndarray, contact_mm: float | None) -> float:
    """Return where a release is said to have let go, shown every 0.1 mm; not a number where it is not."""
    bound = ReleaseBound(float(ways_mm[0]), contact_mm)
    for at_mm, force_kN in zip(ways_mm, force_at, strict=True):
        if bound.look(float(at_mm), float(force_kN), float(force_kN)):
            return float(at_mm)
    return math.nan


def test_a_force_that_stays_ends_it_behind_first_contact() -> None:
    back = np.arange(60.0, -60.0, -0.1)
    still = np.full(len(back), 3.0)
    assert ended_mm(still, back, CONTACT_MM) == pytest.approx(-GROWN_MM, abs=0.2)
    assert ended_mm(still, back, -4.0) == pytest.approx(-4.0 - GROWN_MM, abs=0.2)
    assert ended_mm(still, back, None) == pytest.approx(-UNTOUCHED_MM, abs=0.2)
    assert ended_mm(np.full(len(back), math.nan), back, None) == pytest.approx(-UNTOUCHED_MM, abs=0.2)


@pytest.mark.parametrize("off_mm", [0.0, 15.0, -15.0])
def test_a_load_that_is_taken_away_does_not_end_it_though_the_position_is_off(off_mm: float) -> None:
    """A specimen from 60 to 0 mm with a position that is off, and nobody touched off."""
    back = np.arange(60.0, 0.0, -0.1)
    load = 3.0 * back
    assert math.isnan(ended_mm(load, back + off_mm - 12.0, None))
    assert math.isnan(ended_mm(load, -back, None)), "a position of the wrong sign"


def test_a_force_that_changes_with_the_way_ends_it_later() -> None:
    back = np.arange(60.0, -60.0, -0.1)
    assert ended_mm(back, back, CONTACT_MM) == pytest.approx(-20.0, abs=0.2), "its input has the piston's way"
    assert ended_mm(back, back, None) == pytest.approx(-50.0, abs=0.2)


def test_what_shows_no_position_ends_nothing() -> None:
    assert math.isnan(ended_mm(np.full(100, 9.0), np.full(100, math.nan), None))


@pytest.mark.slow
@pytest.mark.parametrize("wrongly", [{"zero": 3.0, "from_s": 14.0}, {"frozen_at_s": 14.0}])
def test_a_campaigns_release_on_a_force_that_never_falls_ends_soon(
    tmp_path: Path, wrongly: dict[str, float]
) -> None:
    ran = run_stand(tmp_path, miswired=wrong("force", **wrongly), steps=STATIC.format(force_kN=300.0))
    report = ran.outcome.safe_stop
    assert report is not None
    assert report.duration_s < 20.0
    assert not report.safe, "the force that is read is not seen to be none"
    assert "the stand has let go: the piston is 6." in report.line
    assert "mm back from first contact" in report.line
    assert ran.outcome.exit_status == 4
