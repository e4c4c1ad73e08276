"""The valve, the servo's lag and the noise of a stand that is not perfect, each against its closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.simulated.imperfections.coloured_noise import (
    MAINS_HZ,
    TIME_CONSTANTS_S,
    ColouredNoise,
)
from bufferstand.drivers.simulated.machine.physics import Actuator, ActuatorFacts

DT_S = 1e-3
CURVE = ((0.0, 800.0), (400.0, 560.0), (630.0, 0.0))
FAST = ActuatorFacts(bandwidth_Hz=100.0)


def first_harmonic(facts: ActuatorFacts, frequency_Hz: float) -> complex:
    """Return the piston's answer to a sine of 1 mm: amplitude ratio and phase as one complex number."""
    actuator = Actuator(facts, DT_S)
    samples = round(20.0 / frequency_Hz / DT_S)
    phase = 2.0 * np.pi * frequency_Hz * DT_S * np.arange(1, samples + 1)
    position = np.array([actuator.follow(math.sin(angle)) for angle in phase])
    last = slice(samples // 2, samples)  # ten whole periods, settled
    return complex(2.0 * np.mean(position[last] * np.exp(-1j * phase[last])) * 1j)


@pytest.mark.parametrize("frequency_Hz", [0.5, 1.25, 2.5])
def test_a_servo_lag_costs_amplitude_and_phase_as_a_first_order_does(frequency_Hz: float) -> None:
    lag_s = 0.01
    with_lag = first_harmonic(ActuatorFacts(servo_lag_s=lag_s), frequency_Hz)
    ratio = with_lag / first_harmonic(ActuatorFacts(), frequency_Hz)
    expected = 1.0 / (1.0 + 2j * np.pi * frequency_Hz * lag_s)
    assert abs(ratio) == pytest.approx(abs(expected), rel=1e-3)
    assert np.angle(ratio) == pytest.approx(np.angle(expected), abs=2.0 * np.pi * frequency_Hz * DT_S)


def test_an_even_motion_is_followed_later_by_the_lag() -> None:
    speed, lag_s = 100.0, 0.02
    behind = []
    for facts in (ActuatorFacts(), ActuatorFacts(servo_lag_s=lag_s)):
        actuator = Actuator(facts, DT_S)
        for sample in range(1, 1001):
            actuator.follow(speed * sample * DT_S)
        behind.append(speed - actuator.position_mm)
    assert behind[1] - behind[0] == pytest.approx(speed * lag_s, rel=0.03)


@pytest.mark.parametrize("reversal_s", [0.0, 0.02, 0.06])
def test_at_a_reversal_the_piston_stands_for_so_long(reversal_s: float) -> None:
    actuator = Actuator(ActuatorFacts(bandwidth_Hz=100.0, reversal_s=reversal_s), DT_S)
    up = [actuator.follow(0.1 * sample) for sample in range(1, 501)]
    down = [actuator.follow(0.1 * (500 - sample)) for sample in range(1, 501)]
    moves = np.diff(np.array(up + down))
    assert np.count_nonzero(moves[100:] == 0.0) == round(reversal_s / DT_S)
    assert np.all(np.diff(np.sign(moves[moves != 0.0])) <= 0.0)  # up, then down, once
    for _ in range(2000):
        actuator.follow(0.0)
    assert actuator.rests_at(0.0)


@pytest.mark.parametrize(("force_kN", "speed"), [(0.0, 800.0), (200.0, 680.0), (515.0, 280.0), (700.0, 0.0)])
def test_against_a_force_it_goes_as_fast_as_the_curve_says_and_back_at_full_speed(
    force_kN: float, speed: float
) -> None:
    actuator = Actuator(ActuatorFacts(bandwidth_Hz=100.0, force_speed=CURVE), DT_S)
    for _ in range(100):
        actuator.follow(500.0, force_kN)
    before = actuator.position_mm
    assert actuator.follow(500.0, force_kN) - before == pytest.approx(speed * DT_S, abs=1e-9)
    back = Actuator(ActuatorFacts(bandwidth_Hz=100.0, force_speed=CURVE), DT_S)
    for _ in range(100):
        back.follow(-500.0, force_kN)
    before = back.position_mm
    assert before - back.follow(-500.0, force_kN) == pytest.approx(0.8)


@given(
    commands=st.lists(st.floats(-50.0, 150.0), min_size=1, max_size=60),
    force_kN=st.floats(0.0, 700.0),
    lag_s=st.sampled_from([0.0, 0.01]),
    reversal_s=st.sampled_from([0.0, 0.02]),
)
def test_it_is_never_faster_than_its_valve_and_comes_to_rest(
    commands: list[float], force_kN: float, lag_s: float, reversal_s: float
) -> None:
    actuator = Actuator(ActuatorFacts(servo_lag_s=lag_s, reversal_s=reversal_s, force_speed=CURVE), DT_S)
    most = np.interp(force_kN, *zip(*CURVE, strict=True)) * DT_S
    for command in commands:
        for _ in range(20):
            before = actuator.position_mm
            move = actuator.follow(command, force_kN) - before
            assert -0.8 - 1e-9 <= move <= most + 1e-9
    for _ in range(6000):
        actuator.follow(0.0, 0.0)
    assert actuator.rests_at(0.0)


def test_without_imperfections_it_is_the_clean_actuator() -> None:
    clean, stated = Actuator(FAST, DT_S), Actuator(ActuatorFacts(100.0, 0.8, 800.0, 0.02, 0.0, 0.0, ()), DT_S)
    for sample in range(1000):
        command = 10.0 * math.sin(sample * 0.01)
        assert clean.follow(command) == stated.follow(command, 300.0)


def wander(seed: int = 3, flicker: float = 0.5, hum: float = 0.0) -> ColouredNoise:
    return ColouredNoise((flicker, 0.0), (0.0, hum), DT_S, np.random.SeedSequence(seed))


@given(cuts=st.lists(st.integers(1, 300), max_size=12))
def test_slices_of_any_length_wander_alike(cuts: list[int]) -> None:
    time_s = DT_S * np.arange(1, 1001)
    whole, cut = np.zeros((1000, 2)), np.zeros((1000, 2))
    wander(hum=0.1).add(time_s, whole)
    one, first = wander(hum=0.1), 0
    for length in (*cuts, 1000):
        if first < 1000:  # the device publishes no empty slice
            one.add(time_s[first : first + length], cut[first : first + length])
        first += length
    np.testing.assert_array_equal(whole, cut)


def test_flicker_has_the_stated_deviation_and_falls_as_one_over_f() -> None:
    """Beside the sum of Lorentz spectra: S(f) = Σ (σ²/3) 4 τ / (1 + (2π f τ)²), one-sided."""
    samples, sigma = 1 << 21, 0.5
    values = np.zeros((samples, 2))
    wander(flicker=sigma).add(DT_S * np.arange(1, samples + 1), values)
    assert values[:, 0].std() == pytest.approx(sigma, rel=0.05)
    assert not values[:, 1].any()
    length = 1 << 15
    pieces = values[:, 0].reshape(-1, length)
    window = np.hanning(length)
    power = (
        np.mean(np.abs(np.fft.rfft(pieces * window, axis=1)) ** 2, axis=0) * 2.0 * DT_S / np.sum(window**2)
    )
    frequency = np.fft.rfftfreq(length, DT_S)
    density = []
    for low, high in ((0.1, 0.2), (0.5, 1.0), (2.0, 4.0)):
        band = (frequency >= low) & (frequency < high)
        tau = np.array(TIME_CONSTANTS_S)[:, np.newaxis]
        lorentz = np.sum(
            sigma**2 / 3.0 * 4.0 * tau / (1.0 + (2.0 * np.pi * frequency[band] * tau) ** 2), axis=0
        )
        assert power[band].mean() == pytest.approx(lorentz.mean(), rel=0.15)
        density.append(power[band].mean() * math.sqrt(low * high))
    assert max(density) < 2.0 * min(density)  # f S(f) is level: 1/f


@pytest.mark.slow
def test_the_hum_is_the_mains() -> None:
    values = np.zeros((1000, 2))
    wander(flicker=0.0, hum=0.1).add(DT_S * np.arange(1, 1001), values)
    spectrum = np.abs(np.fft.rfft(values[:, 1])) * 2.0 / 1000
    assert int(np.argmax(spectrum)) == MAINS_HZ
    assert spectrum[50] == pytest.approx(0.1, rel=1e-6)
