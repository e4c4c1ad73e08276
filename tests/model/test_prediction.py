"""Predictions for the planner against the simulation itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.model.prediction import heat_step, predict_harmonic, predict_static
from bufferstand.model.simulation import simulate
from bufferstand.model.spring import HeatBalance
from tests.model.cases import parallel_curves, path, sine, spring
from tests.model.recipes import category_a

LOOPS = [(20, 20, 0.08), (40, 40, 0.32), (50, 5, 2.55), (50, 1, 0.5), (78, 15, 0.849), (10, 15, 0.5)]


@pytest.mark.slow
@pytest.mark.parametrize("loop", LOOPS)
def test_the_settled_loop_is_the_one_that_the_simulation_settles_to(loop):
    model, points = category_a(), 2000
    cycles = max(60, int(60 * model.viscous.tau_s * loop[2] / 4))
    time, stroke = sine(*loop, cycles, points)
    result = simulate(model, time, stroke, temperature_C=30.0, isothermal=True)
    last = slice(-1 - points, None)
    work = 0.5 * (result.force_kN[last][1:] + result.force_kN[last][:-1]) * np.diff(stroke[last])
    predicted = predict_harmonic(model, *loop, 30.0)
    assert predicted.peak_force_kN == pytest.approx(result.force_kN[last].max(), rel=1e-5)
    assert predicted.stored_energy_J == pytest.approx(work[: points // 2].sum(), rel=1e-5)
    assert predicted.absorbed_energy_J == pytest.approx(work.sum(), rel=1e-4)
    assert predicted.damping == pytest.approx(work.sum() / work[: points // 2].sum(), rel=1e-4)
    assert predicted.absorbed_energy_J == pytest.approx(
        np.diff(result.heat_J[[-1 - points, -1]])[0], rel=2e-3
    )


def test_parallel_curves_give_the_closed_form():
    """Settled p0 = (1 - e) e / (1 - e²) with e = exp(-0.2 / mm · 20 mm); the area follows by integration."""
    model = spring(parallel_curves(width_kN=40.0, k=3.0, k_t=11.0))
    e = np.exp(-4.0)
    low = (1.0 - e) * e / (1.0 - e * e)
    y = np.linspace(0.0, 20.0, 20001)
    loading, unloading = 1.0 - (1.0 - low) * np.exp(-0.2 * y), (1.0 - low) * np.exp(-0.2 * (20.0 - y))
    area = 40.0 * np.trapezoid(loading - unloading, y)
    predicted = predict_harmonic(model, 50.0, 10.0, 1.0, 25.0)
    assert predicted.absorbed_energy_J == pytest.approx(area, rel=1e-5)
    stored = 20.0 * 20.0 + 3.0 * (60.0**2 - 40.0**2) / 2.0 + 40.0 * np.trapezoid(loading, y)
    assert predicted.stored_energy_J == pytest.approx(stored, rel=1e-5)
    assert predicted.peak_force_kN == pytest.approx(20.0 + 180.0 + 40.0 * (1.0 - low), rel=1e-9)


def test_a_spring_that_never_leaves_contact_is_needed_for_no_prediction():
    """Strokes below 0 are contact lost, not an error."""
    predicted = predict_harmonic(category_a(), 0.0, 10.0, 1.0, 25.0)
    assert 0.0 < predicted.damping < 1.0
    nothing = predict_harmonic(category_a(), -20.0, 10.0, 1.0, 25.0)
    assert (nothing.peak_force_kN, nothing.stored_energy_J, nothing.damping) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("force", "stroke", "by"), [(600.0, 105.0, "force"), (1e4, 60.0, "stroke")])
def test_a_static_stroke_turns_at_the_first_limit(force, stroke, by):
    model = category_a()
    predicted = predict_static(model, force, stroke, 5.0, 20.0)
    if by == "force":
        assert predicted.peak_force_kN == pytest.approx(600.0, abs=0.01)
        assert predicted.end_stroke_mm < 105.0
    else:
        assert predicted.end_stroke_mm == 60.0
    strokes = path(0.0, predicted.end_stroke_mm, 0.0, step_mm=0.02)
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(strokes)))]) / 5.0
    result = simulate(model, time, strokes, temperature_C=20.0, isothermal=True)
    assert predicted.absorbed_energy_J == pytest.approx(result.work_J[-1], rel=1e-4)
    assert predicted.stored_energy_J == pytest.approx(result.work_J.max(), rel=1e-4)


def test_a_force_limit_below_the_preload_turns_at_once():
    predicted = predict_static(category_a(), 5.0, 105.0, 5.0, 25.0)
    assert 0.0 < predicted.end_stroke_mm < 0.2
    assert predicted.peak_force_kN == pytest.approx(5.0, rel=0.1)


@given(st.floats(-20.0, 80.0), st.floats(0.0, 5000.0), st.floats(0.0, 5000.0), st.floats(0.0, 1.0))
def test_two_parts_of_a_step_heat_like_the_whole(start, power, duration, share):
    heat = HeatBalance(15000.0, 10.0)
    whole = heat_step(heat, start, 21.0, power, duration)
    first = heat_step(heat, start, 21.0, power, share * duration)
    assert heat_step(heat, first, 21.0, power, (1.0 - share) * duration) == pytest.approx(whole, abs=1e-9)


def test_the_predicted_heating_is_the_simulated_one():
    """78 ± 15 mm for 40 s: force and heat fall by a few percent meanwhile, so the planner steps anew."""
    model = category_a()
    time, stroke = sine(78.0, 15.0, 0.849, 34, 500)
    simulated = simulate(model, time, stroke, temperature_C=25.0).temperature_C[-1]
    predicted = 25.0
    for _ in range(34):
        power = predict_harmonic(model, 78.0, 15.0, 0.849, predicted).absorbed_energy_J * 0.849
        predicted = heat_step(model.heat, predicted, 25.0, power, 1.0 / 0.849)
    assert predicted == pytest.approx(simulated, abs=0.15)
    assert simulated > 31.0


@pytest.mark.parametrize("bad", [(50.0, 0.0, 1.0), (50.0, -5.0, 1.0), (50.0, 5.0, 0.0)])
def test_impossible_loops_are_refused(bad):
    with pytest.raises(ValueError, match="above 0"):
        predict_harmonic(category_a(), *bad, 25.0)


def test_impossible_strokes_are_refused():
    with pytest.raises(ValueError, match="above 0"):
        predict_static(category_a(), 600.0, 105.0, 0.0, 25.0)
