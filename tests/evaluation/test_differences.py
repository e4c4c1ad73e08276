from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.evaluation.across_runs.differences import UncertainValue, difference, equivalences
from bufferstand.evaluation.facts.shared_errors import ErrorSource, SharedContributions

number = st.floats(-1e6, 1e6, allow_nan=False)
positive = st.floats(1e-3, 1e3)


@given(number, positive, number, positive)
def test_a_difference_is_antisymmetric_and_its_uncertainty_is_that_of_independent_errors(
    a: float, Ua: float, b: float, Ub: float
) -> None:
    one, two = (
        difference(UncertainValue(a, Ua), UncertainValue(b, Ub)),
        difference(UncertainValue(b, Ub), UncertainValue(a, Ua)),
    )
    assert one.value == -two.value
    assert one.expanded_uncertainty == two.expanded_uncertainty
    assert one.expanded_uncertainty == pytest.approx(math.hypot(Ua, Ub))
    assert one.beyond == (abs(a - b) > math.hypot(Ua, Ub)) or abs(a - b) == pytest.approx(math.hypot(Ua, Ub))


def test_without_an_uncertainty_nothing_is_said_of_a_difference() -> None:
    for pair in (
        (UncertainValue(1.0), UncertainValue(2.0, 0.1)),
        (UncertainValue(1.0, 0.1), UncertainValue(2.0)),
    ):
        apart = difference(*pair)
        assert (apart.expanded_uncertainty, apart.normalised, apart.beyond) == (None, None, None)
    assert difference(UncertainValue(1.0, 0.1), UncertainValue(0.0, 0.1)).relative is None


def test_degrees_of_equivalence_are_those_of_a_simulation() -> None:
    U = [1.0, 2.0, 0.5, 1.5]
    mean, found = equivalences(
        [UncertainValue(v, u) for v, u in zip((10.0, 11.0, 9.0, 12.0), U, strict=True)]
    )
    assert mean == pytest.approx(10.5)
    assert sum(one.deviation for one in found) == pytest.approx(0.0, abs=1e-12)
    draws = np.random.default_rng(1).normal(0.0, np.array(U) / 2.0, (200_000, 4))
    spread = 2.0 * np.std(draws - draws.mean(axis=1, keepdims=True), axis=0)
    for one, expected in zip(found, spread, strict=True):
        assert one.expanded_uncertainty == pytest.approx(expected, rel=0.01)
    with pytest.raises(ValueError, match="two values"):
        equivalences([UncertainValue(1.0, 0.1)])


SCALE = ErrorSource("force scale", "cell", "rectangular")


def test_what_both_share_cancels_as_far_as_it_acts_alike() -> None:
    """0.4 of 0.5 is the same cell's scale: what is left is 0.3 of each, and the scale of the difference."""
    one, two = (
        UncertainValue(100.0, 1.0, SharedContributions({SCALE: 0.4}, 0.4)),
        UncertainValue(110.0, 1.0, SharedContributions({SCALE: 0.44}, 0.44)),
    )
    assert difference(two, one).expanded_uncertainty == pytest.approx(
        2.0 * math.sqrt(0.3**2 + (0.25 - 0.44**2) + 0.04**2)
    )
    other = UncertainValue(
        110.0,
        1.0,
        SharedContributions({ErrorSource("force scale", "another cell", "rectangular"): 0.44}, 0.44),
    )
    assert difference(other, one).expanded_uncertainty == pytest.approx(math.sqrt(2.0))
    mean, found = equivalences(
        [UncertainValue(v, 1.0, SharedContributions({SCALE: 0.5}, 0.5)) for v in (1.0, 2.0, 4.0)]
    )
    assert mean == pytest.approx(7.0 / 3.0)
    assert [one.expanded_uncertainty for one in found] == pytest.approx([0.0] * 3, abs=1e-7)


def test_of_one_rectangular_error_the_half_width_is_less_than_twice_its_u() -> None:
    apart = difference(
        UncertainValue(2.0, 1.0, SharedContributions({SCALE: 0.5}, 0.5)), UncertainValue(1.0, 0.0)
    )
    assert apart.expanded_uncertainty == pytest.approx(1.0)
    assert apart.half_width_95 == pytest.approx(0.5 * 0.95 * math.sqrt(3.0), rel=1e-3)
