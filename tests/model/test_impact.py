"""Two wagons that meet: momentum and energy, a closed form, and what the buffers of category A do."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bufferstand.model.curves import Curves
from bufferstand.model.spring import HeatBalance, SpringModel, TemperatureLaw
from bufferstand.model.train.impact import impact_to, predict_impact
from tests.model.recipes import category_a, category_a_with_frequency


def straight(loading=(0.0, 5.0), unloading=(0.0, 5.0)):
    """A spring of two straight lines that does not warm up; equal lines lose nothing."""
    curves = Curves.straight(100.0, loading, unloading, 500.0)
    return SpringModel("straight", curves, TemperatureLaw(), HeatBalance(1e9))


@pytest.mark.parametrize("mass_t", [20.0, 80.0])
def test_a_straight_spring_has_a_closed_form(mass_t):
    """(M / 2) (v / 2)² / 2 = k x² / 2: nothing is lost, and the stroke follows."""
    done = predict_impact(straight(), mass_t, 1.0, 20.0)
    x_mm = (0.5 * mass_t * 0.5**2 / 5.0) ** 0.5 * 1e3 / 1e3**0.5
    assert done.stroke_mm == pytest.approx(x_mm, rel=1e-3)
    assert done.stored_energy_J == pytest.approx(0.5 * 0.5 * mass_t * 1e3 * 0.5**2, rel=1e-3)
    assert abs(done.damping) < 2e-3


def test_two_straight_lines_lose_what_lies_between_them():
    """Loading along 5, unloading along 2 kN/mm: 60 % less the short transition."""
    done = predict_impact(straight(unloading=(0.0, 2.0)), 60.0, 1.0, 20.0)
    assert done.damping == pytest.approx(0.6, abs=0.01)


def test_the_speed_for_a_stroke_is_found():
    model = replace(category_a(), heat=HeatBalance(1e9))
    done = impact_to(model, 60.0, 70.0, 20.0)
    assert done.stroke_mm == pytest.approx(70.0, abs=0.05)
    assert predict_impact(model, 60.0, 1.05 * done.speed_m_per_s, 20.0).stroke_mm > 70.5
    with pytest.raises(ValueError, match="no impact"):
        impact_to(model, 1.0, 104.0, 20.0)
    with pytest.raises(ValueError, match="above 0"):
        predict_impact(model, 60.0, 0.0, 20.0)


def test_the_buffer_with_frequency_effect_is_of_category_a():
    """Table 1 of the paper and § 1: 30 kJ, of which 60 % are absorbed, at no more than 12 km/h."""
    done = impact_to(category_a_with_frequency(), 80.0, 104.9, 20.0)
    assert done.stored_energy_J > 30_000.0
    assert done.damping > 0.60
    assert done.speed_m_per_s < 12.0 / 3.6


def test_the_recorded_buffer_is_not():
    """Known and stated: the stand-in whose runs are recorded stores 26 kJ and absorbs 49 %."""
    done = impact_to(category_a(), 80.0, 104.9, 20.0)
    assert done.stored_energy_J == pytest.approx(26_200.0, rel=0.01)
    assert done.damping == pytest.approx(0.487, abs=0.005)
