"""The energy ledger of springs and of the example of two trains."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bufferstand.model.energy import stored_energy
from bufferstand.model.simulation import band_history, lag_histories, simulate
from bufferstand.model.spring import HeatBalance, TemperatureLaw, ViscousBranch
from examples.train_impact import Scene, facts, main, run_impact
from tests.model.cases import path, spring
from tests.model.recipes import category_a, draw_hook

SMALL = Scene(running=3, standing=2, mass_kg=40_000.0, speed_m_per_s=2.0, duration_s=0.8)


def isothermal(model):
    """A spring so heavy that it does not warm up."""
    return replace(model, heat=HeatBalance(1e12))


@pytest.mark.parametrize("temperature_C", [25.0, 60.0])
def test_work_is_heat_and_what_is_held(temperature_C):
    """The ledger of one spring at one temperature: two integrals of its history against one of its state."""
    model = spring(
        temperature=TemperatureLaw(sensitivity_per_K=0.01, loss_sensitivity_per_K=0.002),
        viscous=ViscousBranch(0.06, 0.5, 0.03),
    )
    stroke = path(1.0, 80.0, 50.0, 52.0, 51.0, 90.0, 30.0, 106.0, 70.0, step_mm=0.01)
    time = np.arange(len(stroke)) * 1e-3
    result = simulate(model, time, stroke, temperature_C=temperature_C, isothermal=True)
    lags = lag_histories(model.viscous, time, np.minimum(stroke, model.tables.end_mm))
    held = stored_energy(model, stroke, band_history(model.tables, stroke), lags, temperature_C)
    np.testing.assert_allclose(
        result.work_J - result.heat_J, held - held[0], atol=2.0
    )  # overstress that relaxes in the stop
    assert held.max() > 5_000.0


def test_momentum_and_energy_are_kept():
    """Kinetic + stored + lost = constant; what is missing falls faster than the step."""
    springs = isothermal(category_a()), isothermal(draw_hook())
    gaps = []
    for step_s in (1e-3, 0.5e-3):
        found = facts(SMALL, run_impact(replace(SMALL, step_s=step_s), *springs))
        gaps.append(found["ledger, largest gap over kinetic energy before"])
        assert found["momentum, largest change"] < 1e-12
    assert gaps[0] < 2e-4
    assert gaps[1] < 0.45 * gaps[0]


def test_softening_costs_the_ledger_less_than_its_share_of_force():
    """With heat: a spring that softens under load keeps less than it took, 1 % of force a kelvin."""
    impact = run_impact(SMALL, category_a(), draw_hook())
    total = impact.kinetic_J + impact.stored_J + impact.lost_J
    assert total[-1] < total[0]
    assert np.abs(total / total[0] - 1.0).max() < 0.01 * impact.warming_K.max()
    assert np.all(np.diff(impact.lost_J) >= 0.0)
    assert 0.1 < impact.warming_K.max() < 2.0


def test_one_wagon_onto_one_is_the_stroke_of_its_energy():
    """At the turn both have one speed; all kinetic energy of the approach is in the four buffers or lost."""
    scene = Scene(running=1, standing=1, mass_kg=40_000.0, speed_m_per_s=2.0, duration_s=0.6)
    impact = run_impact(scene, isothermal(category_a()), draw_hook(), every=1)
    turn = int(np.argmax(impact.buffer_stroke_mm[:, 0]))
    assert impact.speed_m_per_s[turn] == pytest.approx([1.0, 1.0], abs=0.02)
    taken = impact.stored_J[turn] + impact.lost_J[turn]
    assert taken == pytest.approx(0.25 * 40_000.0 * 2.0**2, rel=2e-3)
    assert impact.gap_force_kN[-1, 0] == 0.0
    assert impact.stored_J[-1] - impact.stored_J[0] == pytest.approx(0.0, abs=10.0)
    parted = float(np.diff(impact.speed_m_per_s[-1])[0])
    lost = 1.0 - (parted / 2.0) ** 2  # of the energy of the approach
    assert lost == pytest.approx(impact.lost_J[-1] / (0.25 * 40_000.0 * 4.0), abs=3e-3)
    assert 0.25 < lost < 0.6


def test_equal_results_of_equal_gaps():
    """Mirror the trains (the standing one runs, seen from the other): the picture is mirrored."""
    scene = Scene(running=2, standing=2, duration_s=0.5)
    impact = run_impact(scene, category_a(), draw_hook())
    np.testing.assert_allclose(impact.gap_force_kN, impact.gap_force_kN[:, ::-1], atol=1e-6)
    np.testing.assert_allclose(
        impact.speed_m_per_s, scene.speed_m_per_s - impact.speed_m_per_s[:, ::-1], atol=1e-9
    )


def test_the_example_runs(tmp_path, capsys):
    main(["--out", str(tmp_path / "new"), "--wagons", "2", "--speed", "1.5", "--duration", "0.8"])
    figures = json.loads((tmp_path / "new" / "train-impact.json").read_text())
    assert json.loads(capsys.readouterr().out) == figures
    assert figures["ledger, largest gap over kinetic energy before"] < 2e-3
    assert (tmp_path / "new" / "train-impact.png").read_bytes().startswith(b"\x89PNG")
