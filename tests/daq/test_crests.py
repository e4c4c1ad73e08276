"""The turns of a sine, round and flat, sampled coarsely and finely, against the motion without noise."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bufferstand.daq.strokes.turning_points import StrokeTurns, noise_of, upper_crest
from bufferstand.drivers.simulated.machine.physics import Actuator, ActuatorFacts

MEAN_MM = 40.0


def piston(
    reversal_s: float, frequency_Hz: float, amplitude_mm: float, bandwidth_Hz: float = 8.0
) -> tuple[np.ndarray, np.ndarray]:
    """The fourth cycle of a piston that stands when it turns, at 1 kHz."""
    facts = ActuatorFacts(bandwidth_Hz=bandwidth_Hz, servo_lag_s=0.003, reversal_s=reversal_s)
    actuator, period = Actuator(facts, 1e-3), round(1000.0 / frequency_Hz)
    time = np.arange(5 * period) * 1e-3
    phase = frequency_Hz * time
    command = MEAN_MM + amplitude_mm * np.minimum(phase, 1.0) * np.sin(2.0 * math.pi * phase)
    position = np.array([actuator.follow(one) for one in command.tolist()])
    return time[3 * period : 4 * period], position[3 * period : 4 * period]


@pytest.mark.slow
@pytest.mark.parametrize("reversal_s", [0.0, 0.01, 0.03, 0.05])
@pytest.mark.parametrize(
    ("frequency_Hz", "amplitude_mm"), [(2.5, 5.0), (2.5, 15.0), (1.0, 10.0), (0.5, 10.0)]
)
@pytest.mark.parametrize(("noise_mm", "within_mm", "samples"), [
    (0.0, 0.002, 400), (0.01, 0.008, 400), (0.1, 0.03, 400), (0.0, 0.04, 50), (0.1, 0.07, 50),
])  # fmt: skip
def test_turns_are_those_of_the_motion(
    reversal_s: float,
    frequency_Hz: float,
    amplitude_mm: float,
    noise_mm: float,
    within_mm: float,
    samples: int,
) -> None:
    """On an average of twelve records: no fit overreaches; of each the u covers what it is off."""
    time, true = piston(reversal_s, frequency_Hz, amplitude_mm)
    every = max(1, len(time) // samples)
    random = np.random.default_rng(3)
    means, amplitudes, u = [], [], []
    for _ in range(12):
        noisy = true + noise_mm * random.standard_normal(len(true))
        turned = StrokeTurns.of(time[::every], noisy[::every])
        assert turned is not None
        means.append(turned.sine.mean_mm)
        amplitudes.append(turned.sine.amplitude_mm)
        u.append(turned.u_mm)
    half = 0.5 * (true.max() - true.min())
    assert np.mean(amplitudes) == pytest.approx(half, abs=within_mm)
    assert np.mean(means) == pytest.approx(0.5 * (true.max() + true.min()), abs=within_mm)
    if samples == 400:
        assert np.abs(np.array(amplitudes) - half).max() < 3.5 * np.mean(u) + 0.003


def test_a_series_of_harmonics_and_the_greatest_sample_are_wrong_where_a_crest_is_not() -> None:
    """What was done before: of a flat crest a series overreaches by per cents, the greatest sample by 3 σ."""
    time, true = piston(0.05, 2.5, 10.0)
    half = 0.5 * (true.max() - true.min())
    phase = 2.0 * math.pi * 2.5 * (time - time[0])
    basis = np.stack(
        [part(k * phase) for k in range(9) for part in (np.cos, np.sin) if k or part is np.cos], 1
    )
    series = basis @ np.linalg.lstsq(basis, true, rcond=None)[0]
    assert 0.5 * (series.max() - series.min()) > 1.01 * half
    noisy = true + 0.1 * np.random.default_rng(1).standard_normal(len(true))
    assert 0.5 * (noisy.max() - noisy.min()) > half + 0.15
    turned = StrokeTurns.of(time, noisy)
    assert turned is not None
    assert turned.sine.amplitude_mm == pytest.approx(half, abs=0.03)


def test_hum_does_not_move_a_turn_by_more_than_itself() -> None:
    time, true = piston(0.03, 1.0, 10.0)
    turned = StrokeTurns.of(time, true + 0.01 * np.sin(2.0 * math.pi * 50.0 * time))
    assert turned is not None
    assert turned.sine.amplitude_mm == pytest.approx(0.5 * (true.max() - true.min()), abs=0.01)


def test_a_crest_that_is_not_whole_is_none() -> None:
    phase = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False)
    assert upper_crest(phase, np.sin(phase)) is not None
    assert upper_crest(phase, np.cos(phase)) is None, "its top is at the ends"
    assert upper_crest(phase[:10], np.sin(phase[:10])) is None


def test_noise_is_told_from_motion() -> None:
    phase = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False)
    noisy = 10.0 * np.sin(phase) + 0.02 * np.random.default_rng(2).standard_normal(400)
    assert noise_of(noisy) == pytest.approx(0.02, rel=0.15)
    assert noise_of(10.0 * np.sin(phase)) < 1e-4


def test_the_force_at_a_turn_is_that_with_which_it_is_reached() -> None:
    """A specimen with friction: 20 kN are gone as soon as the stroke goes back; 0.2 kN of noise."""
    time, stroke = piston(0.03, 1.0, 10.0)
    rising = np.gradient(stroke, time) > 1e-6
    standing = np.abs(np.gradient(stroke, time)) <= 1e-6
    friction = np.where(rising, 10.0, -10.0)
    for at in np.flatnonzero(standing):
        friction[at] = friction[at - 1]
    force = 5.0 * stroke + friction + 0.2 * np.random.default_rng(4).standard_normal(len(time))
    turned = StrokeTurns.of(time, stroke)
    assert turned is not None
    lower_kN, upper_kN = turned.forces(time, stroke, force)
    assert upper_kN == pytest.approx(5.0 * stroke.max() + 10.0, abs=0.3)
    assert lower_kN == pytest.approx(5.0 * stroke.min() - 10.0, abs=0.3)
