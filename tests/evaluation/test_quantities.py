"""Figures of a cycle against closed forms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.results import CycleResult
from bufferstand.evaluation.loops.cut import cut_loop
from bufferstand.evaluation.quantities.evaluate import consistency_warnings, evaluate_cycle
from bufferstand.evaluation.quantities.loop_readings import stored_energy_J
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.signals import Ellipse, Floats, StaticTest


def evaluated(time: Floats, stroke: Floats, force: Floats) -> list[CycleResult]:
    record = make_record(time, stroke, force)
    return [evaluate_cycle(record, cycle) for cycle in find_cycles(record)]


def steady(results: Sequence[CycleResult]) -> list[CycleResult]:
    return [r for r in results if r.cycle.steady]


RATES = [(0.05, 250.0), (0.05, 5000.0), (0.5, 1000.0), (1.27, 1000.0), (2.5, 250.0), (2.5, 5000.0)]


@pytest.mark.parametrize(("frequency", "rate"), RATES)
def test_ellipse_without_noise(frequency: float, rate: float) -> None:
    ellipse = Ellipse()
    results = steady(evaluated(*ellipse.columns(frequency, rate, 3.3)))
    assert len(results) >= 2
    for result in results:
        q = result.quantities
        assert q.stored_energy_J == pytest.approx(ellipse.stored, rel=5e-4)
        assert q.absorbed_energy_J == pytest.approx(ellipse.absorbed, rel=5e-4)
        assert q.damping == pytest.approx(ellipse.absorbed / ellipse.stored, rel=5e-4)
        assert q.storage_stiffness_kN_per_mm == pytest.approx(4.0, rel=1e-3)
        assert q.loss_stiffness_kN_per_mm == pytest.approx(0.6, rel=1e-3)
        assert q.dynamic_stiffness_kN_per_mm == pytest.approx(np.hypot(4.0, 0.6), rel=1e-3)
        assert q.loss_factor == pytest.approx(0.15, rel=2e-3)
        # At mean stroke the elliptic term has its extreme: the slope there is the storage stiffness.
        assert q.tangent_stiffness_kN_per_mm == pytest.approx(4.0, rel=2e-3)
        assert q.secant_stiffness_kN_per_mm == pytest.approx(4.0, rel=1e-3)
        assert q.prestress_mm == pytest.approx(50.0, abs=1e-3)
        assert q.amplitude_mm == pytest.approx(20.0, rel=1e-4)
        assert q.frequency_Hz == pytest.approx(frequency, rel=1e-4)
        assert q.force_max_kN == pytest.approx(100.0 + 20.0 * np.hypot(4.0, 0.6), rel=1e-3)
        assert q.force_min_kN == pytest.approx(100.0 - 20.0 * np.hypot(4.0, 0.6), rel=1e-3)
        peak = 2.0 * np.pi * frequency * 20.0
        assert q.speed_loading_max_mm_per_s == pytest.approx(peak, rel=2e-3)
        assert q.speed_unloading_max_mm_per_s == pytest.approx(peak, rel=2e-3)
        assert q.stroke_distortion == pytest.approx(0.0, abs=1e-4)
        assert result.warnings == ()


@pytest.mark.parametrize(("frequency", "rate"), [(0.05, 250.0), (0.5, 1000.0), (2.5, 5000.0)])
@pytest.mark.parametrize("seed", [1, 2])
def test_ellipse_in_noise(frequency: float, rate: float, seed: int) -> None:
    ellipse = Ellipse()
    results = evaluated(*ellipse.columns(frequency, rate, 4.2, noise=5e-4, seed=seed))
    assert len(steady(results)) == sum(r.cycle.complete for r in results) >= 3
    for result in steady(results):
        q = result.quantities
        assert q.stored_energy_J == pytest.approx(ellipse.stored, rel=2e-3)
        assert q.absorbed_energy_J == pytest.approx(ellipse.absorbed, rel=2e-3)
        assert q.damping == pytest.approx(ellipse.absorbed / ellipse.stored, rel=2e-3)


def test_noise_does_not_bias_energies() -> None:
    """Extreme samples would add 0.1 to 0.3 %; the mean over many cycles is ten times closer."""
    ellipse = Ellipse()
    results = steady(evaluated(*ellipse.columns(1.0, 1000.0, 40.5, noise=1e-3)))
    stored = np.array([r.quantities.stored_energy_J for r in results], dtype=float)
    absorbed = np.array([r.quantities.absorbed_energy_J for r in results], dtype=float)
    assert stored.size >= 39
    assert np.mean(stored) == pytest.approx(ellipse.stored, rel=2e-4)
    assert np.mean(absorbed) == pytest.approx(ellipse.absorbed, rel=5e-4)


@pytest.mark.parametrize(("frequency", "rate"), [(0.05, 250.0), (0.5, 500.0), (2.5, 250.0), (2.5, 5000.0)])
def test_polynomial_branches(frequency: float, rate: float) -> None:
    """Progressive branches F_l = a + b x + c x⁴ up, F_u = F_l - d (x - x₁)(x₂ - x) down, sine stroke."""
    low, high, d = 30.0, 70.0, 0.12
    time = np.arange(round(3.4 * rate / frequency)) / rate
    stroke = 50.0 - 20.0 * np.cos(2.0 * np.pi * frequency * time + 0.7)
    up = np.sin(2.0 * np.pi * frequency * time + 0.7) >= 0.0
    loading = 15.0 + 2.0 * stroke + 4e-6 * stroke**4
    force = np.where(up, loading, loading - d * (stroke - low) * (high - stroke))
    stored = 15.0 * 40.0 + (high**2 - low**2) + 4e-6 * (high**5 - low**5) / 5.0
    absorbed = d * (high - low) ** 3 / 6.0
    results = steady(evaluated(time, stroke, force))
    assert len(results) >= 2
    for result in results:
        q = result.quantities
        assert q.stored_energy_J == pytest.approx(stored, rel=5e-4)
        assert q.absorbed_energy_J == pytest.approx(absorbed, rel=5e-4)
        assert q.damping == pytest.approx(absorbed / stored, rel=5e-4)
        assert q.tangent_stiffness_kN_per_mm == pytest.approx(2.0 + 1.6e-5 * 50.0**3, rel=2e-3)
        assert q.secant_stiffness_kN_per_mm == pytest.approx(2.0 + 4e-6 * (high**4 - low**4) / 40.0, rel=1e-3)
        # W_a = π K″ x_a² holds for any force wave if the stroke is a sine.
        assert q.loss_stiffness_kN_per_mm == pytest.approx(absorbed / np.pi / 400.0, rel=1e-3)


def test_link_of_damping_and_loss_factor() -> None:
    """D = π F_a sin δ / (2 F_m + (π/2) F_a sin δ) for a linear element (docs/facts/standards.md)."""
    ellipse = Ellipse()
    (result, *_) = steady(evaluated(*ellipse.columns(1.0, 1000.0, 3.3)))
    q = result.quantities
    assert q.dynamic_stiffness_kN_per_mm is not None
    assert q.loss_factor is not None
    force_amplitude = q.dynamic_stiffness_kN_per_mm * 20.0
    sine = np.sin(np.arctan(q.loss_factor))
    damping = np.pi * force_amplitude * sine / (2.0 * 100.0 + 0.5 * np.pi * force_amplitude * sine)
    assert q.damping == pytest.approx(damping, rel=1e-3)
    assert q.damping != pytest.approx(q.loss_factor, rel=0.1)


def test_triangular_static_loop() -> None:
    test = StaticTest(noise_mm=0.0, noise_kN=0.0, rate_Hz=50.0)
    results = evaluated(*test.columns())
    stored = 15.0 * 102.0 + 102.0**2 + 3.8e-6 * 102.0**5 / 5.0
    for result in results:
        q = result.quantities
        assert q.stored_energy_J == pytest.approx(stored, rel=5e-4)
        assert q.speed_loading_max_mm_per_s == pytest.approx(5.0, rel=1e-3)
        assert q.speed_unloading_max_mm_per_s == pytest.approx(5.0, rel=1e-3)
        assert q.stroke_max_mm == pytest.approx(102.0, abs=1e-3)


def test_dwell_adds_no_energy() -> None:
    short = evaluated(*StaticTest(noise_mm=0.0, noise_kN=0.0).columns())[0].quantities
    long = evaluated(*StaticTest(noise_mm=0.0, noise_kN=0.0, dwell_s=10.0).columns())[0].quantities
    assert short.absorbed_energy_J is not None
    assert long.absorbed_energy_J == pytest.approx(short.absorbed_energy_J, rel=1e-3)
    assert long.stored_energy_J == pytest.approx(short.stored_energy_J or 0.0, rel=1e-3)


@pytest.mark.parametrize("samples", [20, 50])
def test_few_samples_do_not_lose_area(samples: int) -> None:
    """The polygon through 20 points of an ellipse encloses 1.6 % too little (docs/facts/devices.md)."""
    ellipse = Ellipse()
    for result in steady(evaluated(*ellipse.columns(1.0, float(samples), 5.0))):
        assert result.quantities.absorbed_energy_J == pytest.approx(ellipse.absorbed, rel=1e-3)


def test_two_sided_loop() -> None:
    results = steady(evaluated(*Ellipse(mean_mm=0.0, mean_kN=1.0).columns(1.0, 500.0, 4.0)))
    assert results
    for result in results:
        assert result.quantities.damping == pytest.approx(
            result.quantities.absorbed_energy_J / result.quantities.stored_energy_J
        )  # type: ignore[operator]
        assert any("two-sided" in w and "not meaningful" in w for w in result.warnings)


def test_stored_energy_that_is_not_positive_gives_no_damping() -> None:
    results = steady(evaluated(*Ellipse(mean_kN=-20.0).columns(1.0, 500.0, 4.0)))
    for result in results:
        assert result.quantities.damping is None
        assert any("no damping" in w for w in result.warnings)


def test_negative_area_keeps_its_sign() -> None:
    results = steady(evaluated(*Ellipse(loss=-0.3).columns(1.0, 500.0, 4.0)))
    assert results
    for result in results:
        assert result.quantities.absorbed_energy_J == pytest.approx(-0.3 * np.pi * 400.0, rel=1e-3)
        assert result.quantities.damping is not None
        assert result.quantities.damping < 0.0
        assert any("negative" in w for w in result.warnings)


def test_loop_area_is_checked_against_the_work_of_its_harmonics() -> None:
    area = Ellipse().absorbed
    assert consistency_warnings(area, area) == []
    (warning,) = consistency_warnings(1.1 * area, area)
    assert "disagree by 10.0%" in warning


def test_a_stroke_that_is_no_pure_sine_is_not_said_to_be_ill_sampled() -> None:
    """Friction of 12 kN over 39.68 mm, and the work of the third harmonics: π · 3 · 12 kN · 0.16 mm.

    π K″ x_a², with half the range for x_a, lacks 2.6 % of their sum, and nothing is wrong.
    """
    time = np.arange(0.0, 6.0, 1e-3)
    angle = 2.0 * np.pi * time
    stroke = 50.0 - 20.0 * np.cos(angle) + 0.16 * np.cos(3.0 * angle)
    friction = 12.0 * np.tanh(50.0 * (np.sin(angle) - 0.024 * np.sin(3.0 * angle)))
    results = steady(evaluated(time, stroke, 2.0 * stroke + friction - 12.0 * np.sin(3.0 * angle)))
    assert len(results) > 3
    area = 4.0 * 12.0 * 19.84 + np.pi * 3.0 * 12.0 * 0.16
    for result in results:
        quantities = result.quantities
        assert quantities.absorbed_energy_J == pytest.approx(area, rel=0.005)
        assert quantities.loss_stiffness_kN_per_mm is not None
        assert quantities.amplitude_mm is not None
        alone = np.pi * quantities.loss_stiffness_kN_per_mm * quantities.amplitude_mm**2
        assert alone < 0.98 * area
        assert not any("disagree" in text for text in result.warnings), result.warnings


def test_slack_and_block_contact_are_said() -> None:
    time, stroke, _ = StaticTest(noise_mm=0.0, noise_kN=0.0).columns()
    slack = np.maximum(stroke - 5.0, 0.0) * 4.0
    assert any("slack" in w for r in evaluated(time, stroke, slack) for w in r.warnings)
    block = 4.0 * stroke + 100.0 * np.maximum(stroke - 101.0, 0.0)
    assert all(any("block contact" in w for w in r.warnings) for r in evaluated(time, stroke, block))
    clean = evaluated(*StaticTest(noise_mm=0.0, noise_kN=0.0).columns())
    assert all(r.warnings == () for r in clean)


def test_incomplete_cycle_has_no_energies() -> None:
    time, stroke, force = Ellipse().columns(1.0, 500.0, 5.0)
    keep = np.delete(np.arange(time.size), slice(1000, 1040))
    (broken,) = [r for r in evaluated(time[keep], stroke[keep], force[keep]) if "gap" in str(r.cycle.why)]
    q = broken.quantities
    assert q.stored_energy_J is q.absorbed_energy_J is q.damping is q.frequency_Hz is None
    assert q.amplitude_mm is None  # a hole of this length could hide the turn itself
    assert "no figures" in broken.warnings[0]


def test_loop_meets_its_turning_points() -> None:
    record = make_record(*StaticTest(dwell_s=2.0).columns())
    for cycle in find_cycles(record):
        loop = cut_loop(record, cycle)
        assert loop.stroke_mm[0] == cycle.stroke_min_mm
        assert loop.stroke_mm[loop.top] == cycle.stroke_max_mm
        assert loop.stroke_mm[-1] == cycle.stroke_end_mm
        assert loop.time_s[loop.unload] - loop.time_s[loop.top] == pytest.approx(2.0, abs=0.1)
        assert np.all(np.diff(loop.time_s) >= 0.0)
        assert loop.time_s.size < 2500
        assert stored_energy_J(loop) > 0.0
