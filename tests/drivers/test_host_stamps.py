from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.host_stamps import JUMP_S, HostStamps


@settings(max_examples=12)
@given(
    seed=st.integers(0, 1000),
    rate_Hz=st.sampled_from([10.0, 250.0, 768.0]),
    oscillator=st.floats(-5e-4, 5e-4),
    worst_delay_s=st.floats(0.0, 0.03),
)
def test_jitter_of_reception_does_not_reach_the_stamps(
    seed: int, rate_Hz: float, oscillator: float, worst_delay_s: float
) -> None:
    rng = np.random.default_rng(seed)
    stamps = HostStamps(rate_Hz)
    true_period_s = (1.0 + oscillator) / rate_Hz
    samples, errors, last_us = 0, [], 0
    for _ in range(300):
        n = int(rng.integers(1, 6))
        samples += n
        true_s = samples * true_period_s
        received_s = true_s + rng.uniform(0.0, worst_delay_s) * rng.uniform() ** 3
        time_us = stamps.stamp(n, received_s)
        assert time_us.shape == (n,)
        assert time_us[0] > last_us
        assert np.all(np.diff(time_us) > 0)
        last_us = int(time_us[-1])
        errors.append(last_us * 1e-6 - true_s)
    settled = np.array(errors[150:])
    assert settled.min() > -1e-5  # never earlier than it can have been
    assert settled.max() <= worst_delay_s + 1e-5
    if rate_Hz == 250.0 and worst_delay_s > 0.01:
        assert np.median(settled) < 0.4 * worst_delay_s  # hugs the early receptions


def test_even_receptions_give_even_stamps() -> None:
    stamps = HostStamps(250.0)
    time_us = np.concatenate([stamps.stamp(1, 10.0 + 0.004 * i) for i in range(100)])
    np.testing.assert_array_equal(time_us, 10_000_000 + 4000 * np.arange(100))


def test_a_block_reaches_back_from_its_reception() -> None:
    np.testing.assert_array_equal(HostStamps(100.0).stamp(3, 5.0), [4_980_000, 4_990_000, 5_000_000])


def test_lost_samples_keep_their_time() -> None:
    stamps = HostStamps(100.0)
    stamps.stamp(1, 1.0)
    assert stamps.stamp(1, 1.06, lost=5)[0] == 1_060_000


def test_a_pause_is_seen_as_one() -> None:
    stamps = HostStamps(100.0)
    stamps.stamp(1, 1.0)
    assert stamps.stamp(1, 3.0 + JUMP_S)[0] == pytest.approx((3.0 + JUMP_S) * 1e6)


def test_stamps_rise_even_if_reception_outruns_them() -> None:
    stamps = HostStamps(100.0)
    first = stamps.stamp(3, 1.0)
    second = stamps.stamp(5, 1.001)
    assert second[0] > first[-1]
    assert np.all(np.diff(second) > 0)
