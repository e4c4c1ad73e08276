"""On a stand that runs faster than the wall both ways to the force are compared while the force stands."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.daq.guards.wiring.forces.jumped_channel import ChannelJump
from bufferstand.daq.guards.wiring.forces.rests import REST_S, Rests
from bufferstand.daq.guards.wiring.forces.track import ForceTrack
from bufferstand.daq.guards.wiring.forces.two_channels import JUMPED
from bufferstand.daq.guards.wiring.forces.zero_difference import APART_KN, APART_SHARE
from bufferstand.daq.scaling import ScaledBlock
from tests.daq.wiring_later import rough_alarms

HZ, HELD_KN = 250.0, 80.0


def _force_kN(time_s: np.ndarray) -> np.ndarray:  # noqa: N802 - the unit keeps its capital
    """A ramp, a hold in which a specimen relaxes, a release within 0.3 s, and rest."""
    held_kN = HELD_KN - 0.1 * np.clip(time_s - 10.0, 0.0, 15.0)
    shape = np.interp(time_s, [0.0, 2.0, 10.0, 25.0, 25.3], [0.0, 0.0, 1.0, 1.0, 0.0])
    return np.asarray(shape * held_kN)


def _left(late_s: float, name: str, by_kN: float, from_s: float) -> tuple[ChannelJump | None, float]:
    """Return the first jump that is told of two forces, the second one stamped late, and when."""
    random, time_s = np.random.default_rng(3), np.arange(0.0, 30.0, 1.0 / HZ)
    true_kN = _force_kN(time_s) + np.where(time_s >= from_s, by_kN, 0.0)
    tracks = {one: ForceTrack(one) for one in ("force", "force_2")}
    rests, rows = Rests(), 25
    for row in range(0, len(time_s), rows):
        now = slice(row, row + rows)
        for one, track in tracks.items():
            kN = true_kN[now] if one == name else _force_kN(time_s[now])
            value = kN + random.normal(0.0, 0.15, len(kN))
            moved_s = late_s if one == "force_2" else 0.0
            stamps_us = np.rint((time_s[now] + moved_s) * 1e6).astype(np.int64)
            track.take(ScaledBlock(one, row, stamps_us, {one: value}, 0, float(time_s[now][-1])), 0.0)
        until_s = min(track.newest_s for track in tracks.values())
        rest = rests.look(tracks["force"], tracks["force_2"], until_s)
        if rest and (jump := rests.parted(rest, JUMPED * APART_KN, APART_SHARE)):
            return jump, until_s
    return None, np.inf


@pytest.mark.parametrize("late_s", [-0.5, 0.0, 1.0])
@pytest.mark.parametrize(("name", "by_kN"), [("force", 5.0), ("force_2", -5.0)])
def test_a_force_that_leaves_the_other_in_a_hold_is_named(late_s: float, name: str, by_kN: float) -> None:
    jump, at_s = _left(late_s, name, by_kN, 16.0)
    assert jump is not None
    assert jump.name == name
    assert jump.size_kN == pytest.approx(by_kN, abs=3.0)
    assert 0.0 < at_s - 16.0 < 2.0 * REST_S


@pytest.mark.parametrize("late_s", [-1.5, -0.5, 0.0, 0.5, 1.5])
def test_stamps_that_are_off_by_a_second_are_no_doubt(late_s: float) -> None:
    assert _left(late_s, "force", 0.0, 0.0) == (None, np.inf)


@pytest.mark.parametrize(("seed", "late_s"), [(23, 0.05), (70, -0.1)])
def test_nor_are_holes_stalls_and_hum_at_ten_times_the_speed_of_the_wall(seed: int, late_s: float) -> None:
    assert rough_alarms((seed,), 10.0, late_s) == []


@pytest.mark.long
@pytest.mark.parametrize("late_s", [-0.1, 0.0, 0.1])
def test_nor_two_hundred_rough_stands(late_s: float) -> None:
    assert rough_alarms(range(200), 10.0, late_s) == []
