"""Hum in the rests of a static test: its frequency and amplitude, and no hum where there is none."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.uncertainty.hum_at_rests import lines_at_rests
from tests.evaluation.signals import Floats

STEP_S = 0.0424
RESTS_S = ((0.0, 14.0), (25.0, 45.0), (58.0, 90.0))
NOISE_KN = 0.04


def _cycles() -> list[Any]:
    turns = [SimpleNamespace(time_s=a, leave_s=b, dwell_s=b - a) for a, b in RESTS_S]
    return [SimpleNamespace(start=a, end=b) for a, b in pairwise(turns)]


def _columns(seed: int, amplitude_kN: float = 0.0, frequency_Hz: float = 2.79) -> tuple[Floats, Floats]:
    """Return time and force: relaxing rests, steep ramps between them, noise and one wave."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 90.0, STEP_S)
    force = np.zeros(time.size)
    for start_s, end_s in RESTS_S:
        on = (time >= start_s) & (time <= end_s)
        force[on] = 3.0 * np.exp(-(time[on] - start_s) / 5.0)
    for (_, before_s), (after_s, _) in pairwise(RESTS_S):
        on = (time > before_s) & (time < after_s)
        force[on] = 400.0 * (1.0 - np.abs(2.0 * (time[on] - before_s) / (after_s - before_s) - 1.0))
    wave = amplitude_kN * np.cos(2.0 * np.pi * frequency_Hz * time + random.uniform(0.0, 6.0))
    return time, force + NOISE_KN * random.standard_normal(time.size) + wave


@pytest.mark.parametrize("amplitude_kN", [0.1, 1.5])
@pytest.mark.parametrize("frequency_Hz", [1.31, 2.79, 8.0])
def test_a_wave_is_found_with_its_amplitude(amplitude_kN: float, frequency_Hz: float) -> None:
    found = lines_at_rests(*_columns(1, amplitude_kN, frequency_Hz), _cycles(), STEP_S)
    assert [line.frequency_Hz for line in found] == [pytest.approx(frequency_Hz, abs=0.03)]
    assert found[0].amplitude == pytest.approx(amplitude_kN, rel=0.1)


def test_noise_and_relaxation_are_no_hum() -> None:
    found = [lines_at_rests(*_columns(seed), _cycles(), STEP_S) for seed in range(200)]
    assert [lines for lines in found if lines] == []


def test_slow_noise_that_rises_to_low_frequencies_is_no_hum() -> None:
    found = []
    for seed in range(50):
        time, force = _columns(seed)
        random = np.random.default_rng(1000 + seed)
        walk = 0.02 * np.cumsum(random.standard_normal(time.size))
        found.append(lines_at_rests(time, force + walk, _cycles(), STEP_S))
    assert [lines for lines in found if lines] == []


def test_a_run_without_rests_shows_none() -> None:
    time, force = _columns(1, 1.5)
    brief = [SimpleNamespace(time_s=t, leave_s=t, dwell_s=0.0) for t in (0.0, 30.0)]
    assert lines_at_rests(time, force, [SimpleNamespace(start=brief[0], end=brief[1])], STEP_S) == ()  # type: ignore[list-item]
