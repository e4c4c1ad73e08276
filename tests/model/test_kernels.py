"""Compiled kernel, plain kernel and stepper give the same bits."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.model import kernels
from bufferstand.model.compiled import factors_of, law_of, rest_of, simulate_compiled
from bufferstand.model.isothermal import isothermal_force
from bufferstand.model.kernels import READ, STATE_SIZE, drive
from bufferstand.model.simulation import band_history, simulate
from bufferstand.model.spring import HeatBalance, SpringModel, TemperatureLaw, ViscousBranch
from bufferstand.model.stepper import SpringStepper
from tests.model.cases import path, spring, turning_points, valid_curves
from tests.model.recipes import category_a, draw_hook

LAW = TemperatureLaw(sensitivity_per_K=0.01, depth_mm=15.0, loss_sensitivity_per_K=0.002)
HEAT = HeatBalance(2000.0, 10.0, sensor_lag_s=3.0, sensor_gain=0.9)
FIGURES = ("stroke_mm", "force_kN", "band", "temperature_C", "sensor_temperature_C", "work_J", "heat_J")
needs_numba = pytest.mark.skipif(not kernels.available(), reason="the extra fast is not installed")


def whole(**parts: object) -> SpringModel:
    return spring(**({"temperature": LAW, "heat": HEAT, "viscous": ViscousBranch(0.08, 0.7, 0.03)} | parts))


MODELS = {
    "whole": whole(),
    "paper": whole(heat=replace(HEAT, rule="paper")),
    "one branch": whole(viscous=ViscousBranch(0.08, 0.7)),
    "bare": spring(),
    "buffer": category_a(),
    "draw hook": draw_hook(),
}
STROKES = [
    path(0.0, 44.0, 20.0, 21.0, 20.0, 43.0, -5.0, 3.0, 130.0, 90.0, 0.0, step_mm=0.37),
    np.random.default_rng(4).uniform(-5.0, 115.0, 400),
]


def rows(model: SpringModel, strokes, dt_s: float, *, compiled: bool = False):
    """Figures after each step by the kernel, shape (n, READ)."""
    flat = model.tables.rows().ravel().tolist()
    state = rest_of(model)
    state[kernels.TEMPERATURE] = state[kernels.SENSOR] = 31.0
    state[kernels.AMBIENT] = 12.0
    law, factors, places = law_of(model), factors_of(model, dt_s), [0] * 4 * len(strokes)
    if not compiled:
        outputs = [0.0] * READ * len(strokes)
        drive(flat, law, factors, state, places, strokes.tolist(), outputs)
        return np.array(outputs).reshape(-1, READ)
    made = np.zeros(READ * len(strokes))
    arrays = [np.array(values) for values in (flat, law, factors, state)]
    kernels.compiled()(*arrays, np.array(places, dtype=np.intp), np.ascontiguousarray(strokes), made)
    return made.reshape(-1, READ)


def by_stepper(model: SpringModel, strokes, dt_s: float):
    stepper, found = SpringStepper(model, 31.0, 12.0), []
    for stroke in strokes.tolist():
        stepper.step(stroke, dt_s)
        found.append([getattr(stepper, name) for name in FIGURES])
    return np.array(found)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("strokes", STROKES, ids=["smooth", "wild"])
def test_the_kernel_is_the_stepper_to_the_last_bit(name, strokes):
    np.testing.assert_array_equal(rows(MODELS[name], strokes, 0.01), by_stepper(MODELS[name], strokes, 0.01))


@needs_numba
@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("strokes", STROKES, ids=["smooth", "wild"])
def test_compiled_and_plain_give_the_same_bits(name, strokes):
    plain = rows(MODELS[name], strokes, 0.004)
    np.testing.assert_array_equal(rows(MODELS[name], strokes, 0.004, compiled=True), plain)


@given(st.data())
@settings(max_examples=15)
def test_on_any_curves_the_kernel_is_the_stepper(data):
    model = whole(curves=data.draw(valid_curves()))
    strokes = np.array(data.draw(turning_points(model.curves.end_mm)))
    np.testing.assert_array_equal(rows(model, strokes, 0.3), by_stepper(model, strokes, 0.3))


def test_nothing_imports_numba_unasked():
    """It takes half a second and 190 MB: only who asks for the compiled kernel pays."""
    code = "import sys, bufferstand.model.compiled; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0


@given(st.data())
@settings(max_examples=40)
def test_the_isothermal_history_is_the_simulation(data):
    model = spring(data.draw(valid_curves()), temperature=LAW)
    strokes = np.array(data.draw(turning_points(model.curves.end_mm, most=30)))
    begin = data.draw(st.floats(0.0, 1.0))
    temperature_C = data.draw(st.sampled_from([-20.0, 25.0, 70.0]))
    expected = simulate(
        model,
        np.arange(len(strokes)),
        strokes,
        temperature_C=temperature_C,
        isothermal=True,
        initial_band=begin,
    )
    force = isothermal_force(model, strokes, temperature_C, begin)
    np.testing.assert_allclose(force, expected.force_kN, atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 16383, 16384, 16385, 50_001])
def test_blocks_join(count):
    """Across the edges of blocks, with holds, turns and a long stroke over three blocks."""
    model = category_a()
    angle = np.linspace(0.0, 3.0 if count < 20_000 else 40.0, count)
    strokes = np.round(50.0 - 55.0 * np.cos(angle), 2)
    p, expected, x = 0.3, [0.3], np.clip(strokes, 0.0, model.tables.end_mm)
    tables = model.tables
    A, B = (tables.at(table, tables.cells_of(x)) for table in (tables.A, tables.B))
    for k in range(1, count):
        p = 1.0 - (1.0 - p) * np.exp(A[k - 1] - A[k]) if x[k] >= x[k - 1] else p * np.exp(B[k] - B[k - 1])
        expected.append(float(p))
    np.testing.assert_allclose(band_history(tables, strokes, 0.3), expected, atol=1e-11)


def test_the_state_is_as_long_as_it_says():
    assert all(len(rest_of(model)) == STATE_SIZE for model in MODELS.values())


@needs_numba
@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("begin_mm", [0.0, 30.0])
def test_a_compiled_history_is_the_simulation(name, begin_mm):
    """From any first stroke, with steps of several durations; warnings and all."""
    model = MODELS[name]
    stroke = path(begin_mm, 44.0, 20.0, 21.0, 43.0, -2.0, 30.0, step_mm=0.2)
    time = np.cumsum(np.resize([0.001, 0.01, 0.0, 0.3], len(stroke)))
    given = {"temperature_C": 31.0, "ambient_C": 12.0, "initial_band": 0.4}
    fast, slow = simulate_compiled(model, time, stroke, **given), simulate(model, time, stroke, **given)
    for field in ("force_kN", "temperature_C", "sensor_temperature_C", "heat_J", "work_J", "band"):
        expected = getattr(slow, field)
        np.testing.assert_allclose(getattr(fast, field), expected, atol=1e-9 * (1.0 + np.abs(expected).max()))
    assert fast.warnings == slow.warnings
    with pytest.raises(ValueError, match="must not fall"):
        simulate_compiled(model, time[::-1], stroke, temperature_C=20.0)
    with pytest.raises(ValueError, match="one length"):
        simulate_compiled(model, time[1:], stroke, temperature_C=20.0)
