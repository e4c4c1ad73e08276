"""What the model must keep, by the names of docs/model.md: I1 to I10 and I14, with the whole model at work.

Each is tested closer by where it comes from, too (``I<n>`` in the docstrings of this folder).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from bufferstand.foundation.errors import BadInput
from bufferstand.model.curves import Curves
from bufferstand.model.energy import stored_energy
from bufferstand.model.paper import simulate_paper
from bufferstand.model.simulation import band_history, simulate
from bufferstand.model.spring import HeatBalance, TemperatureLaw, ViscousBranch
from bufferstand.model.stepper import SpringStepper
from tests.model.cases import path, spring, turning_points, valid_curves
from tests.model.recipes import category_a, draw_hook
from tests.model.step_errors import step_error
from tests.model.test_spectrum import FITS

LAW = TemperatureLaw(sensitivity_per_K=0.01, depth_mm=15.0, loss_sensitivity_per_K=0.002)
SPECTRUM = ViscousBranch(0.05, 5.0, 0.04)


@pytest.mark.slow
@given(st.data())
@settings(max_examples=40)
def test_i01_force_stays_between_the_curves_while_the_spring_warms_up(data):
    model = spring(data.draw(valid_curves()), temperature=LAW, heat=HeatBalance(200.0))
    stepper, tables = SpringStepper(model, 25.0, 25.0), model.tables
    for stroke in data.draw(turning_points(model.curves.end_mm)):
        force = stepper.step(stroke, 0.5)
        assert 0.0 <= stepper.band <= 1.0
        if 0.0 < stroke <= model.curves.end_mm:
            cells = tables.cells_of(np.array([stroke]))
            s = (
                1.0
                - float(model.temperature.softening(stepper.temperature_C))
                * tables.at(tables.depth, cells)[0]
            )
            high = tables.at(tables.loading, cells)[0]
            low = high - float(model.width_scale(stepper.temperature_C)) * tables.at(tables.width, cells)[0]
            slack = 1e-9 * (1.0 + high)
            assert s * low - slack <= force <= s * high + slack


@pytest.mark.parametrize("make", [category_a, draw_hook])
def test_i02_one_step_is_many_steps(make):
    """Force, to 1e-12 of its range, at one temperature; the viscous branches need strokes linear in time."""
    model = replace(make(), heat=HeatBalance(1e15), viscous=SPECTRUM)
    end = 0.9 * model.curves.end_mm
    coarse, fine = SpringStepper(model, 40.0, 40.0), SpringStepper(model, 40.0, 40.0)
    at = 0.0
    for stroke in (end, 0.2 * end, 0.7 * end, 0.65 * end):
        one = coarse.step(stroke, 0.8)
        for k in range(1, 801):
            many = fine.step(at + (stroke - at) * k / 800, 0.001)
        assert many == pytest.approx(one, abs=1e-12 * 1000.0 * len(model.tables.A) ** 0.5)
        at = stroke


def test_i03_the_explicit_step_converges_to_the_exact_one():
    """First order: half the step, half the error."""
    errors = [step_error(step_mm).force_kN for step_mm in (0.4, 0.2, 0.1, 0.05)]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, rtol=0.1)


@pytest.mark.parametrize(
    ("mean", "amplitude"),
    [(20.0, 0.5), (20.0, 19.0), (50.0, 0.5), (50.0, 10.0), (50.0, 30.0), (80.0, 2.0), (80.0, 19.0)],
)
def test_i04_heat_of_a_settled_loop_is_its_area(mean, amplitude):
    """Within 2 % (here 0.2 %), shipped buffer, viscous branches on; no step gives heat back."""
    model = replace(category_a(), viscous=SPECTRUM)
    points, frequency = 200, 80.0 / (2.0 * np.pi * amplitude)
    cycles = max(40, int(30.0 * frequency))  # six of the slowest relaxation times
    angle = np.arange(cycles * points + 1) * (2.0 * np.pi / points)
    time, stroke = angle / (2.0 * np.pi * frequency), mean - amplitude * np.cos(angle)
    result = simulate(model, time, stroke, temperature_C=25.0, isothermal=True, initial_band=0.5)
    assert np.all(np.diff(result.heat_J) >= 0.0)
    heat, area = (values[-1] - values[-1 - points] for values in (result.heat_J, result.work_J))
    assert heat == pytest.approx(area, rel=2e-3)


@pytest.mark.parametrize("make", [category_a, draw_hook])
@pytest.mark.parametrize("fast_s", [1e-4, 1e-2])
def test_i05_a_saw_tooth_takes_energy(make, fast_s):
    """Slow up, fast down and the reverse, +-0.5 mm: where a band scaled by the speed creates 4 J a cycle."""
    model = replace(make(), viscous=SPECTRUM)
    for durations in ((2.0, fast_s), (fast_s, 2.0)):
        middle = 0.5 * model.curves.end_mm
        ways = [np.linspace(-0.5, 0.5, 41)[1:], np.linspace(0.5, -0.5, 41)[1:]]
        stroke = middle + np.concatenate([[-0.5], *(ways * 40)])
        steps = np.tile(np.repeat(durations, 40) / 40.0, 40)
        time = np.concatenate([[0.0], np.cumsum(steps)])
        result = simulate(model, time, stroke, temperature_C=25.0, isothermal=True, initial_band=0.5)
        assert np.all(np.diff(result.work_J[::80])[20:] > 0.0)


@pytest.mark.parametrize("loss_W_per_K", [0.0, 10.0, 1e5])
@pytest.mark.parametrize("steps", [[0.0], [1e-6] * 50, [0.7] * 9, [0.0, 3.0, 1e5]])
def test_i06_the_step_solves_the_heat_balance(loss_W_per_K, steps):
    """A spring at rest against an ODE solver: lambda = 0, no time, long after C / lambda."""
    heat = HeatBalance(2000.0, loss_W_per_K, sensor_lag_s=4.0, sensor_gain=0.8)
    stepper = SpringStepper(spring(heat=heat), 80.0, 20.0)
    for dt in steps:
        stepper.step(0.0, dt)
    whole = sum(steps)
    if whole * loss_W_per_K / 2000.0 > 50.0:
        assert stepper.temperature_C == pytest.approx(20.0, abs=1e-6)
        return
    rate = lambda _, T: -loss_W_per_K * (T - 20.0) / 2000.0  # noqa: E731 - one law, used once
    solved = solve_ivp(rate, (0.0, whole), [80.0], rtol=1e-10, atol=1e-9)
    assert stepper.temperature_C == pytest.approx(float(solved.y[0, -1]), rel=1e-7)


@pytest.mark.parametrize(
    "strokes", [(60.0,), (60.0, 57.0), (60.0, 20.0)], ids=["on F_l", "between", "on F_u"]
)
def test_i07_a_jump_of_temperature_at_hold_keeps_p(strokes):
    """F = s F(T_ref), where the paper's F as state would leave the band (test_paper.py)."""
    model = spring(temperature=TemperatureLaw(sensitivity_per_K=0.01, depth_mm=20.0))
    stepper = SpringStepper(model, 25.0, 25.0)
    for stroke in strokes:
        stepper.step(stroke, 1.0)
    force, band = stepper.force_kN, stepper.band
    assert stepper.step(strokes[-1], 0.0) == pytest.approx(force, rel=2e-5)
    stepper.temperature_C = -15.0
    s = 1.0 + 0.4 * (1.0 - np.exp(-strokes[-1] / 20.0))
    assert stepper.step(strokes[-1], 0.0) == pytest.approx(s * force, rel=2e-5)
    assert stepper.band == band


def meeting(preload_kN):
    """A spring whose curves meet at both ends and in the middle."""
    curves = Curves(
        stroke_mm=(0.0, 20.0, 40.0, 60.0, 80.0),
        loading_kN=tuple(preload_kN + f for f in (0.0, 60.0, 80.0, 80.0, 120.0)),
        unloading_kN=tuple(preload_kN + f for f in (0.0, 30.0, 80.0, 80.0, 120.0)),
        transition_stiffness_kN_per_mm=(40.0,) * 5,
    )
    return spring(curves, temperature=LAW, viscous=SPECTRUM, heat=HeatBalance(50.0, 0.0))


MEETING = {preload_kN: meeting(preload_kN) for preload_kN in (0.0, 20.0)}


@pytest.mark.slow
@pytest.mark.parametrize("preload_kN", MEETING)
@given(data=st.data())
@settings(max_examples=15)
def test_i08_edges_are_finite_and_never_pull(preload_kN, data):
    """No preload, curves that meet, strokes below 0 and beyond the end, no time, deep cold and great heat."""
    start_C = data.draw(st.sampled_from([-60.0, 25.0, 300.0]))
    model = MEETING[preload_kN]
    stepper, heat = SpringStepper(model, start_C, start_C), 0.0
    moves = data.draw(
        st.lists(st.tuples(st.floats(-5.0, 85.0), st.sampled_from([0.0, 1e-9, 0.1, 1e4])), max_size=12)
    )
    for stroke, dt in moves:
        force = stepper.step(stroke, dt)
        stored = stored_energy(model, stroke, stepper.band, stepper.lags_mm, stepper.temperature_C)
        assert np.isfinite([force, stepper.temperature_C, stepper.work_J, *stored]).all()
        assert force >= 0.0
        assert force == 0.0 or stroke > 0.0
        assert stepper.heat_J >= heat
        heat = stepper.heat_J


@pytest.mark.slow
def test_i09_a_transition_below_a_curve_is_refused_with_its_place():
    Curves.straight(50.0, (10.0, 3.0), (5.0, 2.0), 3.0)
    with pytest.raises(BadInput, match=r"below the stiffness of the loading curve at .* mm") as refusal:
        Curves.straight(50.0, (10.0, 3.0), (5.0, 2.0), 2.99)
    assert refusal.value.place == "transition_stiffness_kN_per_mm"


@pytest.mark.slow
@pytest.mark.parametrize("b", FITS)
@pytest.mark.parametrize("depth_mm", [5.0, 20.0, 40.0])
@pytest.mark.parametrize("rule", ["loop-exact", "paper"])
def test_i10_60_degrees_within_14_to_26_s(b, depth_mm, rule):
    """Fig. 11's loops with the paper's C and lambda, by curve sets that show the published dampings."""
    loss, (beta, tau_s) = FITS[b]
    model = replace(
        category_a(loss),
        temperature=TemperatureLaw(sensitivity_per_K=0.01, depth_mm=depth_mm),
        heat=HeatBalance(2000.0, 10.0, rule),
        viscous=ViscousBranch(beta, tau_s, b),
    )
    angle = np.arange(30 * 500 + 1) * (2.0 * np.pi / 500)
    time, stroke = angle / (2.0 * np.pi * 0.849), 78.0 - 15.0 * np.cos(angle)
    result = simulate(model, time, stroke, temperature_C=28.5, ambient_C=25.0)  # after the slow stroke
    assert 14.0 < time[np.argmax(result.temperature_C >= 60.0)] < 26.0


@pytest.mark.slow
def test_i14_forth_and_back_through_the_tables():
    """A stroke undone by the inverse of its own step, and the integrals of the curves turned by 180°."""
    here = Curves.straight(80.0, (50.0, 4.0), (20.0, 2.0), 9.0)
    there = Curves.straight(80.0, (370.0 - 180.0, 2.0), (0.0, 4.0), 9.0)  # x -> 80 - x, F -> 370 - F
    one, other = spring(here).tables, spring(there).tables
    np.testing.assert_allclose(other.A, (one.B[-1] - one.B)[::-1], atol=1e-9)
    np.testing.assert_allclose(other.B, (one.A[-1] - one.A)[::-1], atol=1e-9)
    gone = band_history(one, np.array([10.0, 60.0]), 0.3)[1]
    back = band_history(one, np.array([60.0, 10.0]), 0.3)[1]
    mirrored = band_history(other, np.array([20.0, 70.0]), 1.0 - 0.3)[1]  # the same stroke seen from there
    assert mirrored == pytest.approx(1.0 - back, abs=1e-12)
    A = np.interp([10.0, 60.0], np.linspace(0.0, 80.0, len(one.A)), one.A)
    assert 1.0 - (1.0 - gone) * np.exp(A[1] - A[0]) == pytest.approx(0.3, abs=1e-12)


# --- eq. (3) ---


@pytest.mark.slow
@pytest.mark.parametrize(
    ("loading", "unloading", "k_t"),
    [((20.0, 5.5), (6.5, 1.8), 30.0), ((15.0, 1.2), (10.0, 0.9), 4.0)],
    ids=["ring spring", "leaf spring"],
)
def test_equation_3_has_a_closed_form(loading, unloading, k_t):
    """Straight curves: 1 - p falls as a power of the width, (h0 / h1)^((k_t - k_u) / (k_l - k_u))."""
    curves = Curves.straight(60.0, loading, unloading, k_t)
    (F_l, k_l), (F_u, k_u) = loading, unloading

    def width(x):
        return F_l - F_u + (k_l - k_u) * x

    band = band_history(spring(curves).tables, np.array([5.0, 40.0, 38.0]), 0.0)
    up = 1.0 - (width(5.0) / width(40.0)) ** ((k_t - k_u) / (k_l - k_u))
    down = up * (width(38.0) / width(40.0)) ** ((k_t - k_l) / (k_l - k_u))
    assert band.tolist() == pytest.approx([0.0, up, down], rel=1e-9)
    stroke = path(5.0, 40.0, 38.0, step_mm=0.0005)
    literal = simulate_paper(
        spring(curves), np.arange(len(stroke)), stroke, temperature_C=25.0, isothermal=True
    )
    assert literal.force_kN[-1] == pytest.approx(F_u + k_u * 38.0 + down * width(38.0), abs=0.02)
