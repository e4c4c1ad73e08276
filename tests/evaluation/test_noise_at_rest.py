"""Slow noise of static runs: a rest between strokes shows what strokes hide."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.results import CycleResult, Quantities
from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.history import history_of
from bufferstand.evaluation.uncertainty.noise import Noise, record_noise

STEP_S = 0.01
NOISE_MM, NOISE_KN = 0.01, 1.0


def three_strokes(seed: int, memory_s: float) -> Record:
    """Return strokes to 80 mm between rests of 10 s, with noise that forgets itself in so many seconds."""
    random = np.random.default_rng(seed)
    knots = np.cumsum([0.0, 10.0, 4.0, 4.0, 10.0, 4.0, 4.0, 10.0, 4.0, 4.0, 10.0])
    time = np.arange(0.0, knots[-1], STEP_S)
    stroke = np.interp(time, knots, [0.0, 0.0, 80.0, 0.0, 0.0, 80.0, 0.0, 0.0, 80.0, 0.0, 0.0])
    kept = float(np.exp(-STEP_S / memory_s)) if memory_s else 0.0
    white = random.standard_normal((2, time.size + 1000))
    noise = lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], white, axis=1)[:, 1000:]
    return make_record(time, stroke + NOISE_MM * noise[0], 10.0 + 4.0 * stroke + NOISE_KN * noise[1])


def found_noise(record: Record) -> Noise:
    return record_noise(record, None, find_cycles(record))


def test_slow_noise_of_both_channels_shows_at_rest() -> None:
    each = [found_noise(three_strokes(seed, 0.08)) for seed in range(6)]
    forces = [noise.force.sigma for noise in each if noise.force is not None]
    strokes = [noise.stroke.sigma for noise in each if noise.stroke is not None]
    assert np.mean(forces) == pytest.approx(NOISE_KN, rel=0.12)
    assert np.mean(strokes) == pytest.approx(NOISE_MM, rel=0.12)


def test_of_white_noise_a_rest_says_nothing_new() -> None:
    noise = found_noise(three_strokes(1, 0.0))
    assert noise.force is not None
    assert noise.force.sigma == pytest.approx(NOISE_KN, rel=0.05)
    assert noise.force.frequency_Hz[0] > 4.0  # means of some samples, and no rest of 5 s


@pytest.mark.slow
def test_the_level_of_a_rest_is_no_surer_than_slow_noise_leaves_it() -> None:
    inside = []
    for seed in range(20):
        record = three_strokes(seed, 0.08)
        results = [CycleResult(cycle, Quantities()) for cycle in find_cycles(record)]
        found = history_of(record, RunFacts("s", "static"), results, (), (), found_noise(record))
        inside += [abs(r.residual_mm) <= r.expanded_uncertainty for r in found.residual_strokes]
    assert len(inside) == 60
    assert np.mean(inside) > 0.88  # 95 % less 2.5 standard deviations
