"""De-noised strokes, and the answer to them."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.model.identification.drive import find_turns, join, noise_of, reduce_run
from bufferstand.model.identification.response import BandStage, LagStage, answer, relax
from bufferstand.model.measured_curves import measured_curves
from bufferstand.model.simulation import simulate
from tests.model.recipes import category_a, draw_hook

RATE_Hz = 1000.0


def noisy_sine(seed=0, sigma=0.01):
    time = np.arange(0.0, 4.0, 1.0 / RATE_Hz)
    stroke = 30.0 - 15.0 * np.cos(2.0 * np.pi * time)
    return time, stroke, stroke + np.random.default_rng(seed).normal(0.0, sigma, time.size)


def test_noise_is_told_from_motion():
    _, clean, noisy = noisy_sine()
    assert noise_of(noisy) == pytest.approx(0.01, rel=0.1)
    assert noise_of(clean) < 1e-4


def test_noise_makes_no_turns():
    time, _, noisy = noisy_sine()
    turns = find_turns(noisy, 0.06)
    assert len(turns) == 9  # both ends and seven turns
    assert np.allclose(time[turns[1:-1]], np.arange(0.5, 4.0, 0.5), atol=0.02)
    assert find_turns(np.zeros(100), 0.06) == [0, 99]


def test_turns_are_fitted_better_than_their_samples():
    time, _, noisy = noisy_sine()
    drive = reduce_run(time, noisy, noisy, ambient_C=20.0)
    turns = np.flatnonzero(np.diff(drive.half)) + 1
    tops = drive.stroke_mm[turns[::2]]
    assert np.max(np.abs(tops - 45.0)) < 0.006
    assert np.all(np.diff(drive.time_s) > 0.0)


def test_corners_are_not_rounded():
    time = np.arange(0.0, 16.0, 0.001)
    stroke = 40.0 - np.abs(5.0 * (time - 8.0003))
    noisy = stroke + np.random.default_rng(1).normal(0.0, 0.01, time.size)
    drive = reduce_run(time, noisy, noisy, ambient_C=20.0)
    assert drive.stroke_mm.max() == pytest.approx(40.0, abs=0.006)


def test_each_half_stroke_is_monotone():
    time, _, noisy = noisy_sine(sigma=0.05)
    drive = reduce_run(time, noisy, noisy, ambient_C=20.0)
    for half in range(1, drive.half.max()):
        step = np.diff(drive.stroke_mm[drive.half == half])
        assert np.all(step >= 0.0) or np.all(step <= 0.0)


def test_runs_that_overlap_are_not_joined():
    time, _, noisy = noisy_sine()
    drive = reduce_run(time, noisy, noisy, ambient_C=20.0, name="a")
    with pytest.raises(BadInput, match="begins before its predecessor ends"):
        join([drive, drive])


def test_a_short_record_is_refused():
    with pytest.raises(BadInput, match="fewer than 16 samples"):
        reduce_run([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], ambient_C=20.0)


@pytest.mark.parametrize("make", [category_a, draw_hook])
def test_the_answer_is_that_of_the_simulation(make):
    model = make()
    end = 0.9 * model.tables.end_mm
    time = np.arange(0.0, 30.0, 0.001)
    stroke = np.where(time < 20.0, 0.5 * end * (1.0 - np.cos(2.0 * np.pi * 0.8 * time)), 0.0)
    whole = simulate(model, time, stroke, temperature_C=22.0, ambient_C=18.0)
    kept = np.unique(np.concatenate([np.arange(0, time.size, 12), np.arange(0, 20000, 625), [time.size - 1]]))
    t, x = time[kept], stroke[kept]
    band = BandStage.of(model.tables, x)
    given = answer(
        model, t, band, LagStage.of(band, t, model.viscous),
        start_C=22.0, sensor_start_C=22.0, ambient_C=18.0,
    )  # fmt: skip
    assert whole.temperature_C.max() > 26.0
    assert np.max(np.abs(given.temperature_C - whole.temperature_C[kept])) < 0.004
    assert np.max(np.abs(given.force_kN - whole.force_kN[kept])) < 2e-4 * whole.force_kN.max()
    assert np.max(np.abs(given.sensor_C - whole.sensor_temperature_C[kept])) < 0.004


def test_relaxation_is_exact_over_any_number_of_time_constants():
    time = np.array([0.0, 1.0, 500.0, 500.5, 9000.0])
    added = np.array([1.0, 2.0, 3.0, 0.0])
    level = 4.0
    for dt, more, got in zip(np.diff(time), added, relax(time, 5.0, 4.0, added)[1:], strict=True):
        level = level * np.exp(-dt / 5.0) + more
        assert got == pytest.approx(level, rel=1e-12, abs=1e-300)
    assert relax(time, np.inf, 4.0, added)[-1] == 10.0


def test_curves_of_a_measured_loop():
    model = draw_hook()  # without overstress, which would shift both branches
    stroke = np.concatenate([np.linspace(0.0, 42.0, 4000), np.linspace(42.0, 0.0, 4000)])
    force = simulate(model, np.arange(8000) * 4e-3, stroke, temperature_C=25.0, isothermal=True).force_kN
    noisy = force + np.random.default_rng(0).normal(0.0, 0.3, force.size)
    made = measured_curves(stroke, noisy, transition_length_mm=3.0, contact_ramp_mm=0.1)
    inside = np.linspace(3.0, 30.0, 12)
    assert np.allclose(made.curves.unloading(inside), model.curves.unloading(inside), rtol=0.02, atol=0.5)
    assert made.residual_kN < 0.5
    assert "isotonic" in made.smoothing
    with pytest.raises(BadInput, match="loading and an unloading branch"):
        measured_curves(stroke[:100], force[:100])
