"""The whole matrix of closed forms: 0.05 to 2.5 Hz, 250 Hz to 5 kHz, ellipse and polynomial branches.

Energies and damping within 0.05 % without noise, K′, K″ and |K*| within 0.1 %, tangent within 0.2 %. With
white noise of 0.05 % of the range on both channels, energies within 0.2 %: for the mean over the steady
cycles (20; 3 where a cycle has more than 5000 samples) at every rate, and for each cycle alone from 1000
samples a cycle on. With fewer, noise alone moves single cycles more than that
(:func:`test_single_cycles_of_few_samples`). No cycle is lost or invented in any.
"""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.results import Quantities
from bufferstand.evaluation.quantities.evaluate import evaluate_cycle
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.signals import Ellipse, Floats

FREQUENCIES = (0.05, 0.2, 0.5, 1.27, 2.5)
RATES = (250.0, 1000.0, 5000.0)
LOW, HIGH, LOST = 30.0, 70.0, 0.12
PHASE = 0.7


def steady(columns: tuple[Floats, Floats, Floats], expected: int) -> list[Quantities]:
    """Return the figures of the steady cycles; there must be exactly so many, and no other complete one."""
    record = make_record(*columns)
    cycles = find_cycles(record)
    assert [c.complete for c in cycles].count(True) == expected
    assert [c.steady for c in cycles].count(True) == expected
    return [evaluate_cycle(record, c).quantities for c in cycles if c.steady]


def branches(
    frequency: float, rate: float, cycles: float, noise: float, seed: int
) -> tuple[Floats, Floats, Floats]:
    """F = a + b x + c x⁴ up, less d (x - x₁)(x₂ - x) down; sine stroke."""
    time = np.arange(round(cycles * rate / frequency)) / rate
    angle = 2.0 * np.pi * frequency * time + PHASE
    stroke = 50.0 - 20.0 * np.cos(angle)
    loading = 15.0 + 2.0 * stroke + 4e-6 * stroke**4
    force = np.where(np.sin(angle) >= 0.0, loading, loading - LOST * (stroke - LOW) * (HIGH - stroke))
    random = np.random.default_rng(seed)
    force = force + noise * float(np.ptp(force)) * random.standard_normal(time.size)
    return time, stroke + noise * (HIGH - LOW) * random.standard_normal(time.size), force


STORED = 15.0 * 40.0 + (HIGH**2 - LOW**2) + 4e-6 * (HIGH**5 - LOW**5) / 5.0
ABSORBED = LOST * (HIGH - LOW) ** 3 / 6.0


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("frequency", FREQUENCIES)
def test_ellipse(frequency: float, rate: float) -> None:
    ellipse = Ellipse()
    # From 1 rad on, 3.3 cycles hold the lower turns of three, so two whole ones.
    for q in steady(ellipse.columns(frequency, rate, 3.3), 2):
        assert q.stored_energy_J == pytest.approx(ellipse.stored, rel=5e-4)
        assert q.absorbed_energy_J == pytest.approx(ellipse.absorbed, rel=5e-4)
        assert q.damping == pytest.approx(ellipse.absorbed / ellipse.stored, rel=5e-4)
        assert q.storage_stiffness_kN_per_mm == pytest.approx(4.0, rel=1e-3)
        assert q.loss_stiffness_kN_per_mm == pytest.approx(0.6, rel=1e-3)
        assert q.dynamic_stiffness_kN_per_mm == pytest.approx(np.hypot(4.0, 0.6), rel=1e-3)
        assert q.tangent_stiffness_kN_per_mm == pytest.approx(4.0, rel=2e-3)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("frequency", FREQUENCIES)
def test_polynomial_branches(frequency: float, rate: float) -> None:
    for q in steady(branches(frequency, rate, 3.4, 0.0, 1), 2):
        assert q.stored_energy_J == pytest.approx(STORED, rel=5e-4)
        assert q.absorbed_energy_J == pytest.approx(ABSORBED, rel=5e-4)
        assert q.damping == pytest.approx(ABSORBED / STORED, rel=5e-4)
        # W_a = π K″ x_a² holds for any force wave over a sine stroke.
        assert q.loss_stiffness_kN_per_mm == pytest.approx(ABSORBED / np.pi / 400.0, rel=1e-3)
        assert q.tangent_stiffness_kN_per_mm == pytest.approx(2.0 + 1.6e-5 * 50.0**3, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("frequency", FREQUENCIES)
@pytest.mark.parametrize("shape", ["ellipse", "branches"])
def test_in_noise(frequency: float, rate: float, shape: str) -> None:
    many = 20 if rate / frequency <= 5000.0 else 3
    ellipse = Ellipse()
    if shape == "ellipse":
        columns, stored, absorbed = (
            ellipse.columns(frequency, rate, many + 1.3, noise=5e-4, seed=5),
            ellipse.stored,
            ellipse.absorbed,
        )
    else:
        columns, stored, absorbed = branches(frequency, rate, many + 1.4, 5e-4, 5), STORED, ABSORBED
    figures = steady(columns, many)
    for name, truth in (("stored_energy_J", stored), ("absorbed_energy_J", absorbed)):
        values = np.array([getattr(q, name) for q in figures])
        assert np.mean(values) == pytest.approx(truth, rel=2e-3)
        if rate / frequency >= 1000.0:
            np.testing.assert_allclose(values, truth, rtol=2e-3)


def test_single_cycles_of_few_samples() -> None:
    """At 100 samples a cycle white noise alone scatters W_a of single cycles; their mean is not biased."""
    ellipse = Ellipse()
    figures = steady(ellipse.columns(2.5, 250.0, 200.3, noise=5e-4, seed=9), 199)
    absorbed = np.array([q.absorbed_energy_J for q in figures], dtype=float) / ellipse.absorbed - 1.0
    # Noise of force: σ_F A √(2 N)/2 · 2π/N; the stroke's the same with F's amplitude.
    force, stroke = 5e-4 * 2.0 * np.hypot(80.0, 12.0), 5e-4 * 40.0
    expected = 2.0 * np.pi / 100.0 * np.sqrt(50.0) * np.hypot(force * 20.0, stroke * np.hypot(80.0, 12.0))
    assert np.std(absorbed) == pytest.approx(expected / ellipse.absorbed, rel=0.35)
    assert np.max(np.abs(absorbed)) > 2e-3
    assert abs(np.mean(absorbed)) < 3e-4
