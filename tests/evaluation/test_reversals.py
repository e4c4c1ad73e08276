"""Noise, converter steps and ringing are no reversals; motion is."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.numerics.reversals import (
    Sampling,
    find_reversals,
    held_samples,
    noise_sigma,
    sampling_of,
)

RANDOM = np.random.default_rng(5)
TIME = np.arange(0.0, 10.0, 0.001)
STILL = Sampling(held=1, step=0.0, sigma=0.0)
SINE = 50.0 + 20.0 * np.sin(2.0 * np.pi * 0.5 * TIME)


@pytest.mark.parametrize("sigma", [0.001, 0.02, 0.2])
def test_noise_is_estimated(sigma: float) -> None:
    noisy = SINE + sigma * RANDOM.standard_normal(TIME.size)
    assert noise_sigma(noisy) == pytest.approx(sigma, rel=0.1)


def test_noise_of_a_clean_signal_is_nothing() -> None:
    assert noise_sigma(SINE) < 1e-9


def test_quantum_of_a_converter() -> None:
    assert sampling_of(np.round(SINE / 0.1) * 0.1).step == pytest.approx(0.1)


def test_rest_is_no_quantum() -> None:
    rests = np.concatenate((np.zeros(500), np.arange(100.0), np.full(500, 99.0)))
    assert sampling_of(rests).step == 0.0
    assert sampling_of(SINE).step == 0.0


def test_held_samples_count_once() -> None:
    held = np.repeat(SINE + 0.02 * RANDOM.standard_normal(SINE.size), 4)
    assert sampling_of(held).held == held_samples(held) == 4
    assert sampling_of(held).sigma == pytest.approx(0.02, rel=0.1)
    assert sampling_of(SINE).held == held_samples(SINE) == 1


@pytest.mark.parametrize("share", [0.06, 0.16, 0.5])
def test_a_channel_that_stands_still_for_a_while_has_its_noise(share: float) -> None:
    noisy = SINE + 0.1 * RANDOM.standard_normal(TIME.size)
    noisy[3000 : 3000 + round(share * TIME.size)] = noisy[3000]
    assert sampling_of(noisy).sigma == pytest.approx(0.1, rel=0.25)
    clean = SINE.copy()
    clean[3000:4600] = clean[3000]
    assert sampling_of(clean).sigma < 1e-9


@pytest.mark.parametrize("samples", [0, 1, 2, 15])
def test_too_few_samples_tell_nothing(samples: int) -> None:
    assert sampling_of(SINE[:samples]) == Sampling(held=1, step=0.0, sigma=0.0)


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
def test_every_turn_once(noise: float) -> None:
    stroke = SINE + noise * RANDOM.standard_normal(TIME.size)
    turns = find_reversals(stroke)
    np.testing.assert_allclose(TIME[turns[1:-1]], np.arange(0.5, 10.0, 1.0), atol=0.1)


def test_alternation() -> None:
    stroke = np.cumsum(RANDOM.standard_normal(5000))
    turns = find_reversals(stroke, STILL)
    direction = np.sign(np.diff(stroke[turns]))
    assert np.all(direction[1:] == -direction[:-1])


def test_ringing_is_not_a_cycle() -> None:
    ringing = 0.5 * np.exp(-TIME) * np.sin(2.0 * np.pi * 8.0 * TIME)
    stroke = np.concatenate((SINE, SINE[-1] + ringing))
    assert find_reversals(stroke, STILL).size <= find_reversals(SINE, STILL).size + 1


def test_quantised_noise_ends() -> None:
    steps = np.round(RANDOM.standard_normal(50_000)) * 0.01
    assert find_reversals(steps).size <= 2
    assert find_reversals(np.zeros(100), STILL).size == 1
