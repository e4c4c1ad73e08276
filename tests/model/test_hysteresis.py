"""The band position: bounds, exactness in stroke, agreement of the ways to compute it, edges."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from bufferstand.model.curves import Curves
from bufferstand.model.simulation import band_history, simulate
from bufferstand.model.spring import HeatBalance, TemperatureLaw, ViscousBranch
from bufferstand.model.stepper import SpringStepper
from tests.model.cases import parallel_curves, path, reference_curves, spring, turning_points, valid_curves


@given(st.data())
def test_the_force_never_leaves_the_band(data):
    """I1: for any valid table and any strokes, however far apart."""
    model = spring(data.draw(valid_curves()))
    strokes = np.array(data.draw(turning_points(model.curves.end_mm)))
    band = band_history(model.tables, strokes, data.draw(st.floats(0.0, 1.0)))
    assert np.all(band >= 0.0)
    assert np.all(band <= 1.0)


@given(st.data())
def test_a_stroke_is_one_step_or_many(data):
    """I2: sub-steps compose to the same band position, to rounding."""
    model = spring(data.draw(valid_curves()))
    strokes = np.array(data.draw(turning_points(model.curves.end_mm)))
    split = [strokes[:1]]
    for start, end in pairwise(strokes):
        inside = sorted(data.draw(st.lists(st.floats(0.0, 1.0), max_size=6)))
        split.append(np.array([*(start + (end - start) * s for s in inside), end]))
    coarse = band_history(model.tables, strokes, 0.4)[-1]
    fine = band_history(model.tables, np.concatenate(split), 0.4)[-1]
    # A and B may reach thousands where curves meet; their rounding is what is left.
    largest = max(1.0, model.tables.A[-1], model.tables.B[-1])
    assert fine == pytest.approx(coarse, abs=1e-12 * largest)


def test_the_shipped_kind_of_table_splits_to_a_billionth_of_a_newton():
    tables = spring().tables
    one = band_history(tables, np.array([3.0, 91.7, 12.3, 70.0]))[-1]
    many = band_history(tables, path(3.0, 91.7, 12.3, 70.0, step_mm=0.0137))[-1]
    assert many == pytest.approx(one, abs=1e-12)


def test_parallel_curves_have_a_closed_form():
    """Fancher's law: a = b = (k_t - k) / h = 0.2 / mm; p* = 1/2."""
    model = spring(parallel_curves(width_kN=40.0, k=3.0, k_t=11.0))
    band = band_history(model.tables, np.array([0.0, 10.0, 4.0]))
    assert band[1] == pytest.approx(1.0 - np.exp(-2.0), rel=1e-12)
    assert band[2] == pytest.approx((1.0 - np.exp(-2.0)) * np.exp(-1.2), rel=1e-12)
    np.testing.assert_allclose(model.tables.centre, 0.5, rtol=1e-12)
    force = simulate(model, np.arange(3.0), np.array([0.0, 10.0, 4.0]), temperature_C=25.0).force_kN
    assert force[2] == pytest.approx(20.0 + 12.0 + 40.0 * band[2], rel=1e-12)


def test_it_solves_equation_4():
    """I3: a Runge-Kutta solution of dF/dx agrees, on curves that are no straight lines."""
    curves = reference_curves()
    model = spring(curves)

    def slope(x, force, loading):
        at = np.array([min(max(x, 0.0), curves.end_mm)])
        low, high = float(curves.unloading(at)[0]), float(curves.loading(at)[0])
        k_l, k_u = float(curves.loading_stiffness(at)[0]), float(curves.unloading_stiffness(at)[0])
        k_t = float(curves.transition_stiffness(at)[0])
        if loading:
            return (high - force) / (high - low) * (k_t - k_l) + k_l
        return (force - low) / (high - low) * (k_t - k_u) + k_u

    force = float(curves.unloading(np.array([5.0]))[0])
    strokes = [5.0, 60.0, 41.0, 47.0, 20.0]
    ours = simulate(model, np.arange(5.0), np.array(strokes), temperature_C=25.0, isothermal=True).force_kN
    for k, (start, end) in enumerate(pairwise(strokes)):
        solved = solve_ivp(
            lambda x, f, up=end > start: [slope(x, f[0], up)], (start, end), [force], rtol=1e-9, atol=1e-9,
            max_step=0.5,
        )  # fmt: skip
        force = float(solved.y[0, -1])
        assert ours[k + 1] == pytest.approx(force, abs=2e-3)  # the tables' grid: 0.1 N, and what it does to p


def test_the_way_back_in_time_undoes_a_stroke():
    """I14: the step of loading is inverted by the same difference of A, that of unloading by B's."""
    tables = spring().tables
    band = band_history(tables, np.array([10.0, 33.0]), 0.25)[-1]
    gained = np.interp([10.0, 33.0], np.linspace(0.0, tables.end_mm, len(tables.A)), tables.A)
    assert 1.0 - (1.0 - band) * np.exp(gained[1] - gained[0]) == pytest.approx(0.25, abs=1e-12)
    band = band_history(tables, np.array([33.0, 10.0]), 0.25)[-1]
    lost = np.interp([10.0, 33.0], np.linspace(0.0, tables.end_mm, len(tables.B)), tables.B)
    assert band * np.exp(lost[1] - lost[0]) == pytest.approx(0.25, abs=1e-12)


def test_a_mirrored_spring_has_mirrored_integrals():
    """I14: curves turned by 180° (x -> -x, F -> -F) exchange loading and unloading, so A and B."""
    here = parallel_curves()
    x = np.array([0.0, 30.0, 70.0, 100.0])
    loading, unloading = np.array([50.0, 80.0, 160.0, 300.0]), np.array([20.0, 35.0, 70.0, 120.0])
    here = Curves(tuple(x), tuple(loading), tuple(unloading), transition_stiffness_kN_per_mm=(30.0,) * 4)
    there = Curves(
        tuple(100.0 - x[::-1]),
        tuple(320.0 - unloading[::-1]),
        tuple(320.0 - loading[::-1]),
        transition_stiffness_kN_per_mm=(30.0,) * 4,
    )
    one, other = spring(here).tables, spring(there).tables
    np.testing.assert_allclose(other.A, (one.B[-1] - one.B)[::-1], atol=1e-9)
    np.testing.assert_allclose(other.B, (one.A[-1] - one.A)[::-1], atol=1e-9)
    np.testing.assert_allclose(other.centre, 1.0 - one.centre[::-1], atol=1e-9)


WHOLE = {
    "temperature": TemperatureLaw(sensitivity_per_K=0.01, depth_mm=15.0, loss_sensitivity_per_K=0.002),
    "heat": HeatBalance(2000.0, 10.0, sensor_lag_s=3.0, sensor_gain=0.9),
    "viscous": ViscousBranch(0.08, 0.7),
}


@pytest.mark.parametrize("rule", ["loop-exact", "paper"])
@given(data=st.data())
def test_stepwise_and_at_once_give_the_same_figures(rule, data):
    model = spring(
        data.draw(valid_curves()),
        **(WHOLE | {"heat": HeatBalance(2000.0, 10.0, rule, sensor_lag_s=3.0, sensor_gain=0.9)}),
    )
    strokes = np.array([0.0, *data.draw(turning_points(model.curves.end_mm))])
    time = np.cumsum([0.0, *(data.draw(st.sampled_from([0.0, 0.001, 0.3, 20.0])) for _ in strokes[1:])])
    at_once = simulate(model, time, strokes, temperature_C=31.0, ambient_C=12.0)
    stepper = SpringStepper(model, 31.0, 12.0)
    for k in range(1, len(strokes)):
        force = stepper.step(float(strokes[k]), float(time[k] - time[k - 1]))
        scale = 1e-9 * (1.0 + abs(at_once.work_J[: k + 1]).max())
        assert force == stepper.force_kN == pytest.approx(at_once.force_kN[k], abs=1e-8)
        assert stepper.band == pytest.approx(at_once.band[k], abs=1e-12)
        assert stepper.temperature_C == pytest.approx(at_once.temperature_C[k], abs=1e-9)
        assert stepper.sensor_temperature_C == pytest.approx(at_once.sensor_temperature_C[k], abs=1e-9)
        assert stepper.heat_J == pytest.approx(at_once.heat_J[k], abs=scale)
        assert stepper.work_J == pytest.approx(at_once.work_J[k], abs=scale)


def test_two_histories_joined_are_one():
    """The stepper's state is all there is: a pause between two calls changes nothing."""
    strokes = path(0.0, 60.0, 30.0, 80.0, 1.0, step_mm=0.3)
    one, other = SpringStepper(spring(**WHOLE), 25.0, 25.0), SpringStepper(spring(**WHOLE), 25.0, 25.0)
    forces = [one.step(float(x), 0.01) for x in strokes[1:]]
    half = len(forces) // 2
    joined = [other.step(float(x), 0.01) for x in strokes[1 : half + 1]]
    other.step(float(strokes[half]), 0.0)  # no stroke, no time: nothing may happen
    joined += [other.step(float(x), 0.01) for x in strokes[half + 1 :]]
    assert joined == forces
    assert other.heat_J == one.heat_J


def test_a_hold_keeps_the_band_and_gives_no_heat():
    stepper = SpringStepper(spring(), 25.0, 25.0)
    stepper.step(50.0, 1.0)
    stepper.step(45.0, 1.0)
    band, heat, force = stepper.band, stepper.heat_J, stepper.force_kN
    for _ in range(10):
        assert stepper.step(45.0, 0.5) == force
    assert (stepper.band, stepper.heat_J) == (band, heat)


def test_contact_loss_keeps_the_band():
    model = spring(viscous=ViscousBranch(0.05, 2.0))
    stepper = SpringStepper(model, 25.0, 25.0)
    stepper.step(40.0, 1.0)
    stepper.step(0.0, 1.0)
    band = stepper.band
    assert stepper.force_kN == 0.0
    for stroke in (-5.0, -0.001, -30.0, 0.0):
        assert stepper.step(stroke, 0.1) == 0.0
        assert stepper.band == band
    assert stepper.step(1e-9, 0.1) > 0.0  # without a ramp the preload is there at once


def test_the_ramp_builds_up_the_preload():
    ramped = Curves(
        stroke_mm=(0.0, 50.0), loading_kN=(20.0, 120.0), unloading_kN=(20.0, 120.0),
        transition_length_mm=5.0, contact_ramp_mm=0.5,
    )  # fmt: skip
    stepper = SpringStepper(spring(ramped), 25.0, 25.0)
    assert stepper.step(0.25, 0.1) == pytest.approx(10.25, abs=0.02)
    assert stepper.step(0.5, 0.1) == pytest.approx(21.0, rel=1e-12)
    assert stepper.step(10.0, 0.1) == pytest.approx(40.0, rel=1e-12)


def test_beyond_the_tables_stands_a_stop():
    curves = parallel_curves()
    stepper = SpringStepper(spring(curves), 25.0, 25.0)
    at_end = stepper.step(100.0, 1.0)
    band, heat = stepper.band, stepper.heat_J
    assert stepper.step(101.5, 1.0) == pytest.approx(at_end + 1.5 * 500.0, rel=1e-12)
    assert stepper.step(100.0, 1.0) == pytest.approx(at_end, rel=1e-12)
    assert (stepper.band, stepper.heat_J) == (band, heat)


@pytest.mark.parametrize("preload_kN", [0.0, 20.0])
def test_curves_that_meet_stay_finite(preload_kN):
    """I8: h = 0 at both ends and in the middle; eq. (4) is 0/0 there."""
    curves = Curves(
        stroke_mm=(0.0, 20.0, 40.0, 60.0, 80.0),
        loading_kN=tuple(preload_kN + f for f in (0.0, 60.0, 80.0, 80.0, 120.0)),
        unloading_kN=tuple(preload_kN + f for f in (0.0, 30.0, 80.0, 80.0, 120.0)),
        transition_stiffness_kN_per_mm=(40.0,) * 5,
    )
    for viscous in (ViscousBranch(), ViscousBranch(0.05, 1.0)):
        model = spring(curves, viscous=viscous)
        strokes = path(0.0, 80.0, 50.0, 81.0, 0.0, 10.0, 0.0, -3.0, 25.0, step_mm=0.01)
        result = simulate(model, np.arange(len(strokes)) * 0.01, strokes, temperature_C=25.0)
        for values in (result.force_kN, result.heat_J, result.work_J, result.temperature_C):
            assert np.all(np.isfinite(values))
        assert np.all(result.force_kN >= 0.0)
        assert np.all(np.diff(result.heat_J) >= 0.0)


def test_a_spring_without_width_is_elastic():
    curve = (10.0, 40.0, 110.0)
    model = spring(Curves((0.0, 20.0, 40.0), curve, curve, transition_length_mm=4.0))
    strokes = path(0.0, 37.0, 11.0, 40.0, 0.0)
    result = simulate(model, np.arange(len(strokes)) * 0.1, strokes, temperature_C=25.0)
    np.testing.assert_allclose(result.force_kN[1:-1], model.curves.loading(strokes[1:-1]), atol=1e-3)
    assert result.heat_J[-1] == 0.0


def test_the_tangent_is_the_slope_of_the_next_step():
    model = spring(**WHOLE)
    for loading, move in ((True, 1e-6), (False, -1e-6)):
        stepper = SpringStepper(model, 40.0, 40.0)
        for stroke in (30.0, 55.013, 48.017):
            stepper.step(stroke, 0.2)
        force, tangent = stepper.force_kN, stepper.tangent_kN_per_mm(loading)
        assert (stepper.step(48.017 + move, 0.0) - force) / move == pytest.approx(tangent, rel=2e-4)


def test_the_tangent_at_the_edges():
    stepper = SpringStepper(spring(parallel_curves()), 25.0, 25.0)
    assert stepper.tangent_kN_per_mm(loading=False) == 0.0
    assert stepper.tangent_kN_per_mm(loading=True) == pytest.approx(11.0)  # on F_u: k_t
    stepper.step(100.0, 1.0)
    assert stepper.tangent_kN_per_mm(loading=True) == 500.0
    assert stepper.tangent_kN_per_mm(loading=False) == pytest.approx(11.0, rel=1e-6)  # on F_l: k_t
    stepper.step(-1.0, 1.0)
    assert stepper.tangent_kN_per_mm(loading=True) == 0.0


def test_time_that_runs_backwards_is_refused():
    with pytest.raises(ValueError, match="0 s or more"):
        SpringStepper(spring(), 25.0, 25.0).step(1.0, -0.1)
    with pytest.raises(ValueError, match="must not fall"):
        simulate(spring(), [0.0, 1.0, 0.5], [0.0, 1.0, 2.0], temperature_C=25.0)
    with pytest.raises(ValueError, match="one length"):
        simulate(spring(), [0.0, 1.0], [0.0, 1.0, 2.0], temperature_C=25.0)
