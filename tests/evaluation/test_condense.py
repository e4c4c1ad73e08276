"""A long record at the resolution of its cycles: same figures, nothing averaged across a break."""

from __future__ import annotations

import numpy as np
import pytest

from evaluation import reversals
from evaluation.condense import condensed, samples_a_block
from evaluation.cycles import find_cycles
from evaluation.quantities import evaluate_cycle
from evaluation.record import make_record
from evaluation.results import Options, RunFacts
from evaluation.reversals import find_reversals, noise_sigma
from evaluation.run import evaluate_run
from foundation.specimen import Kind
from tests.evaluation.signals import Ellipse


def test_figures_are_those_of_all_samples() -> None:
    record = make_record(*Ellipse().columns(0.1, 4000.0, 3.3, noise=5e-4))
    short = condensed(record)
    size = samples_a_block(record)
    assert size in (9, 10)  # 40 000 samples a cycle, less what noise moves a coarse extreme by
    assert short.time_s.size == -(-record.time_s.size // size)
    whole, less = (
        [evaluate_cycle(r, c).quantities for c in find_cycles(r) if c.steady] for r in (record, short)
    )
    assert len(whole) == len(less) == 2
    for one, two in zip(whole, less, strict=True):
        for name in ("stored_energy_J", "absorbed_energy_J", "storage_stiffness_kN_per_mm", "frequency_Hz"):
            assert getattr(two, name) == pytest.approx(getattr(one, name), rel=1e-4)
        assert two.stroke_max_mm == pytest.approx(one.stroke_max_mm, abs=2e-3)


def test_short_cycles_stay_as_they_are() -> None:
    record = make_record(*Ellipse().columns(1.0, 5000.0, 3.3))
    assert condensed(record) is record


def test_shortest_branch_keeps_its_points() -> None:
    """A fast stroke in and a slow one out: the cycle is long, its loading branch is not."""
    knots = np.cumsum([0.0, *[0.5, 14.5] * 4])
    at = np.arange(0.0, knots[-1], 1e-3)
    stroke = np.interp(at, knots, [0.0, *[40.0, 0.0] * 4])
    assert samples_a_block(make_record(at, stroke, 3.0 * stroke)) == 1


@pytest.mark.parametrize("kind", ["impact", "proof"])
def test_peak_of_a_single_event_is_not_averaged(kind: Kind) -> None:
    """Long pulses, with a force that peaks over 40 of 24 000 samples."""
    at = np.arange(72_000) / 60_000.0
    pulse = np.maximum(np.sin(2.0 * np.pi * 2.5 * at), 0.0)
    peak = np.exp(-((((at - 0.1 + 0.2) % 0.4 - 0.2) / 3e-4) ** 2))
    record = make_record(at, 80.0 * pulse, 300.0 * pulse + 900.0 * peak)
    assert condensed(record) is not record
    assert evaluate_run(record, RunFacts("one", kind), Options(draws=1)).record is record


def test_harmonic_run_keeps_fewer_points() -> None:
    record = make_record(*Ellipse().columns(1.0, 3000.0, 4.3, noise=5e-4))
    assert condensed(record) is record
    one, two = (evaluate_run(record, RunFacts("one", kind)) for kind in ("static", "harmonic"))
    assert one.record is record
    assert two.record.time_s.size == -(-record.time_s.size // 2)
    for name in ("stored_energy_J", "absorbed_energy_J", "storage_stiffness_kN_per_mm", "force_max_kN"):
        found = two.summary.values[name].value
        assert found == pytest.approx(one.summary.values[name].value, rel=2e-4)


def test_blocks_end_at_a_break() -> None:
    time, stroke, force = Ellipse().columns(0.1, 4000.0, 3.3)
    kept = np.delete(np.arange(time.size), slice(50_003, 50_777))
    record = make_record(time[kept], stroke[kept], force[kept])
    short = condensed(record)
    (at,) = short.breaks
    gap = (time[50_002], time[50_777])
    assert short.time_s[at - 1] <= gap[0]
    assert short.time_s[at] >= gap[1]
    assert np.max(np.delete(np.diff(short.time_s), at - 1)) < 1.01 * 10 / 4000.0
    assert short.defects == record.defects
    assert not any(c.complete for c in find_cycles(short) if c.start_s < gap[0] < c.end_s)


@pytest.mark.parametrize("per_cycle", [20, 300, 5000, 90_000])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_reversals_by_blocks_are_those_of_all_samples(
    monkeypatch: pytest.MonkeyPatch, per_cycle: int, noise: float
) -> None:
    """Also of a burst that is hidden inside single blocks of a slow record."""
    random = np.random.default_rng(1)
    at = np.arange(300_000)
    stroke = 50.0 + 20.0 * np.sin(2.0 * np.pi * at / per_cycle)
    stroke[150_000:150_400] += 9.0 * np.sin(2.0 * np.pi * np.arange(400) / 40.0)
    stroke += noise * random.standard_normal(at.size)
    sigma = noise_sigma(stroke)
    by_blocks = find_reversals(stroke, sigma)
    monkeypatch.setattr(reversals, "_STRETCHES", 10_000)
    np.testing.assert_array_equal(by_blocks, find_reversals(stroke, sigma))
