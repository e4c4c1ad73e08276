"""The viscous branch: exact in time, passive, gone at rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.model.curves import Curves
from bufferstand.model.simulation import lag_history, simulate
from bufferstand.model.spring import TemperatureLaw, ViscousBranch
from bufferstand.model.stepper import SpringStepper
from tests.model.cases import path, spring, turning_points, valid_curves


def elastic_curves(k: float = 4.0) -> Curves:
    """A straight spring without hysteresis: what is lost, the branch loses."""
    return Curves((0.0, 100.0), (0.0, 100.0 * k), (0.0, 100.0 * k), transition_length_mm=5.0)


def test_a_ramp_and_hold_relaxes_in_closed_form():
    """x - xi = v tau (1 - exp(-t / tau)) on the ramp, and decays with tau at hold."""
    branch = ViscousBranch(0.1, 3.0)
    stepper = SpringStepper(spring(elastic_curves(), viscous=branch), 25.0, 25.0)
    for k in range(1, 201):
        stepper.step(0.25 * k, 0.025)  # 10 mm/s for 5 s
    lag = 30.0 * (1.0 - np.exp(-5.0 / 3.0))
    assert stepper.force_kN == pytest.approx(200.0 + 0.4 * lag, rel=1e-10)
    for _ in range(60):
        stepper.step(50.0, 0.1)
    assert stepper.force_kN == pytest.approx(200.0 + 0.4 * lag * np.exp(-2.0), rel=1e-10)


@given(st.lists(st.tuples(st.floats(0.0, 100.0), st.floats(0.0, 50.0)), min_size=1, max_size=12))
def test_blocks_and_single_steps_give_the_same_lag(moves):
    """The summed form in blocks equals the recurrence, for steps from nothing to many time constants."""
    branch = ViscousBranch(0.1, 2.0)
    strokes, time, lag, expected = [0.0], [0.0], 0.0, [0.0]
    for stroke, duration in moves:
        kept, added = branch.response(duration)
        lag = kept * lag + added * (stroke - strokes[-1])
        expected.append(lag)
        strokes.append(stroke)
        time.append(time[-1] + duration)
    got = lag_history(np.array(time), np.array(strokes), 2.0)
    np.testing.assert_allclose(got, expected, atol=1e-9)


def test_a_linear_stroke_is_one_step_or_many():
    """I2 for the branch: exact for a stroke that is linear in time."""
    one = lag_history(np.array([0.0, 7.0]), np.array([10.0, 60.0]), 2.5)[-1]
    time = np.linspace(0.0, 7.0, 1234)
    many = lag_history(time, 10.0 + 50.0 * time / 7.0, 2.5)[-1]
    assert many == pytest.approx(one, rel=1e-12)


def test_slow_strokes_feel_nothing_and_fast_ones_all_of_it():
    model = spring(elastic_curves(), viscous=ViscousBranch(0.1, 1.0))
    stroke = path(0.0, 50.0, step_mm=0.5)
    slow = simulate(model, np.arange(len(stroke)) * 1e4, stroke, temperature_C=25.0).force_kN[-1]
    fast = simulate(model, np.arange(len(stroke)) * 1e-6, stroke, temperature_C=25.0).force_kN[-1]
    assert slow == pytest.approx(200.0, rel=1e-4)
    assert fast == pytest.approx(220.0, rel=1e-3)


def test_its_loss_is_its_loop():
    """For a straight curve the branch is a Maxwell element: W = pi k beta A^2 w tau / (1 + (w tau)^2)."""
    model = spring(elastic_curves(k=4.0), viscous=ViscousBranch(0.1, 0.5))
    omega = 3.0
    time = np.arange(0, 20 * 4000 + 1) * (2.0 * np.pi / omega / 4000)
    stroke = 50.0 - 20.0 * np.cos(omega * time)
    result = simulate(model, time, stroke, temperature_C=25.0, isothermal=True)
    expected = np.pi * 0.4 * 20.0**2 * (omega * 0.5) / (1.0 + (omega * 0.5) ** 2)
    assert np.diff(result.work_J[[-4001, -1]])[0] == pytest.approx(expected, rel=1e-5)
    assert np.diff(result.heat_J[[-4001, -1]])[0] == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
@given(st.data())
def test_it_is_passive_on_any_curves(data):
    """Work of the branch alone = heat + what it still stores >= 0, at every instant."""
    curves = data.draw(valid_curves())
    tau = data.draw(st.sampled_from([0.01, 0.5, 20.0]))
    inner = data.draw(turning_points(curves.end_mm, most=6))
    stroke = np.clip(path(1.0, *inner, step_mm=0.05), 0.01, curves.end_mm)
    time = np.arange(len(stroke)) * 0.01
    with_branch, without = (
        simulate(spring(curves, viscous=ViscousBranch(beta, tau)), time, stroke, temperature_C=25.0,
                 isothermal=True)
        for beta in (0.2, 0.0)
    )  # fmt: skip
    if np.any(with_branch.force_kN <= 0.0):
        return  # contact lost: the plate left the spring, whose own work is no longer F dx
    work = with_branch.work_J - without.work_J
    heat = with_branch.heat_J - without.heat_J
    scale = 1e-3 * (1.0 + np.abs(np.diff(with_branch.work_J)).sum())
    assert np.all(np.diff(heat) >= -1e-9 * scale)
    assert np.all(work >= heat - scale)
    assert np.all(work >= -scale)


def test_the_branch_softens_with_the_spring():
    law = TemperatureLaw(sensitivity_per_K=0.01, depth_mm=1e-3)
    model = spring(elastic_curves(), temperature=law, viscous=ViscousBranch(0.1, 1e6))
    cold = SpringStepper(model, 25.0, 25.0).step(50.0, 1.0)
    warm = SpringStepper(model, 55.0, 55.0).step(50.0, 1.0)
    assert warm / cold == pytest.approx(0.7, rel=1e-6)
