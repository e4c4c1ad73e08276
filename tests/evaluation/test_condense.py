"""A long record at the resolution of its cycles: same figures, nothing averaged across a break."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.loading.condense import condensed_for
from bufferstand.evaluation.numerics import reversals
from bufferstand.evaluation.numerics.reversals import find_reversals, sampling_of
from bufferstand.evaluation.quantities.evaluate import evaluate_cycle
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.run_kinds import Kind
from tests.evaluation.signals import Ellipse
from tests.evaluation.test_closed_forms import ABSORBED, STORED, branches


def test_figures_are_those_of_all_samples() -> None:
    """By the points of a static run: the ellipse tells what they cost, not its kind."""
    record = make_record(*Ellipse().columns(0.02, 4000.0, 3.3, noise=5e-4))
    short = condensed_for(record, "static")[0]
    assert short.averaged in (9, 10)  # 200 000 samples a cycle, less what noise moves a coarse extreme by
    assert short.time_s.size == -(-record.time_s.size // short.averaged)
    whole, less = (
        [evaluate_cycle(r, c).quantities for c in find_cycles(r) if c.steady] for r in (record, short)
    )
    assert len(whole) == len(less) == 2
    for one, two in zip(whole, less, strict=True):
        for name in ("stored_energy_J", "absorbed_energy_J", "storage_stiffness_kN_per_mm", "frequency_Hz"):
            assert getattr(two, name) == pytest.approx(getattr(one, name), rel=1e-4)
        assert two.stroke_max_mm == pytest.approx(one.stroke_max_mm, abs=2e-3)


def test_short_cycles_stay_as_they_are() -> None:
    record = make_record(*Ellipse().columns(1.0, 5000.0, 5.3))
    assert condensed_for(record, "static")[0] is record
    assert condensed_for(record, "harmonic")[0] is not record


def test_shortest_branch_keeps_its_points() -> None:
    """A fast stroke in and a slow one out: the cycle is long, its loading branch is not."""
    knots = np.cumsum([0.0, *[0.5, 14.5] * 4])
    at = np.arange(0.0, knots[-1], 1e-3)
    stroke = np.interp(at, knots, [0.0, *[40.0, 0.0] * 4])
    record = make_record(at, stroke, 3.0 * stroke)
    assert condensed_for(record, "harmonic")[0] is record


@pytest.mark.parametrize("kind", ["impact", "proof"])
def test_peak_of_a_single_event_is_not_averaged(kind: Kind) -> None:
    """Long pulses, with a force that peaks over 40 of 24 000 samples."""
    at = np.arange(72_000) / 60_000.0
    pulse = np.maximum(np.sin(2.0 * np.pi * 2.5 * at), 0.0)
    peak = np.exp(-((((at - 0.1 + 0.2) % 0.4 - 0.2) / 3e-4) ** 2))
    record = make_record(at, 80.0 * pulse, 300.0 * pulse + 900.0 * peak)
    assert condensed_for(record, "harmonic")[0] is not record
    assert evaluate_run(record, RunFacts("one", kind), Options(draws=1)).record is record


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 5e-4])
@pytest.mark.parametrize("rate_Hz", [400.0, 1000.0, 20_000.0])
def test_a_sine_keeps_the_fewest_points(rate_Hz: float, noise: float) -> None:
    """And has all its figures, whatever the force does over it: an ellipse, and polynomial branches."""
    ellipse = Ellipse()
    cases = (
        (ellipse.columns(1.0, rate_Hz, 20.3, noise=noise), ellipse.stored, ellipse.absorbed, 4.0),
        (branches(1.0, rate_Hz, 20.4, noise, 1), STORED, ABSORBED, None),
    )
    for columns, stored, absorbed, storage in cases:
        run = evaluate_run(make_record(*columns), RunFacts("one", "harmonic"), Options(draws=1))
        assert 120 <= rate_Hz / run.record.averaged <= 170
        assert len(run.summary.cycles_used) == 19
        figures = {name: measured.value for name, measured in run.summary.values.items()}
        close = {"rel": 2e-6 if noise == 0.0 else 4e-4}
        assert figures["stored_energy_J"] == pytest.approx(stored, **close)
        assert figures["absorbed_energy_J"] == pytest.approx(absorbed, **close)
        assert figures["damping"] == pytest.approx(absorbed / stored, **close)
        assert figures["loss_stiffness_kN_per_mm"] == pytest.approx(
            absorbed / np.pi / 400.0, rel=max(1e-5, close["rel"])
        )
        if storage is not None:
            assert figures["storage_stiffness_kN_per_mm"] == pytest.approx(storage, **close)
        assert figures["tangent_stiffness_kN_per_mm"] == pytest.approx(4.0, rel=2e-3)
        assert figures["amplitude_mm"] == pytest.approx(20.0, **close)
        assert figures["frequency_Hz"] == pytest.approx(1.0, **close)
        assert figures["speed_loading_max_mm_per_s"] == pytest.approx(40.0 * np.pi, rel=2e-3 + 20.0 * noise)


@pytest.mark.parametrize(("cycles", "averaged"), [(30, 4), (12, 1)])
def test_a_ramp_does_not_keep_a_long_run_from_being_one_of_sines(cycles: int, averaged: int) -> None:
    """A ramp from rest leads to the cycles and away from them. A short run is looked at whole."""
    time, stroke, force = Ellipse().columns(1.0, 1000.0, cycles)
    low = float(np.min(stroke))
    share = np.clip(np.minimum(time, time[-1] - time) / 0.6, 0.0, 1.0)
    run = evaluate_run(
        make_record(time, low + share * (stroke - low), share * force),
        RunFacts("one", "harmonic"),
        Options(draws=1),
    )
    assert run.record.averaged == averaged
    assert run.summary.values["stored_energy_J"].value == pytest.approx(Ellipse().stored, rel=1e-4)


def test_another_harmonic_run_keeps_more() -> None:
    """A triangle has corners, and samples that are held would beat with small blocks."""
    time, stroke, force = Ellipse().columns(1.0, 3000.0, 8.3)
    triangle = 50.0 + 40.0 / np.pi * np.arcsin(np.clip((stroke - 50.0) / 20.0, -1.0, 1.0))
    held = np.repeat(stroke[::10], 10)[: stroke.size]
    for other in (triangle, held):
        run = evaluate_run(make_record(time, other, force), RunFacts("one", "harmonic"), Options(draws=1))
        assert run.record.averaged in (2, 3)


def test_blocks_end_at_a_break() -> None:
    time, stroke, force = Ellipse().columns(0.1, 4000.0, 5.3)
    kept = np.delete(np.arange(time.size), slice(50_003, 50_777))
    record = make_record(time[kept], stroke[kept], force[kept])
    short = condensed_for(record, "harmonic")[0]
    (at,) = short.breaks
    gap = (time[50_002], time[50_777])
    assert short.time_s[at - 1] <= gap[0]
    assert short.time_s[at] >= gap[1]
    assert np.max(np.delete(np.diff(short.time_s), at - 1)) < 1.01 * short.averaged / 4000.0
    assert short.defects == record.defects
    assert not any(c.complete for c in find_cycles(short) if c.start_s < gap[0] < c.end_s)


@pytest.mark.slow
@pytest.mark.parametrize("per_cycle", [20, 300, 5000, 90_000])
@pytest.mark.parametrize("noise", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("ripple_mm", [0.0, 1.5])
def test_reversals_by_blocks_are_those_of_all_samples(
    monkeypatch: pytest.MonkeyPatch, per_cycle: int, noise: float, ripple_mm: float
) -> None:
    """Also of a burst that is hidden inside single blocks of a slow record, and of ripple on steep flanks."""
    random = np.random.default_rng(1)
    at = np.arange(300_000)
    stroke = 50.0 + 20.0 * np.sin(2.0 * np.pi * at / per_cycle)
    stroke[150_000:150_400] += 9.0 * np.sin(2.0 * np.pi * np.arange(400) / 40.0)
    stroke += ripple_mm * np.sin(2.0 * np.pi * at / 30.7)
    stroke += noise * random.standard_normal(at.size)
    sampling = sampling_of(stroke)
    by_blocks = find_reversals(stroke, sampling)
    monkeypatch.setattr(reversals, "_LONG", at.size)
    np.testing.assert_array_equal(by_blocks, find_reversals(stroke, sampling))
