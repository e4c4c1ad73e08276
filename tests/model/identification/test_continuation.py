"""Curves beyond the runs: closed forms of springs whose whole curve is known, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.foundation import BadInput
from bufferstand.model.curves import Curves
from bufferstand.model.identification.continuation import continued

FULL_mm = 105.0
C = (600.0 - 15.0 - 192.0) / 96.0**4
SPRINGS = {
    "elastomer": lambda x: 15.0 + 2.0 * x + C * x**4,
    "cubic": lambda x: 10.0 + 3.0 * x + 4e-4 * x**3,
    "power": lambda x: 8e-4 * x**3 + 1e-9,
    "rings": lambda x: 60.0 + 4.0 * x,
    "exponential": lambda x: 20.0 * np.exp(0.034 * x),
}
SHARE = 0.4


def until(law, end_mm, knots=20, share=SHARE):
    """The curves of a law up to a stroke, as runs that end there give them."""
    x = np.linspace(0.0, end_mm, knots)
    loading = law(x)
    tables = (tuple(values.tolist()) for values in (x, loading, share * loading))
    return Curves(*tables, transition_length_mm=4.0)


@pytest.mark.parametrize("name", SPRINGS)
@pytest.mark.parametrize("end_mm", [80.0, 90.0, 98.4])
def test_the_true_force_at_full_stroke_lies_within_the_bounds(name, end_mm):
    """Tangent and exponential bound every convex curve with a concave logarithm."""
    law = SPRINGS[name]
    longer = continued(until(law, end_mm), np.full(20, 0.01), FULL_mm)
    low, high = longer.loading_at_end_kN
    assert low * (1.0 - 1e-6) <= law(FULL_mm) <= high * (1.0 + 1e-6)
    assert low <= longer.curves.loading_kN[-1] <= high
    assert longer.kind == "own-shape"


@pytest.mark.parametrize("name", ["elastomer", "cubic", "power", "rings"])
def test_the_curve_keeps_its_shape_from_98_mm_on(name):
    law, end = SPRINGS[name], 98.4
    curves = continued(until(law, end), np.full(20, 0.01), FULL_mm).curves
    x = np.linspace(end, FULL_mm, 50)
    assert curves.loading(x) == pytest.approx(law(x), rel=0.006)
    assert curves.unloading(x) == pytest.approx(SHARE * curves.loading(x), rel=1e-6)
    assert curves.end_mm == FULL_mm


def test_what_was_measured_stays_as_it_was():
    before = until(SPRINGS["elastomer"], 98.4)
    after = continued(before, np.full(20, 0.01), FULL_mm).curves
    x = np.linspace(0.0, 98.4, 1000)
    assert after.loading(x) == pytest.approx(before.loading(x), rel=2e-4)


def test_less_certain_knots_widen_the_bounds():
    curves = until(SPRINGS["elastomer"], 98.4)
    sure, unsure = (continued(curves, np.full(20, u), FULL_mm).loading_at_end_kN for u in (0.01, 5.0))
    assert unsure[0] < sure[0] < sure[1] < unsure[1]


def test_a_curve_that_misses_its_parabola_widens_the_bounds():
    noise = 0.01 * np.random.default_rng(22).uniform(-1.0, 1.0, 20)
    smooth = until(SPRINGS["elastomer"], 98.4)
    rough = until(lambda x: SPRINGS["elastomer"](x) * (1.0 + noise), 98.4)
    widths = [np.ptp(continued(c, np.full(20, 0.01), FULL_mm).loading_at_end_kN) for c in (smooth, rough)]
    assert widths[1] > 1.5 * widths[0]


def test_the_makers_points_are_taken_where_runs_have_none():
    curves = until(SPRINGS["elastomer"], 98.4)
    points = ((0.0, 12.0), (60.0, 300.0), (102.0, 720.0), (FULL_mm, 800.0), (120.0, 2000.0))
    longer = continued(curves, np.full(20, 0.01), FULL_mm, points, 1.1)
    assert longer.kind == "catalogue"
    assert longer.curves.stroke_mm[-2:] == (102.0, FULL_mm)
    assert longer.curves.loading_kN[-2:] == (720.0, 800.0)
    assert longer.loading_at_end_kN == pytest.approx((800.0 / 1.1, 880.0))


def test_points_that_end_before_the_full_stroke_are_continued_from_there():
    curves = until(SPRINGS["elastomer"], 90.0)
    known = float(SPRINGS["elastomer"](100.0))
    longer = continued(curves, np.full(20, 0.01), FULL_mm, ((100.0, known),), 1.05).curves
    assert longer.loading_kN[longer.stroke_mm.index(100.0)] == known
    assert longer.loading_kN[-1] == pytest.approx(SPRINGS["elastomer"](FULL_mm), rel=0.02)


def test_points_below_what_was_measured_are_refused():
    with pytest.raises(BadInput, match=r"600 kN at 105 mm lie below the 645\.6 kN measured at 98\.4 mm"):
        continued(until(SPRINGS["elastomer"], 98.4), np.full(20, 0.01), FULL_mm, ((105.0, 600.0),))


@pytest.mark.parametrize("end_mm", [104.95, 105.0, 105.4])
def test_runs_that_reach_the_full_stroke_need_none(end_mm):
    assert continued(until(SPRINGS["elastomer"], end_mm), np.full(20, 0.01), FULL_mm) is None


def test_three_knots_are_enough():
    longer = continued(until(SPRINGS["cubic"], 90.0, knots=3), np.full(3, 1.0), FULL_mm)
    low, high = longer.loading_at_end_kN
    assert low <= longer.curves.loading_kN[-1] <= high
