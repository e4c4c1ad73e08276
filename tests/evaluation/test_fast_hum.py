"""Noise by which fits are judged, where a wave is nearly as fast as the samples show."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.numerics.reversals import noise_sigma, without_fast_hum
from bufferstand.evaluation.uncertainty.noise import white


def test_white_noise_is_what_differences_say() -> None:
    for seed in range(300):
        values = np.random.default_rng(seed).standard_normal(1000)
        sigma = noise_sigma(values)
        assert without_fast_hum(values, sigma) == sigma


@pytest.mark.parametrize("samples_a_wave", [2.2, 2.4, 2.7])
def test_of_a_fast_wave_differences_see_too_much(samples_a_wave: float) -> None:
    random = np.random.default_rng(1)
    wave = np.sin(2.0 * np.pi * np.arange(4000) / samples_a_wave)
    values = wave + 0.5 * random.standard_normal(4000)
    sigma = noise_sigma(values)
    assert sigma > 1.3 * np.std(values)
    assert 0.3 < without_fast_hum(values, sigma) < np.std(values)


def test_the_summit_of_a_parabola_sees_waves_that_a_mean_does_not() -> None:
    noise = white(1.0, 0.01)
    assert noise.summit_variance(50.0) == pytest.approx(2.25 / 50.0, rel=0.01)
    assert noise.mean_variance(50.0) == pytest.approx(1.0 / 50.0, rel=0.01)


@pytest.mark.parametrize("size", [0, 1, 2, 9, 11, 31])
def test_of_a_handful_of_samples_nothing_is_told(size: int) -> None:
    """An imperfect record of 11 rows ended in a fault."""
    assert without_fast_hum(np.random.default_rng(1).standard_normal(size), 0.1) == 0.1
