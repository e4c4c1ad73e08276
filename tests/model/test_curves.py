"""Curves: what they are between their points, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from bufferstand.foundation.errors import BadInput
from bufferstand.model.curves import Curves
from tests.model.cases import parallel_curves, reference_curves, valid_curves


def test_tables_are_met_and_straight_curves_stay_straight():
    curves = parallel_curves(width_kN=40.0, k=3.0, k_t=11.0)
    x = np.linspace(0.0, 100.0, 333)
    np.testing.assert_allclose(curves.loading(x), 60.0 + 3.0 * x, rtol=1e-13)
    np.testing.assert_allclose(curves.unloading(x), 20.0 + 3.0 * x, rtol=1e-13)
    np.testing.assert_allclose(curves.loading_stiffness(x), 3.0, rtol=1e-12)
    np.testing.assert_allclose(curves.unloading_stiffness(x), 3.0, rtol=1e-12)
    np.testing.assert_allclose(curves.transition_stiffness(x), 11.0, rtol=1e-12)


def test_stiffness_is_the_slope_of_the_force():
    curves = reference_curves()
    x, d = np.linspace(0.1, 104.9, 777), 1e-5
    for force, stiffness in (
        (curves.loading, curves.loading_stiffness),
        (curves.unloading, curves.unloading_stiffness),
    ):
        np.testing.assert_allclose((force(x + d) - force(x - d)) / (2.0 * d), stiffness(x), atol=1e-4)


def test_the_length_rule_lies_above_both_curves_by_the_width_over_the_length():
    curves = reference_curves(transition_length_mm=6.0)
    x = np.linspace(0.0, 105.0, 400)
    width = curves.loading(x) - curves.unloading(x)
    steeper = np.maximum(curves.loading_stiffness(x), curves.unloading_stiffness(x))
    np.testing.assert_allclose(curves.transition_stiffness(x) - steeper, width / 6.0, rtol=1e-12)


@given(valid_curves())
def test_between_the_points_nothing_falls_and_nothing_crosses(curves):
    x = np.linspace(0.0, curves.end_mm, 2000)
    slack = 1e-9 * curves.loading_kN[-1]
    assert np.all(np.diff(curves.loading(x)) >= -slack)
    assert np.all(np.diff(curves.unloading(x)) >= -slack)
    assert np.all(curves.loading(x) - curves.unloading(x) >= -slack)
    k_t = curves.transition_stiffness(x)
    assert np.all(k_t >= np.maximum(curves.loading_stiffness(x), curves.unloading_stiffness(x)) - 1e-6)


GOOD = {
    "stroke_mm": (0.0, 10.0, 20.0, 30.0),
    "loading_kN": (10.0, 30.0, 60.0, 120.0),
    "unloading_kN": (5.0, 15.0, 30.0, 50.0),
    "transition_length_mm": 5.0,
}


@pytest.mark.parametrize(
    ("change", "place", "says"),
    [
        (
            {"unloading_kN": (5.0, 15.0, 30.0, 125.0)},
            "unloading_kN",
            "5 kN above the loading curve at 30.00 mm",
        ),
        ({"loading_kN": (10.0, 30.0, 25.0, 120.0)}, "loading_kN", "falls (or is below 0) at 20 mm: 25 kN"),
        ({"unloading_kN": (-1.0, 15.0, 30.0, 50.0)}, "unloading_kN", "falls (or is below 0) at 0 mm: -1 kN"),
        ({"loading_kN": (0.0,) * 4, "unloading_kN": (0.0,) * 4}, "loading_kN", "carries no force"),
        ({"stroke_mm": (0.0, 10.0, 10.0, 30.0)}, "stroke_mm", "10 mm does not"),
        ({"stroke_mm": (1.0, 10.0, 20.0, 30.0)}, "stroke_mm", "begin with 0"),
        ({"loading_kN": (10.0, 30.0)}, "loading_kN", "2 values for 4 strokes"),
        ({"transition_length_mm": None}, "transition", "either its length or its stiffness"),
        ({"transition_stiffness_kN_per_mm": (9.0,) * 4}, "transition", "either its length or its stiffness"),
        ({"transition_length_mm": 0.0}, "transition_length_mm", "above 0"),
        ({"stop_stiffness_kN_per_mm": -5.0}, "stop_stiffness_kN_per_mm", "above 0"),
        ({"contact_ramp_mm": 30.0}, "contact_ramp_mm", "0 … 30 mm"),
    ],
)
def test_contradictions_are_refused_with_their_place(change, place, says):
    Curves(**GOOD)
    with pytest.raises(BadInput) as refusal:
        Curves(**(GOOD | change))
    assert refusal.value.place == place
    assert says in refusal.value.problem


@pytest.mark.parametrize("curve", ["loading", "unloading"])
def test_a_transition_softer_than_a_curve_is_refused_at_its_stroke(curve):
    """I9: between the points, too. The softest place is found, not the first sample below."""
    tables = GOOD | {"transition_length_mm": None}
    if curve == "unloading":
        tables |= {"loading_kN": (40.0, 50.0, 60.0, 70.0), "unloading_kN": (0.0, 10.0, 40.0, 50.0)}
    with pytest.raises(BadInput, match=f"below the stiffness of the {curve} curve at") as refusal:
        Curves(**tables, transition_stiffness_kN_per_mm=(2.5, 3.0, 2.5, 2.5))
    at_mm = float(refusal.value.problem.split(" at ")[1].split(" mm")[0])
    stiffness = Curves(**(tables | {"transition_length_mm": 5.0}))
    k = stiffness.loading_stiffness if curve == "loading" else stiffness.unloading_stiffness
    x = np.linspace(0.0, 30.0, 3001)
    k_t = np.interp(x, GOOD["stroke_mm"], (2.5, 3.0, 2.5, 2.5))
    assert at_mm == pytest.approx(x[np.argmax(k(x) - k_t)], abs=1.5)
    assert float(k(np.array([at_mm]))[0]) > 2.5


def test_a_transition_as_stiff_as_the_curve_is_the_limit_that_passes():
    straight = {"stroke_mm": (0.0, 50.0), "loading_kN": (10.0, 160.0), "unloading_kN": (5.0, 155.0)}
    Curves(**straight, transition_stiffness_kN_per_mm=(3.0, 3.0))
    with pytest.raises(BadInput, match="k_t is"):
        Curves(**straight, transition_stiffness_kN_per_mm=(3.0, 2.999))
