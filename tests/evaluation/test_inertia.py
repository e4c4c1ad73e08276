"""Inertia correction: a mass before a spring whose true force is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.evaluation.document.build import evaluation_document
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.loops.inertia import acceleration_mm_per_s2, acceleration_noise_mm_per_s2
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import ChannelUncertainty
from bufferstand.foundation.errors import BadInput
from tests.evaluation.signals import Ellipse, StaticTest

MASS_KG = 150.0
FREQUENCY = 2.55
SMALL = Ellipse(mean_mm=50.0, amplitude_mm=5.0, mean_kN=100.0, storage=3.0, loss=0.45)
FACTS = RunFacts("h", "harmonic")


def measured(noise: float = 0.0) -> Record:
    """Return what a cell that pushes 150 kg before the spring reads: F_cell = F_spring + m d²x/dt²."""
    time, stroke, force = SMALL.columns(FREQUENCY, 1000.0, 8.5)
    omega = 2.0 * np.pi * FREQUENCY
    force = force + MASS_KG * 1e-6 * -(omega**2) * (stroke - SMALL.mean_mm)
    random = np.random.default_rng(2)
    stroke = stroke + noise * 10.0 * random.standard_normal(time.size)
    force = force + noise * float(np.ptp(force)) * random.standard_normal(time.size)
    return make_record(time, stroke, force)


def value(run: RunEvaluation, name: str) -> float:
    found = run.summary.values[name].value
    assert found is not None
    return found


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_the_springs_own_stiffness_comes_back(noise: float) -> None:
    raw = evaluate_run(measured(noise), FACTS)
    mended = evaluate_run(measured(noise), FACTS, Options(moving_mass_kg=MASS_KG))
    # m ω² = 0.0385 kN/mm: 1.3 % of K', as docs/facts/standards.md says.
    assert value(raw, "storage_stiffness_kN_per_mm") == pytest.approx(3.0 - 0.0385, rel=2e-3)
    assert value(mended, "storage_stiffness_kN_per_mm") == pytest.approx(3.0, rel=1e-3)
    assert value(mended, "absorbed_energy_J") == pytest.approx(value(raw, "absorbed_energy_J"), rel=1e-3)
    assert value(mended, "absorbed_energy_J") == pytest.approx(SMALL.absorbed, rel=3e-3)


def test_it_is_off_unless_stated_and_then_said() -> None:
    record = measured()
    off = evaluate_run(record, FACTS)
    by_stand = evaluate_run(record, replace(FACTS, moving_mass_kg=MASS_KG))
    by_option = evaluate_run(record, replace(FACTS, moving_mass_kg=70.0), Options(moving_mass_kg=MASS_KG))
    switched_off = evaluate_run(record, replace(FACTS, moving_mass_kg=70.0), Options(moving_mass_kg=0.0))
    entries = [
        run["inertia_correction"]
        for run in evaluation_document([off, by_stand, by_option, switched_off])["runs"]
    ]
    nothing = {
        "moving_mass_kg": 0.0,
        "source": "none",
        "largest_force_kN": 0.0,
        "accuracy_percent": 5.0,
        "force_cell": "moving-side",
    }
    assert entries[0] == entries[3] == nothing
    assert [e["source"] for e in entries] == ["none", "stand", "option", "none"]
    largest = MASS_KG * 1e-6 * (2.0 * np.pi * FREQUENCY) ** 2 * 5.0
    assert largest == pytest.approx(0.19, abs=0.005)
    for entry in entries[1:3]:
        assert entry["moving_mass_kg"] == MASS_KG
        assert (entry["accuracy_percent"], entry["force_cell"]) == (5.0, "moving-side")
        assert entry["largest_force_kN"] == pytest.approx(largest, rel=0.02)
    assert value(by_stand, "storage_stiffness_kN_per_mm") == value(by_option, "storage_stiffness_kN_per_mm")


def test_a_static_test_is_hardly_changed() -> None:
    test = StaticTest()
    run = evaluate_run(test.record(), test.facts(), Options(draws=100, moving_mass_kg=MASS_KG))
    plain = test.evaluate(draws=100)
    assert run.inertia_correction is not None
    assert 0.0 < run.inertia_correction.largest_force_kN < 0.01
    assert value(run, "damping") == pytest.approx(value(plain, "damping"), rel=1e-4)
    assert run.verdict == plain.verdict


def test_acceleration_does_not_cross_a_break() -> None:
    time = np.arange(2000) / 1000.0
    stroke = np.where(time < 1.0, 5.0 * time**2, 40.0 + 3.0 * (time - 1.0) ** 2)
    time = np.where(time < 1.0, time, time + 5.0)
    record = make_record(time, stroke, np.zeros(time.size))
    assert len(record.breaks) == 1
    acceleration = acceleration_mm_per_s2(record, 0.2)
    np.testing.assert_allclose(acceleration[:1000], 10.0, rtol=1e-4)
    np.testing.assert_allclose(acceleration[1000:], 6.0, rtol=1e-4)


def test_a_negative_mass_is_refused() -> None:
    with pytest.raises(BadInput, match="moving mass of -1 kg"):
        evaluate_run(measured(), FACTS, Options(moving_mass_kg=-1.0))


STATED = replace(
    FACTS,
    force_uncertainty=ChannelUncertainty(accuracy_percent=0.0),
    stroke_uncertainty=(ChannelUncertainty(linearity=0.0),),
)
OMEGA_SQUARED = (2.0 * np.pi * FREQUENCY) ** 2


def test_behind_the_specimen_the_sign_turns() -> None:
    """A cell on the fixed side: what it reads grows by m a, and K′ falls by m ω²."""
    raw = evaluate_run(measured(), FACTS)
    behind = evaluate_run(
        measured(), replace(FACTS, force_cell="fixed-side"), Options(moving_mass_kg=MASS_KG)
    )
    change = value(behind, "storage_stiffness_kN_per_mm") - value(raw, "storage_stiffness_kN_per_mm")
    assert change == pytest.approx(-MASS_KG * 1e-6 * OMEGA_SQUARED, rel=0.02)
    in_front = evaluate_run(measured(), FACTS, Options(moving_mass_kg=MASS_KG, force_cell="moving-side"))
    change = value(in_front, "storage_stiffness_kN_per_mm") - value(raw, "storage_stiffness_kN_per_mm")
    assert change == pytest.approx(MASS_KG * 1e-6 * OMEGA_SQUARED, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("percent", [None, 20.0])
def test_the_mass_is_part_of_the_uncertainty(percent: float | None) -> None:
    """u(K′) = ω² u(m), nothing of the energy absorbed; a line of the budget says so."""
    options = Options(draws=4000, moving_mass_kg=MASS_KG, moving_mass_accuracy_percent=percent)
    run = evaluate_run(measured(), STATED, options)
    u_mass = MASS_KG * 0.01 * (percent or 5.0) / np.sqrt(3.0)
    stiffness = run.summary.values["storage_stiffness_kN_per_mm"].expanded_uncertainty
    assert stiffness == pytest.approx(2.0 * u_mass * 1e-6 * OMEGA_SQUARED, rel=0.05)
    absorbed = run.summary.values["absorbed_energy_J"].expanded_uncertainty
    assert absorbed is not None
    assert absorbed < 2e-3 * SMALL.absorbed
    tangent = next(b for b in run.budget if b.quantity == "tangent_stiffness_kN_per_mm")
    line = next(line for line in tangent.lines if line.source == "moving mass")
    assert line.u == pytest.approx(u_mass / MASS_KG)
    assert line.contribution == pytest.approx(u_mass * 1e-6 * OMEGA_SQUARED, rel=0.05)
    assert tangent.u == pytest.approx(tangent.u_monte_carlo, rel=0.05)
    without = evaluate_run(measured(), STATED, Options(draws=4000))
    assert "moving mass" not in {line.source for budget in without.budget for line in budget.lines}


@pytest.mark.slow
def test_noise_of_the_acceleration() -> None:
    """What repeated noisy records of a stroke at rest show is what is stated."""
    random = np.random.default_rng(4)
    time = np.arange(20_000) / 1000.0
    record = make_record(time, 0.01 * random.standard_normal(time.size), np.zeros(time.size))
    found = float(np.std(acceleration_mm_per_s2(record, 0.08)))
    assert acceleration_noise_mm_per_s2(record, 0.08) == pytest.approx(found, rel=0.1)


@pytest.mark.slow
def test_an_accuracy_that_is_none_is_refused() -> None:
    options = Options(moving_mass_kg=MASS_KG, moving_mass_accuracy_percent=-1.0)
    with pytest.raises(BadInput, match="cannot be known to -1 %"):
        evaluate_run(measured(), FACTS, options)
