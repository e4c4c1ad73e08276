"""The paper's formulas as they stand: where they agree with the exact step, and by how much they do not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.model.curves import Curves
from bufferstand.model.paper import simulate_paper, slope
from bufferstand.model.simulation import simulate
from bufferstand.model.spring import HeatBalance, TemperatureLaw
from tests.model import step_errors
from tests.model.cases import parallel_curves, path, reference_curves, spring

# Step [mm] -> (largest force error [kN], error of the loop area), 0-80-0 mm after a first loop.
STEP_ERRORS = {
    0.05: (0.46, 0.0012),
    0.2: (1.8, 0.005),
    1.0: (9.8, 0.024),
    2.0: (22.0, 0.048),
    8.0: (188.0, 0.2),
}


def euler_and_exact(step_mm):
    model = spring(reference_curves())
    stroke = path(0.0, 80.0, 0.0, 80.0, 0.0, step_mm=step_mm)
    time = np.arange(len(stroke)) * 0.1
    euler = simulate_paper(model, time, stroke, temperature_C=25.0, isothermal=True).force_kN
    exact = simulate(model, time, stroke, temperature_C=25.0, isothermal=True).force_kN
    exact[stroke == 0.0] = euler[stroke == 0.0]  # contact lost: the paper has no such state
    return stroke, euler, exact


@pytest.mark.parametrize("step_mm", STEP_ERRORS)
def test_the_error_of_eulers_step_is_the_documented_one(step_mm):
    """I3, and the table of docs/model.md."""
    stroke, euler, exact = euler_and_exact(step_mm)
    error_kN, area_error = STEP_ERRORS[step_mm]
    cycle = slice(len(stroke) // 2, None)
    assert np.abs(euler - exact)[cycle].max() == pytest.approx(error_kN, rel=0.15)
    fine, _, truth = euler_and_exact(0.01)
    area = np.trapezoid(truth[len(fine) // 2 :], fine[len(fine) // 2 :])
    # Both are summed over the same samples, so that the method's own error is left.
    reached = np.trapezoid(euler[cycle], stroke[cycle]) - np.trapezoid(exact[cycle], stroke[cycle])
    assert abs(reached) / area == pytest.approx(area_error, rel=0.25)


def test_the_exact_step_has_no_such_error():
    truth = spring(reference_curves())
    coarse = np.array([0.0, 80.0, 0.0, 80.0, 64.0, 80.0, 48.0, 0.0])
    fine = path(*coarse, step_mm=0.01)
    at = np.cumsum([0, *(round(abs(d) / 0.01) for d in np.diff(coarse))])
    one = simulate(truth, np.arange(len(coarse)), coarse, temperature_C=25.0, isothermal=True).force_kN
    many = simulate(truth, np.arange(len(fine)), fine, temperature_C=25.0, isothermal=True).force_kN
    np.testing.assert_allclose(one, many[at], atol=1e-9)


def test_eulers_step_diverges_where_the_exact_one_does_not():
    stroke, euler, exact = euler_and_exact(16.0)
    assert np.abs(euler).max() > 2.0 * exact.max()
    assert np.all(exact[stroke > 0.0] > 0.0)
    assert len(stroke) == 21


def test_straight_parallel_curves_are_equation_3():
    model = spring(parallel_curves())
    stroke = path(0.0, 60.0, 20.0, step_mm=0.001)
    time = np.arange(len(stroke)) * 0.001
    paper = simulate_paper(model, time, stroke, temperature_C=25.0, isothermal=True)
    ours = simulate(model, time, stroke, temperature_C=25.0, isothermal=True)
    np.testing.assert_allclose(paper.force_kN[1:], ours.force_kN[1:], atol=0.005)


def test_slopes_on_the_curves_and_between():
    """Eq. (4): on its own curve the force follows it, on the other one it starts with k_t."""
    assert slope(100.0, 50.0, 100.0, 9.0, 3.0, 2.0, loading=True) == 3.0
    assert slope(50.0, 50.0, 100.0, 9.0, 3.0, 2.0, loading=True) == 9.0
    assert slope(50.0, 50.0, 100.0, 9.0, 3.0, 2.0, loading=False) == 2.0
    assert slope(100.0, 50.0, 100.0, 9.0, 3.0, 2.0, loading=False) == 9.0
    assert slope(75.0, 50.0, 100.0, 9.0, 3.0, 2.0, loading=False) == 5.5


def test_at_one_temperature_both_readings_of_k_t_agree():
    """With k_t scaled like the curves, eq. (4) at 55 °C is the band position kept: dF/dx of s(x) F(p, x)."""
    law = TemperatureLaw(sensitivity_per_K=0.01, depth_mm=1e-3)
    model = spring(reference_curves(), temperature=law)
    stroke = path(5.0, 70.0, 40.0, 55.0, step_mm=0.002)
    time = np.arange(len(stroke)) * 0.001
    paper = simulate_paper(model, time, stroke, temperature_C=55.0, isothermal=True)
    ours = simulate(model, time, stroke, temperature_C=55.0, isothermal=True)
    np.testing.assert_allclose(paper.force_kN, ours.force_kN, atol=0.05)


def test_warming_at_hold_throws_the_papers_force_out_of_the_band():
    """F as state: 144 kN over a band of 53 … 98 kN at 60 °C, so that (8) goes below 0; ours stays inside."""
    law = TemperatureLaw(sensitivity_per_K=0.01, depth_mm=20.0)
    model = spring(reference_curves(), temperature=law, heat=HeatBalance(2000.0, 2000.0))
    stroke = np.concatenate([path(0.1, 50.0, step_mm=0.02), np.full(2000, 50.0), [49.99]])
    time = np.concatenate([np.arange(len(stroke) - 2001) * 1e-7, np.arange(1, 2002) * 0.01])
    paper = simulate_paper(model, time, stroke, temperature_C=25.0, ambient_C=60.0)
    ours = simulate(model, time, stroke, temperature_C=25.0, ambient_C=60.0)
    s = 1.0 - 0.35 * (1.0 - np.exp(-2.5))
    at = np.array([50.0])
    high, low = s * float(model.curves.loading(at)[0]), s * float(model.curves.unloading(at)[0])
    assert (low, high) == pytest.approx((53.0, 98.0), abs=1.5)
    assert (paper.force_kN[-2] - low) / (high - low) == pytest.approx(2.03, abs=0.03)
    assert paper.absorbed_J[-1] < paper.absorbed_J[-2]
    assert (ours.force_kN[-2] - low) / (high - low) == pytest.approx(1.0, abs=0.01)
    assert ours.heat_J[-1] >= ours.heat_J[-2]


def test_where_the_formulas_are_0_by_0_they_say_so():
    with pytest.raises(ZeroDivisionError):
        slope(10.0, 10.0, 10.0, 9.0, 3.0, 2.0, loading=True)
    insulated = spring(reference_curves(), heat=HeatBalance(2000.0, 0.0))
    with pytest.raises(ZeroDivisionError):
        simulate_paper(insulated, [0.0, 1.0], [1.0, 2.0], temperature_C=25.0)


def test_the_papers_heat_balance_is_ours_for_the_same_power():
    """Eqs. (7)-(9) on a spring that loads on F_l, so that (8) is nearly the area."""
    model = spring(reference_curves(), heat=HeatBalance(2000.0, 10.0, rule="paper"))
    stroke = path(0.001, 80.0, 0.001, 80.0, 0.001, step_mm=0.02)
    time = np.arange(len(stroke)) * 0.005
    paper = simulate_paper(model, time, stroke, temperature_C=25.0)
    ours = simulate(model, time, stroke, temperature_C=25.0)
    assert paper.temperature_C[-1] == pytest.approx(ours.temperature_C[-1], abs=0.02)
    assert paper.absorbed_J[-1] == pytest.approx(ours.heat_J[-1], rel=5e-3)


def test_strokes_beyond_the_tables_are_refused():
    model = spring(Curves((0.0, 50.0), (10.0, 200.0), (5.0, 100.0), transition_length_mm=5.0))
    with pytest.raises(ValueError, match="0 … 50 mm"):
        simulate_paper(model, [0.0, 1.0], [0.0, 51.0], temperature_C=25.0)


def test_the_page_has_the_tables_that_are_measured():
    """Must show 2: figures within 5 % of the page's (3 % of the loss in an impact), words to the letter."""
    page = (Path(__file__).parents[2] / "docs" / "model.md").read_text(encoding="utf-8")
    for table in "\n".join(step_errors.lines()).split("\n\n"):
        head = "\n".join(table.splitlines()[:2])
        assert head in page
        shown = page.split(head)[1].split("\n\n")[0].strip().splitlines()
        for new, old in zip(table.splitlines()[2:], shown, strict=True):
            for a, b in zip(new.split(), old.split(), strict=True):
                if a.replace(".", "").isdigit():
                    assert float(a) == pytest.approx(float(b), rel=0.05), new
                else:
                    assert a == b


def test_an_impact_in_coarse_steps_loses_what_it_loses_in_fine_ones():
    """10 t at 1.9 m/s: the explicit step invents half a point of loss at 1 ms and three at 5 ms."""
    truth = step_errors.impact_loss(1e-5, exact=True)
    assert step_errors.impact_loss(1e-5, exact=False) == pytest.approx(truth, abs=2e-4)
    assert step_errors.impact_loss(1e-3, exact=True) == pytest.approx(truth, abs=6e-4)
    assert step_errors.impact_loss(1e-3, exact=False) - truth == pytest.approx(0.005, abs=0.001)
    assert step_errors.impact_loss(5e-3, exact=False) - truth == pytest.approx(0.029, abs=0.005)
