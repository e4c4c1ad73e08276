"""The flat spectrum: several branches of one form on fixed times, and all that must know of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.model.file import load_model, save_model
from bufferstand.model.prediction import predict_harmonic
from bufferstand.model.simulation import band_history, force_history, lag_histories, simulate
from bufferstand.model.spring import SPECTRUM_TAU_S, HeatBalance, TemperatureLaw, ViscousBranch
from bufferstand.model.stepper import SpringStepper
from tests.model.cases import path, sine, spring, turning_points, valid_curves
from tests.model.recipes import FOLDER, category_a
from tests.model.test_viscous import elastic_curves

# Fits to the four published dampings with b = 0, 0.04, 0.08 per decade: eta's two numbers, beta, tau.
FITS = {
    0.0: ((0.16538, 0.50954), (0.04477, 9.645)),
    0.04: ((0.13706, 0.50638), (0.06693, 4.703)),
    0.08: ((0.10747, 0.50449), (0.10189, 4.243)),
}


def test_the_grid_covers_three_decades_evenly():
    assert SPECTRUM_TAU_S[0] * SPECTRUM_TAU_S[-1] == pytest.approx(1.6e-3 * 1.6)
    np.testing.assert_allclose(np.diff(np.log10(SPECTRUM_TAU_S)), 0.5)
    branches = ViscousBranch(0.1, 9.0, 0.04).branches
    assert branches[0] == (0.1, 9.0)
    assert sum(beta for beta, _ in branches[1:]) == pytest.approx(3.0 * 0.04)
    assert ViscousBranch(0.0, 9.0, 0.04).branches == branches[1:]
    assert ViscousBranch(0.1, 9.0).branches == branches[:1]
    assert ViscousBranch().branches == ()


@pytest.mark.parametrize("frequency_Hz", [0.3, 2.0, 10.0])
def test_its_stiffness_and_loss_have_a_closed_form(frequency_Hz):
    """Straight curve: Maxwell elements in parallel, whose loss is nearly flat: pi b / (2 ln 10)."""
    b, k, amplitude = 0.05, 4.0, 20.0
    model = spring(elastic_curves(k), viscous=ViscousBranch(0.0, 1.0, b))
    omega = 2.0 * np.pi * frequency_Hz
    time, stroke = sine(50.0, amplitude, frequency_Hz, int(12 * frequency_Hz) + 3)
    result = simulate(model, time, stroke, temperature_C=25.0, isothermal=True)
    wt = omega * np.array(SPECTRUM_TAU_S)
    loss_modulus = k * 0.5 * b * np.sum(wt / (1.0 + wt**2))
    area, heat = (np.diff(v[[-2001, -1]])[0] for v in (result.work_J, result.heat_J))
    assert area == pytest.approx(np.pi * loss_modulus * amplitude**2, rel=2e-4)
    assert heat == pytest.approx(area, rel=2e-4)
    assert loss_modulus == pytest.approx(k * b * np.pi / 2.0 / np.log(10.0), rel=0.2)


def test_stiffness_rises_evenly_with_the_logarithm_of_the_frequency():
    """b per decade, from 0.3 to 30 Hz, within a fifth of it in every third of a decade."""
    model = spring(elastic_curves(1.0), viscous=ViscousBranch(0.0, 1.0, 0.05))
    tops = [
        predict_harmonic(model, 50.0, 10.0, 0.3 * 10.0 ** (n / 3.0), 25.0).peak_force_kN for n in range(7)
    ]
    # Peak force of a small overstress is that of its part in phase: 50 + 10 (1 + b log10 f + ...).
    np.testing.assert_allclose(np.diff(tops), 10.0 * 0.05 / 3.0, rtol=0.2)


@pytest.mark.parametrize("rule", ["loop-exact", "paper"])
@given(data=st.data())
@settings(max_examples=25)
def test_stepwise_and_at_once_give_the_same_figures(rule, data):
    model = spring(
        data.draw(valid_curves()),
        temperature=TemperatureLaw(sensitivity_per_K=0.01, depth_mm=15.0, loss_sensitivity_per_K=0.002),
        heat=HeatBalance(2000.0, 10.0, rule, sensor_lag_s=3.0),
        viscous=ViscousBranch(data.draw(st.sampled_from([0.0, 0.08])), 0.7, 0.05),
    )
    strokes = np.array([0.0, *data.draw(turning_points(model.curves.end_mm))])
    time = np.cumsum([0.0, *(data.draw(st.sampled_from([0.0, 0.001, 0.3, 20.0])) for _ in strokes[1:])])
    at_once = simulate(model, time, strokes, temperature_C=31.0, ambient_C=12.0)
    stepper = SpringStepper(model, 31.0, 12.0)
    for k in range(1, len(strokes)):
        stepper.step(float(strokes[k]), float(time[k] - time[k - 1]))
        scale = 1e-9 * (1.0 + abs(at_once.work_J[: k + 1]).max())
        assert stepper.force_kN == pytest.approx(at_once.force_kN[k], abs=1e-8)
        assert stepper.temperature_C == pytest.approx(at_once.temperature_C[k], abs=1e-9)
        assert stepper.heat_J == pytest.approx(at_once.heat_J[k], abs=scale)


@given(st.data())
@settings(max_examples=30)
def test_it_is_passive_on_any_curves(data):
    """I5: a closed path takes energy, at slow and fast strokes, and heat never falls."""
    curves = data.draw(valid_curves())
    inner = data.draw(turning_points(curves.end_mm, most=6))
    stroke = np.clip(path(1.0, *inner, 1.0, step_mm=0.05), 0.01, curves.end_mm)
    time = np.arange(len(stroke)) * data.draw(st.sampled_from([1e-4, 1e-2, 1.0]))
    both = (ViscousBranch(0.0, 1.0, 0.1), ViscousBranch())
    results = [
        simulate(spring(curves, viscous=v), time, stroke, temperature_C=25.0, isothermal=True) for v in both
    ]
    if np.any(results[0].force_kN <= 0.0):
        return  # contact lost: the plate left the spring, whose own work is no longer F dx
    work, heat = (getattr(results[0], name) - getattr(results[1], name) for name in ("work_J", "heat_J"))
    scale = 1e-3 * (1.0 + np.abs(np.diff(results[0].work_J)).sum())
    assert np.all(np.diff(heat) >= -1e-9 * scale)
    assert np.all(work >= heat - scale)


def test_the_settled_loop_is_the_one_that_the_simulation_settles_to():
    model = replace(category_a(), viscous=ViscousBranch(0.05, 5.0, 0.04))
    time, stroke = sine(50.0, 15.0, 0.849, 80)
    result = simulate(model, time, stroke, temperature_C=30.0, isothermal=True)
    predicted = predict_harmonic(model, 50.0, 15.0, 0.849, 30.0)
    assert predicted.peak_force_kN == pytest.approx(result.force_kN[-2001:].max(), rel=1e-5)
    assert predicted.absorbed_energy_J == pytest.approx(np.diff(result.work_J[[-2001, -1]])[0], rel=1e-4)


@pytest.mark.parametrize("b", FITS)
def test_the_spectrum_stiffens_without_touching_the_dampings(b):
    """docs/facts/spring-model.md: the published dampings, +4 % (+8 %) of stiffness, +1.9 % of top force."""
    loss, (beta, tau_s) = FITS[b]
    model = replace(category_a(loss, digits=9), viscous=ViscousBranch(beta, tau_s, b))
    for amplitude, frequency, damping in (
        (20, 0.08, 0.232),
        (20, 1.27, 0.225),
        (40, 0.04, 0.386),
        (40, 0.32, 0.373),
    ):
        assert predict_harmonic(model, amplitude, amplitude, frequency, 25.0).damping == pytest.approx(
            damping, abs=2e-4
        )
    slow, fast = (predict_harmonic(model, 20.0, 20.0, f, 25.0).peak_force_kN for f in (0.08, 1.27))
    assert fast / slow - 1.0 == pytest.approx(0.46 * b, abs=0.002)
    stiffness = []
    for f in (0.08, 1.27):
        time, stroke = sine(20.0, 20.0, f, 1 + int(40 * f), 1000)
        lags = lag_histories(model.viscous, time, stroke)
        force = force_history(model, stroke, band_history(model.tables, stroke), lags, 25.0)[-1001:-500]
        stiffness.append(np.interp(20.0, stroke[-1001:-500], np.gradient(force, stroke[-1001:-500])))
    assert stiffness[1] / stiffness[0] - 1.0 == pytest.approx(0.98 * b, abs=0.004)


def test_the_file_keeps_it_and_older_files_have_none(tmp_path):
    old = FOLDER / "category-a-elastomer.toml"
    assert "spectrum" not in old.read_text(encoding="utf-8")
    assert load_model(old).viscous.spectrum_per_decade == 0.0
    model = replace(category_a(), viscous=ViscousBranch(0.05, 5.0, 0.04))
    save_model(model, tmp_path / "model.toml")
    assert load_model(tmp_path / "model.toml") == model
    save_model(category_a(), tmp_path / "plain.toml")
    assert "spectrum" not in (tmp_path / "plain.toml").read_text(encoding="utf-8")


def test_lags_that_are_not_the_branches_are_refused():
    model = replace(category_a(), viscous=ViscousBranch(0.05, 5.0, 0.04))
    x = np.array([1.0, 2.0])
    with pytest.raises(ValueError, match="1 lags for 7 viscous branches"):
        force_history(model, x, x, x, 25.0)
