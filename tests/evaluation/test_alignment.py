"""Skew: what a millisecond changes, against the closed form; measured on elastic references of known skew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.uncertainty.skew.measure import SkewMeasurement, measure_skew
from bufferstand.evaluation.uncertainty.skew.sensitivity import (
    advanced,
    area_rate_J_per_s,
    skew_sensitivity,
)
from bufferstand.foundation.errors import BadInput
from tests.evaluation.signals import Ellipse, Floats, StaticTest


def progressive(stroke_mm: Floats) -> Floats:
    """Return the force of an elastic spring that stiffens: 2 kN/mm at contact, 8 kN/mm at 100 mm."""
    return 20.0 + 2.0 * stroke_mm + 3e-2 * stroke_mm**2


def elastic(
    frequency_Hz: float,
    skew_s: float,
    *,
    cycles: float = 12.5,
    rate_Hz: float = 1000.0,
    amplitude_mm: float = 15.0,
    loss: float = 0.0,
    noise: float = 0.0,
    seed: int = 1,
    triangle: bool = False,
) -> Record:
    """Return a record of an elastic spring whose force is late; ``loss``: of rate-independent kind."""
    time = np.arange(round(cycles / frequency_Hz * rate_Hz)) / rate_Hz

    def stroke_at(at: Floats) -> Floats:
        angle = 2.0 * np.pi * frequency_Hz * at + 0.4
        wave = 2.0 / np.pi * np.arcsin(np.sin(angle)) if triangle else np.sin(angle)
        return 50.0 + amplitude_mm * wave

    stroke, late = stroke_at(time), time - skew_s
    force = progressive(stroke_at(late))
    force = force + loss * 5.0 * amplitude_mm * np.cos(2.0 * np.pi * frequency_Hz * late + 0.4)
    random = np.random.default_rng(seed)
    stroke = stroke + noise * 2.0 * amplitude_mm * random.standard_normal(time.size)
    force = force + noise * float(np.ptp(force)) * random.standard_normal(time.size)
    return make_record(time, stroke, force)


def facts(name: str = "spring", delay_s: float = 0.0) -> RunFacts:
    return RunFacts(name, "harmonic", force_delay_s=delay_s)


def measured(*records: Record, **options: float) -> SkewMeasurement:
    return measure_skew([(record, facts(f"r{i}")) for i, record in enumerate(records)], **options)


@pytest.mark.parametrize("frequency", [0.1, 0.5, 1.27, 2.55])
@pytest.mark.parametrize("skew_s", [-2e-3, 5e-5, 1e-3, 8e-3])
def test_skew_of_an_elastic_spring_is_found(frequency: float, skew_s: float) -> None:
    result = measured(elastic(frequency, skew_s, cycles=5.5))
    assert result.skew_s == pytest.approx(skew_s, rel=1e-3, abs=2e-7)
    assert result.by_phase_s == pytest.approx(skew_s, rel=1e-3, abs=2e-7)
    assert result.criterion == "no-area"


def test_the_motion_need_not_be_a_sine() -> None:
    result = measured(elastic(1.0, 1e-3, triangle=True))
    assert result.skew_s == pytest.approx(1e-3, rel=0.01)


def test_what_to_write_is_the_former_delay_and_the_skew() -> None:
    result = measure_skew([(elastic(1.0, 4e-4), facts(delay_s=8e-4))])
    assert result.force_delay_s == 8e-4
    assert result.delay_s == pytest.approx(1.2e-3, rel=1e-3)


def test_several_frequencies_tell_loss_from_skew() -> None:
    """A rate-independent loss factor of 0.01 looks like -1.6 ms at 1 Hz; over frequency it drops out."""
    records = [elastic(f, 8e-4, loss=0.01, cycles=8.5) for f in (0.5, 1.0, 2.0)]
    alone = measured(records[1])
    assert alone.skew_s == pytest.approx(8e-4 - 0.01 / (2.0 * np.pi), rel=0.02)
    result = measured(*records)
    assert result.criterion == "area-linear-in-frequency"
    assert result.skew_s == pytest.approx(8e-4, rel=2e-3)
    assert result.by_phase_s == pytest.approx(8e-4, rel=2e-3)
    assert result.reference_loss == pytest.approx(0.01, rel=0.01)


def test_one_frequency_carries_the_loss_that_the_reference_may_have() -> None:
    record = elastic(1.0, 5e-4)
    tight, wide = measured(record, reference_loss=1e-4), measured(record, reference_loss=1e-3)
    expected = 1e-3 / np.sqrt(3.0) / (2.0 * np.pi)
    assert wide.standard_uncertainties_s["reference loss"] == pytest.approx(expected, rel=1e-3)
    assert wide.expanded_uncertainty_s == pytest.approx(2.0 * expected, rel=0.01)
    assert tight.expanded_uncertainty_s < 0.2 * wide.expanded_uncertainty_s


def test_no_skew_is_known_to_nanoseconds() -> None:
    """Records made by a program scatter by nothing; time stamps, clock and reference are no better for it."""
    several = measured(*(elastic(f, 8e-4, cycles=8.5) for f in (0.5, 1.0, 2.5)))
    own = several.standard_uncertainties_s
    assert own["time stamps"] == pytest.approx(np.sqrt(2.0) * 1e-6 / np.sqrt(12.0))
    assert own["clock"] == pytest.approx(1e-4 * 8e-4 / np.sqrt(3.0), rel=1e-3)
    assert own["reference loss over rate"] == pytest.approx(
        0.1 * 1e-3 / (4.0 * np.pi) / np.sqrt(3.0), rel=1e-3
    )
    assert several.expanded_uncertainty_s == pytest.approx(
        2.0 * np.sqrt(sum(u**2 for u in own.values())), 0.01
    )
    assert several.expanded_uncertainty_s > 9e-6
    sure = measured(elastic(1.0, 5e-5), reference_loss=0.0)
    assert sure.expanded_uncertainty_s > 0.8e-6


def test_a_filter_that_delays_more_differs_more_from_another() -> None:
    slow = measure_skew([(elastic(2.5, 0.0), facts(delay_s=8e-3))])
    fast = measure_skew([(elastic(2.5, 0.0), facts(delay_s=8e-4))])
    ratio = slow.standard_uncertainties_s["filters"] / fast.standard_uncertainties_s["filters"]
    assert ratio == pytest.approx(1000.0, rel=0.01)
    expected = 8e-3 * (2.0 * np.pi * 2.5 * 8e-3) ** 2 / 3.0 / np.sqrt(3.0)
    assert slow.standard_uncertainties_s["filters"] == pytest.approx(expected, rel=0.01)


def test_converter_steps_that_repeat_in_every_cycle_do_not_average_out() -> None:
    fine = elastic(1.0, 5e-4)
    coarse = replace(fine, stroke_mm=np.round(fine.stroke_mm / 0.1) * 0.1)
    found = measured(coarse, reference_loss=0.0).standard_uncertainties_s["resolution"]
    expected = np.sqrt(2.0 / 1000.0) * 0.1 / np.sqrt(12.0) / 15.0 / (2.0 * np.pi)
    assert found == pytest.approx(expected, rel=0.05)
    assert measured(fine).standard_uncertainties_s["resolution"] == 0.0


def covered(trials: int, frequencies: tuple[float, ...]) -> int:
    """Count how often the interval holds the truth, by noise alone (a reference without loss)."""
    inside = 0
    for trial in range(trials):
        records = [
            elastic(f, 6e-4, cycles=6.5, rate_Hz=100.0, noise=1e-3, seed=100 * trial + i)
            for i, f in enumerate(frequencies)
        ]
        result = measured(*records, reference_loss=0.0)
        inside += abs(result.skew_s - 6e-4) <= result.expanded_uncertainty_s
    return inside


def test_the_interval_covers_the_truth() -> None:
    assert 27 <= covered(30, (0.8,)) <= 30


@pytest.mark.long
@pytest.mark.parametrize("frequencies", [(1.0,), (0.8, 1.6, 2.5)])
def test_the_interval_covers_the_truth_in_95_percent(frequencies: tuple[float, ...]) -> None:
    assert 0.93 <= covered(1000, frequencies) / 1000 <= 0.97


def test_a_lossy_reference_is_said() -> None:
    assert any("wide for an elastic reference" in w for w in measured(elastic(1.0, 0.0, loss=0.1)).warnings)
    several = measured(elastic(0.5, 0.0, loss=0.1), elastic(2.0, 0.0, loss=0.1))
    assert any("loses energy itself" in w for w in several.warnings)


def test_varying_amplitude_is_said() -> None:
    result = measured(elastic(0.5, 1e-4), elastic(2.0, 1e-4, amplitude_mm=5.0))
    assert any("amplitude varies from 5 to 15 mm" in w for w in result.warnings)


def test_refusals() -> None:
    with pytest.raises(BadInput, match="fewer than 3 complete, steady cycles"):
        measured(elastic(1.0, 0.0, cycles=2.5))
    with pytest.raises(BadInput, match="different delays"):
        measure_skew([(elastic(1.0, 0.0), facts()), (elastic(2.0, 0.0), facts(delay_s=1e-3))])
    falling = elastic(1.0, 0.0)
    with pytest.raises(BadInput, match="does not rise with the stroke"):
        measured(replace(falling, force_kN=-falling.force_kN))
    with pytest.raises(BadInput, match="must not be negative"):
        measured(elastic(1.0, 0.0), reference_loss=-0.1)


def test_area_rate_of_a_sine_is_its_closed_form() -> None:
    ellipse = Ellipse()
    record = make_record(*ellipse.columns(2.0, 500.0, 3.5))
    cycle = next(c for c in find_cycles(record) if c.complete)
    expected = np.pi * 2.0 * np.pi * 2.0 * ellipse.storage * ellipse.amplitude_mm**2
    assert area_rate_J_per_s(record, cycle) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("frequency", [0.08, 1.27, 2.55])
def test_a_millisecond_by_shifting_and_by_closed_form(frequency: float) -> None:
    ellipse = Ellipse()
    record = make_record(*ellipse.columns(frequency, 1000.0, 3.5))
    cycles = [c for c in find_cycles(record) if c.complete]
    found = skew_sensitivity(record, cycles, periodic=True)
    energy = np.pi * 2.0 * np.pi * frequency * ellipse.storage * ellipse.amplitude_mm**2 * 1e-3
    damping = energy / ellipse.stored * (1.0 - 0.5 * ellipse.absorbed / ellipse.stored)
    assert found.form == "sine-stroke"
    for way in ("by_shifting", "closed_form"):
        assert found.absorbed_energy_J_per_ms[way] == pytest.approx(energy, rel=2e-3)
        assert found.damping_per_ms[way] == pytest.approx(damping, rel=5e-3)


def test_standards_figures_of_a_millisecond() -> None:
    """docs/facts/standards.md: at tan δ 0.15, 1 ms costs 0.3 % of W_a at 0.08 Hz, 11 % at 2.55 Hz."""
    for frequency, share in ((0.08, 0.0033), (1.27, 0.053), (2.55, 0.107)):
        record = make_record(*Ellipse().columns(frequency, 1000.0, 2.5))
        cycles = [c for c in find_cycles(record) if c.complete]
        energy = skew_sensitivity(record, cycles, periodic=True).absorbed_energy_J_per_ms["by_shifting"]
        assert energy is not None
        assert energy / Ellipse().absorbed == pytest.approx(share, rel=0.02)


def test_quasi_static_closed_form() -> None:
    """docs/facts/standards.md: a static area errs by 2 v τ (F_max - F_min)."""
    record = StaticTest(noise_kN=0.0, noise_mm=0.0).record()
    cycles = [c for c in find_cycles(record) if c.complete]
    found = skew_sensitivity(record, cycles, periodic=True)
    assert found.form == "constant-speed"
    span = float(np.ptp(record.force_kN))
    assert found.absorbed_energy_J_per_ms["closed_form"] == pytest.approx(2.0 * 5.0 * span * 1e-3, rel=0.02)
    shifted = found.absorbed_energy_J_per_ms["by_shifting"]
    assert shifted == pytest.approx(found.absorbed_energy_J_per_ms["closed_form"], rel=0.05)


def test_no_closed_form_and_no_cycle() -> None:
    record = make_record(*Ellipse().columns(1.0, 500.0, 2.5))
    cycles = [c for c in find_cycles(record) if c.complete]
    impact = skew_sensitivity(record, cycles, periodic=False)
    assert impact.form == "none"
    assert impact.damping_per_ms["closed_form"] is None
    assert impact.damping_per_ms["by_shifting"] is not None
    nothing = skew_sensitivity(record, [], periodic=True)
    assert nothing.absorbed_energy_J_per_ms == {"by_shifting": None, "closed_form": None}


def test_force_is_not_moved_across_a_break() -> None:
    time, stroke, force = Ellipse().columns(1.0, 500.0, 4.5)
    force = force.copy()
    force[100:110] = np.nan
    record = make_record(time, stroke, force)
    cycle = next(c for c in find_cycles(record) if c.complete)
    part = advanced(record, cycle, 5e-4)
    assert part.time_s[0] >= record.time_s[record.breaks[0]]
    assert np.all(np.isfinite(part.force_kN))
