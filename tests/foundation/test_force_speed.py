"""The force–speed curve: between its pairs, beyond them, and what is none."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.force_speed import ForceSpeed, curve_problem

STALL_KN, FREE_MM_PER_S = 700.0, 800.0


def valve(force_kN: float) -> float:
    return FREE_MM_PER_S * math.sqrt(1.0 - force_kN / STALL_KN)


def test_a_table_of_the_root_never_promises_more_than_the_valve() -> None:
    curve = ForceSpeed(tuple((force, valve(force)) for force in (0.0, 150.0, 300.0, 450.0, 600.0, 700.0)))
    for force in range(0, 701, 7):
        assert curve.speed_at(force) <= valve(force) + 1e-9
    for force in (150.0, 450.0):
        assert curve.speed_at(force) == pytest.approx(valve(force))


def test_beyond_its_ends_the_speed_of_the_end_holds() -> None:
    curve = ForceSpeed(((100.0, 700.0), (600.0, 200.0)))
    assert curve.speed_at([-50.0, 0.0, 100.0, 350.0, 600.0, 650.0]).tolist() == [
        700.0, 700.0, 700.0, 450.0, 200.0, 200.0,
    ]  # fmt: skip


@given(
    st.lists(st.floats(0.0, 1000.0), min_size=2, max_size=6, unique=True),
    st.lists(st.floats(0.0, 900.0), min_size=6, max_size=6),
)
def test_what_rises_and_falls_is_a_curve_and_it_never_rises(forces: list[float], speeds: list[float]) -> None:
    falling = sorted(speeds, reverse=True)
    points = tuple(zip(sorted(forces), falling, strict=False))
    assert (curve_problem(points) == "") == (falling[0] > 0.0)
    if falling[0] > 0.0:
        at = ForceSpeed(points).speed_at([0.0, 200.0, 400.0, 600.0, 1200.0])
        assert all(after <= before for before, after in pairwise(at))


def test_what_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="the forces must rise"):
        ForceSpeed(((0.0, 800.0), (0.0, 500.0)))
