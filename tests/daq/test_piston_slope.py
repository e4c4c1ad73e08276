"""A piston's scale is off all the way through a motion, not where it stands and makes up for it."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.daq.guards.wiring.positions.piston import PistonJudge
from bufferstand.daq.guards.wiring.recent_state import RecentState
from bufferstand.daq.guards.wiring.sample_points import SamplePoints
from bufferstand.daq.guards.wiring.settings import WiringGuard
from bufferstand.daq.scaling import ScaledBlock

TIME = np.arange(0.0, 4.0, 0.001)
TOLD = np.interp(TIME, [0.0, 2.0, 3.0, 4.0], [0.0, 0.0, 20.0, 20.0])
STANDS = np.interp(TIME, [0.0, 2.0, 2.62, 2.9, 3.0, 4.0], [0.0, 0.0, 0.2, 12.6, 17.0, 17.0])
"""A valve's overlap and a slow actuator: for 0.6 s it hardly moves, and makes up for it then."""


def doubts(position: np.ndarray) -> list[str]:
    """Return what is said of a position until the motion ends."""
    points, judge, guard = SamplePoints({}), PistonJudge(), WiringGuard()
    found = []
    for first in range(0, 2950, 50):
        rows = slice(first, first + 50)
        time_us = np.rint(TIME[rows] * 1e6).astype(np.int64)
        values = {"command": TOLD[rows], "position": position[rows]}
        points.take(ScaledBlock("controller", first, time_us, values, 0, float(TIME[rows][-1])))
        doubt = judge._slope(
            RecentState(points, guard, True, None, None), 1, 2
        )  # the place has a judge of its own
        found += [] if doubt is None else [doubt.kind]
    return found


def test_a_piston_that_stands_and_makes_up_for_it_has_no_wrong_scale() -> None:
    assert doubts(STANDS) == []


@pytest.mark.parametrize("times", [0.85, 1.1, 2.0])
def test_one_that_goes_another_way_all_through_has(times: float) -> None:
    assert doubts(times * TOLD)[0] == "scale"


def test_one_that_goes_its_way_has_not() -> None:
    assert doubts(TOLD) == []
