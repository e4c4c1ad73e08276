"""The force at a turning point: each branch's own, whatever the other one does behind the turn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.loading.load import load_run
from bufferstand.evaluation.loops.cut import cut_loop
from bufferstand.evaluation.quantities.evaluate import evaluate_cycle
from bufferstand.evaluation.quantities.loop_readings import absorbed_energy_J, stored_energy_J
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import Floats

SAMPLES = Path(__file__).resolve().parents[3] / "sample_runs" / "runs"


def triangles(samples: int, phase: float, lost: float) -> Record:
    """Return four triangles to 100 mm, loading 4 kN/mm; unloading has a share of it less at once."""
    along = (np.arange(8 * samples + 1) + phase) / samples
    stroke = 100.0 * np.abs(along - 2.0 * np.round(0.5 * along))
    rising = np.floor(along) % 2 == 0
    force = np.where(rising, 4.0, 4.0 * (1.0 - lost)) * stroke
    return make_record(0.01 * np.arange(along.size), stroke, force)


@pytest.mark.parametrize("lost", [0.0, 0.1, 0.6])
@pytest.mark.parametrize("samples", [25, 200, 2000])
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.8])
def test_a_jump_at_the_turn_belongs_to_neither_branch(samples: int, phase: float, lost: float) -> None:
    record = triangles(samples, phase, lost)
    cycle = find_cycles(record)[1]
    figures = evaluate_cycle(record, cycle).quantities
    loop = cut_loop(record, cycle)
    assert loop.force_kN[loop.top] == pytest.approx(400.0, rel=1e-6)
    assert loop.force_kN[loop.unload] == pytest.approx(400.0 * (1.0 - lost), rel=1e-6)
    assert figures.force_max_kN == pytest.approx(400.0, rel=1e-6)
    assert figures.secant_stiffness_kN_per_mm == pytest.approx(4.0, rel=1e-6)
    assert stored_energy_J(loop) == pytest.approx(20000.0, rel=1e-6)
    assert absorbed_energy_J(loop) == pytest.approx(20000.0 * lost, rel=1e-6, abs=1e-2)


def steep(samples: int, length_mm: float) -> tuple[Record, float]:
    """Return triangles whose unloading force falls by half within some ``length_mm``, and its area."""
    along = (np.arange(8 * samples + 1) + 0.37) / samples
    stroke = 100.0 * np.abs(along - 2.0 * np.round(0.5 * along))
    rising = np.floor(along) % 2 == 0
    lost = 0.5 * (1.0 - np.exp(-(100.0 - stroke) / length_mm))
    force = 100.0 + 4.0 * stroke
    x = np.linspace(0.0, 100.0, 200_001)
    area = float(np.trapezoid((100.0 + 4.0 * x) * 0.5 * (1.0 - np.exp(-(100.0 - x) / length_mm)), x))
    return make_record(0.01 * np.arange(along.size), stroke, force * np.where(rising, 1.0, 1.0 - lost)), area


@pytest.mark.parametrize("length_mm", [1.0, 5.0, 30.0])
def test_a_steep_flank_is_no_jump(length_mm: float) -> None:
    """The force is one at the turn, however fast it falls behind it: the loading branch keeps its own."""
    record, area = steep(1000, length_mm)
    cycle = find_cycles(record)[1]
    loop = cut_loop(record, cycle)
    assert loop.top == loop.unload
    assert loop.force_kN[loop.top] == pytest.approx(500.0, rel=1e-5)
    assert absorbed_energy_J(loop) == pytest.approx(area, rel=2e-4)


def test_a_smooth_turn_keeps_its_closed_form() -> None:
    """The force of an ellipse is linear in stroke and speed: at both turns it is F_m ± K′ x_a."""
    time = np.arange(0.0, 4.0, 0.002)
    angle = 2.0 * np.pi * time + 0.3
    stroke, force = 50.0 + 20.0 * np.sin(angle), 100.0 + 80.0 * np.sin(angle) + 30.0 * np.cos(angle)
    record = make_record(time, stroke, force)
    figures = evaluate_cycle(record, find_cycles(record)[1]).quantities
    assert figures.secant_stiffness_kN_per_mm == pytest.approx(4.0, rel=1e-5)
    assert figures.force_max_kN == pytest.approx(100.0 + float(np.hypot(80.0, 30.0)), rel=1e-5)
    assert figures.force_min_kN == pytest.approx(100.0 - float(np.hypot(80.0, 30.0)), rel=1e-3)


def test_noise_of_a_reading_is_what_it_says() -> None:
    """The stated gain of noise against the scatter of 200 readings."""
    time = np.arange(0.0, 6.0, 0.01)
    clean: Floats = 50.0 * (1.0 - np.cos(np.pi * time))
    read, gains = [], []
    for seed in range(200):
        noise = np.random.default_rng(seed).standard_normal(time.size)
        record = make_record(time, clean, 3.0 * clean + 10.0 * np.sin(np.pi * time) + noise)
        loop = cut_loop(record, find_cycles(record)[1])
        read.append(loop.force_kN[loop.top])
        gains.append(loop.ends[1].gain)
    assert np.std(read) == pytest.approx(float(np.sqrt(np.mean(np.square(gains)))), rel=0.2)
    assert np.mean(read) == pytest.approx(300.0, abs=0.3)


@pytest.mark.parametrize("noise_kN", [pytest.param(0.05, marks=pytest.mark.long), 1.0])
def test_what_the_speed_does_stays_within_u(noise_kN: float) -> None:
    """Noise that hides the loss of an ellipse near its turn makes U wider, not the force wrong."""
    time = np.arange(0.0, 6.0, 0.01)
    stroke: Floats = 50.0 * (1.0 - np.cos(np.pi * time))
    away = []
    for seed in range(200):
        noise = noise_kN * np.random.default_rng(seed).standard_normal(time.size)
        record = make_record(time, stroke, 3.0 * stroke + 10.0 * np.sin(np.pi * time) + noise)
        loop = cut_loop(record, find_cycles(record)[1])
        u_kN = np.hypot(loop.ends[1].gain * noise_kN, loop.ends[1].doubt_kN)
        away.append((loop.force_kN[loop.top] - 300.0) / u_kN)
    assert abs(float(np.mean(away))) < 0.5
    assert np.mean(np.abs(away) < 2.0) > 0.92


def free_travel(noise_kN: float, seed: int) -> Record:
    """Return two strokes from 3 mm before contact, where a preload of 35 kN makes the force jump."""
    time = np.arange(0.0, 24.0, 0.02)
    stroke = np.interp(np.mod(time, 12.0), [0.0, 1.0, 6.0, 11.0, 12.0], [-3.0, -3.0, 97.0, -3.0, -3.0])
    rising = np.mod(time, 12.0) < 6.0
    force = np.where(stroke > 0.0, 35.0 + 4.0 * stroke, 0.0) * np.where(rising, 1.0, 0.6)
    scatter = noise_kN * np.random.default_rng(seed).standard_normal(time.size)
    return make_record(time, stroke, force + scatter)


@pytest.mark.parametrize("noise_kN", [0.0, 0.05, 0.5])
def test_without_contact_there_is_no_force(noise_kN: float) -> None:
    """Neither the largest of many noises counts, nor what a parabola rings beside the jump of the preload."""
    for seed in range(5):
        record = free_travel(noise_kN, seed)
        figures = evaluate_cycle(record, find_cycles(record)[0]).quantities
        assert figures.force_min_kN is not None
        assert abs(figures.force_min_kN) <= 1.2 * noise_kN + 1e-9
        assert figures.secant_stiffness_kN_per_mm == pytest.approx((35.0 + 4.0 * 97.0) / 100.0, rel=6e-3)


def test_an_extreme_between_the_turns_is_found() -> None:
    """A damper is strongest where it is fastest: a cosine's top is level over many samples."""
    time = np.arange(0.0, 4.0, 0.005)
    angle = 2.0 * np.pi * time + 0.3
    found = []
    for seed in range(20):
        noise = 0.5 * np.random.default_rng(seed).standard_normal(time.size)
        record = make_record(time, 20.0 * np.sin(angle), 100.0 * np.cos(angle) + noise)
        figures = evaluate_cycle(record, find_cycles(record)[1]).quantities
        found.append((figures.force_min_kN, figures.force_max_kN))
    assert np.mean(found, axis=0) == pytest.approx([-100.0, 100.0], abs=0.3)


def test_the_shipped_static_run_reaches_no_force_that_no_sample_has() -> None:
    """The mean of both branches made 602.9 kN of it, above every sample."""
    record, facts = load_run(SAMPLES / "001-static-5mm_s.h5")
    run = evaluate_run(record, facts, Options(draws=300))
    highest = float(np.max(record.force_kN))
    for result in run.cycles:
        if result.cycle.complete:
            found, expanded = result.quantities.force_max_kN, result.expanded_uncertainty["force_max_kN"]
            assert found is not None
            assert expanded is not None
            assert found <= highest + expanded
            assert found == pytest.approx(highest, rel=2e-3)
