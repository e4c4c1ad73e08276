"""Noise, converter steps and ringing are no reversals; motion is."""

from __future__ import annotations

import numpy as np
import pytest

from evaluation.reversals import find_reversals, noise_sigma, quantum

RANDOM = np.random.default_rng(5)
TIME = np.arange(0.0, 10.0, 0.001)
SINE = 50.0 + 20.0 * np.sin(2.0 * np.pi * 0.5 * TIME)


@pytest.mark.parametrize("sigma", [0.001, 0.02, 0.2])
def test_noise_is_estimated(sigma: float) -> None:
    noisy = SINE + sigma * RANDOM.standard_normal(TIME.size)
    assert noise_sigma(noisy) == pytest.approx(sigma, rel=0.1)


def test_noise_of_a_clean_signal_is_nothing() -> None:
    assert noise_sigma(SINE) < 1e-9


def test_quantum_of_a_converter() -> None:
    assert quantum(np.round(SINE / 0.1) * 0.1) == pytest.approx(0.1)


def test_rest_is_no_quantum() -> None:
    assert quantum(np.concatenate((np.zeros(500), np.arange(100.0), np.full(500, 99.0)))) == 0.0
    assert quantum(SINE) == 0.0


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
def test_every_turn_once(noise: float) -> None:
    stroke = SINE + noise * RANDOM.standard_normal(TIME.size)
    turns = find_reversals(stroke, noise_sigma(stroke))
    np.testing.assert_allclose(TIME[turns[1:-1]], np.arange(0.5, 10.0, 1.0), atol=0.1)


def test_alternation() -> None:
    stroke = np.cumsum(RANDOM.standard_normal(5000))
    turns = find_reversals(stroke, 0.0)
    direction = np.sign(np.diff(stroke[turns]))
    assert np.all(direction[1:] == -direction[:-1])


def test_ringing_is_not_a_cycle() -> None:
    ringing = 0.5 * np.exp(-TIME) * np.sin(2.0 * np.pi * 8.0 * TIME)
    stroke = np.concatenate((SINE, SINE[-1] + ringing))
    assert find_reversals(stroke, 0.0).size <= find_reversals(SINE, 0.0).size + 1


def test_quantised_noise_ends() -> None:
    steps = np.round(RANDOM.standard_normal(50_000)) * 0.01
    assert find_reversals(steps, noise_sigma(steps)).size <= 2
    assert find_reversals(np.zeros(100), 0.0).size == 1
