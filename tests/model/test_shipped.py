"""The shipped models show the published figures, and are what their recipe says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from bufferstand.model.file import load_model
from bufferstand.model.prediction import predict_harmonic, predict_static
from bufferstand.model.simulation import simulate
from bufferstand.model.spring import HeatBalance
from tests.model.cases import sine
from tests.model.recipes import (
    CATEGORY_A_LOSS,
    CATEGORY_A_VISCOUS,
    DRAW_HOOK_FIT,
    FOLDER,
    SHIPPED,
    category_a,
    draw_hook,
)

# Prestress = amplitude [mm], frequency [Hz], damping (paper, § 3.2).
DAMPINGS = [(20.0, 0.08, 0.232), (20.0, 1.27, 0.225), (40.0, 0.04, 0.386), (40.0, 0.32, 0.373)]


@pytest.fixture(scope="module")
def buffer():
    return load_model(FOLDER / "category-a-elastomer.toml")


@pytest.fixture(scope="module")
def hook():
    return load_model(FOLDER / "draw-hook-elastomer.toml")


@pytest.mark.parametrize("name", SHIPPED)
def test_the_file_is_what_the_recipe_makes(name):
    assert load_model(FOLDER / name) == SHIPPED[name]()


@pytest.mark.parametrize(("amplitude", "frequency", "damping"), DAMPINGS)
def test_the_buffer_shows_the_published_damping(buffer, amplitude, frequency, damping):
    predicted = predict_harmonic(buffer, amplitude, amplitude, frequency, 25.0)
    assert predicted.damping == pytest.approx(damping, abs=2e-4)


@pytest.mark.parametrize("temperature_C", [20.0, 25.0])
def test_the_buffer_meets_the_force_windows(buffer, temperature_C):
    """EN 15551 by table 3 of the paper: 25, 60, 100 mm at 5 mm/s; preload as the extrapolated 2 … 10 mm."""
    for stroke, low, high in ((25.0, 30.0, 130.0), (60.0, 100.0, 400.0), (100.0, 350.0, 1000.0)):
        assert low < predict_static(buffer, 1e4, stroke, 5.0, temperature_C).peak_force_kN < high
    time = np.arange(0.0, 2.0, 1e-3)
    force = simulate(buffer, time, 5.0 * time, temperature_C=temperature_C).force_kN
    part = time > 0.4
    assert 10.0 < np.polyfit(5.0 * time[part], force[part], 1)[1] < 50.0


@pytest.mark.parametrize("temperature_C", [20.0, 25.0])
def test_the_buffer_stores_and_absorbs_enough(buffer, temperature_C):
    whole = predict_static(buffer, 1000.0, 105.0, 5.0, temperature_C)
    assert whole.end_stroke_mm == 105.0
    assert whole.peak_force_kN < 1000.0
    assert whole.stored_energy_J > 12_500.0
    to_600_kN = predict_static(buffer, 600.0, 105.0, 5.0, temperature_C)
    assert to_600_kN.stored_energy_J == pytest.approx(18_000.0, rel=0.02)
    assert to_600_kN.end_stroke_mm == pytest.approx(95.0, abs=1.5)


def test_three_static_cycles_keep_their_damping(buffer):
    """0.50 in the first and 0.42 in the next two, warming included; contact between them."""
    half = 21.0  # s, 105 mm at 5 mm/s
    time = np.arange(0.0, 3 * 60.0, 0.01)
    stroke = np.maximum(0.0, 105.0 - 5.0 * np.abs(time % 60.0 - half))
    result = simulate(buffer, time, stroke, temperature_C=20.0)
    dampings = []
    for cycle in range(3):
        work = result.work_J[6000 * cycle : 6000 * cycle + 4201]
        dampings.append((work[-1] - work[0]) / (work[2100] - work[0]))
    assert dampings[0] >= 0.50
    assert min(dampings) >= 0.42
    assert dampings == pytest.approx([0.513, 0.513, 0.513], abs=0.002)
    assert 2.0 < result.temperature_C[-1] - 20.0 < 3.0


def test_at_the_highest_permitted_speed_the_first_cycle_misses_its_damping(buffer):
    """Known and stated: at 50 mm/s the branch relaxes less, and 0.49 is below the 0.50 of cycle 1."""
    assert predict_static(buffer, 1000.0, 105.0, 50.0, 20.0).damping == pytest.approx(0.490, abs=0.002)


def test_the_draw_hook_shows_the_published_figures(hook):
    cold, warm = (predict_static(hook, 1e4, x, 5.0, T) for x, T in ((42.5, 25.0), (44.5, 75.0)))
    assert cold.peak_force_kN == pytest.approx(593.0, abs=0.5)
    assert warm.peak_force_kN == pytest.approx(374.0, abs=0.5)
    assert cold.damping == pytest.approx(0.39, abs=5e-4)
    assert warm.damping == pytest.approx(0.37, abs=5e-4)


@pytest.mark.parametrize("stroke", [42.5, 44.5])
def test_the_draw_hook_loses_45_percent_of_its_dissipation(hook, stroke):
    cold, warm = (predict_static(hook, 1e4, stroke, 5.0, T).absorbed_energy_J for T in (25.0, 75.0))
    assert 1.0 - warm / cold == pytest.approx(0.45, abs=0.012)


def test_equation_5_alone_cannot_lower_the_damping(hook):
    """What c_eta is for: without it the damping of the warm spring rises."""
    bare = replace(hook, temperature=replace(hook.temperature, loss_sensitivity_per_K=0.0))
    cold, warm = (predict_static(bare, 1e4, x, 5.0, T).damping for x, T in ((42.5, 25.0), (44.5, 75.0)))
    assert warm > cold - 0.001


@pytest.mark.parametrize(
    ("rule", "window_s"), [("loop-exact", (14.0, 26.0)), ("paper", (14.0, 26.0))], ids=["loop-exact", "paper"]
)
def test_the_buffer_heats_up_as_in_figure_11(buffer, rule, window_s):
    """I10: C = 2000 J/K, lambda = 10 W/K, 78 ± 15 mm at 0.849 Hz after one slow stroke: 60 °C in 14-26 s."""
    model = replace(buffer, heat=HeatBalance(2000.0, 10.0, rule))
    slow_s = np.linspace(0.0, 38.0, 3801)
    slow = 95.0 - 5.0 * np.abs(slow_s - 19.0)
    rise_s = 38.0 + np.linspace(0.01, 12.6, 1260)
    time, stroke = sine(78.0, 15.0, 0.849, 30, 1000)
    all_s = np.concatenate([slow_s, rise_s, rise_s[-1] + time[1:]])
    strokes = np.concatenate([slow, (rise_s - 38.0) * 5.0, stroke[1:]])
    result = simulate(model, all_s, strokes, temperature_C=25.0)
    begun = len(slow_s) + len(rise_s) - 1
    assert result.temperature_C[len(slow_s)] - 25.0 == pytest.approx(3.5, abs=1.0)
    reached_s = all_s[np.argmax(result.temperature_C > 60.0)] - all_s[begun]
    assert window_s[0] < reached_s < window_s[1]
    first = result.heat_J[begun + 1000] - result.heat_J[begun]
    assert 4000.0 < first < 5500.0
    assert result.force_kN[begun:].max() == pytest.approx(530.0, rel=0.05)


def test_the_sensor_lags_behind_the_mass(buffer):
    time, stroke = sine(78.0, 15.0, 0.849, 85, 200)
    result = simulate(buffer, time, stroke, temperature_C=21.0)
    slope = (result.temperature_C[-1] - result.temperature_C[-4001]) / (time[-1] - time[-4001])
    behind = result.temperature_C[-1] - result.sensor_temperature_C[-1]
    assert behind == pytest.approx(20.0 * slope, rel=0.05)


def test_the_buffers_numbers_are_the_fit_to_the_four_dampings():
    def misses(q):
        model = category_a((q[0], q[1]), (q[2], q[3]), digits=9)
        return [predict_harmonic(model, a, a, f, 25.0).damping - d for a, f, d in DAMPINGS]

    fit = least_squares(misses, [0.17, 0.5, 0.04, 9.0], x_scale=[0.1, 0.1, 0.01, 3.0])
    assert np.abs(fit.fun).max() < 1e-6
    assert fit.x == pytest.approx([*CATEGORY_A_LOSS, *CATEGORY_A_VISCOUS], rel=1e-3)


def test_the_draw_hooks_numbers_are_the_fit_to_figure_9():
    def misses(q):
        model = draw_hook((q[0], q[1], q[2], q[3]), digits=9)
        cold, warm = (predict_static(model, 1e4, x, 5.0, T) for x, T in ((42.5, 25.0), (44.5, 75.0)))
        return [
            cold.peak_force_kN / 593.0 - 1.0,
            warm.peak_force_kN / 374.0 - 1.0,
            cold.damping / 0.39 - 1.0,
            warm.damping / 0.37 - 1.0,
        ]

    bounds = ([0.0, 100.0, 0.0, 0.0], [8.0, 900.0, 0.5, 0.01])
    fit = least_squares(misses, [1.5, 500.0, 0.25, 0.0017], x_scale=[1.0, 100.0, 0.1, 0.001], bounds=bounds)
    assert np.abs(fit.fun).max() < 1e-6
    assert fit.x == pytest.approx(DRAW_HOOK_FIT, rel=3e-3)
