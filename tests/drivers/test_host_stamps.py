from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.drivers.amplifiers.host_stamps import (
    JUMP_S,
    RATE_DOUBT,
    RATE_WINDOW_S,
    HostStamps,
    RateWatch,
)


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


def watched(
    watch: RateWatch, rate_Hz: float, duration_s: float, *, begin_s: float = 0.0, speed: float = 1.0
) -> list[str]:
    """Let values come ten times a second of stand time; return what is said."""
    said: list[str] = []
    for number in range(round(10 * duration_s) + 1):
        at_s = begin_s + 0.1 * number
        text = watch.look(round(0.1 * rate_Hz), at_s, at_s / speed)
        said += [text] if text else []
    return said


@given(share=st.floats(0.2, 3.0))
def test_a_rate_is_doubted_beyond_its_tolerance_and_only_then(share: float) -> None:
    asked_Hz = 1000.0
    come_Hz = 10.0 * round(0.1 * asked_Hz * share)
    said = watched(RateWatch(asked_Hz), come_Hz, 3 * RATE_WINDOW_S)
    off = abs(come_Hz / asked_Hz - 1.0)
    if off > RATE_DOUBT + 0.02:
        assert len(said) == 1  # once while it stays so
    elif off < RATE_DOUBT - 0.02:
        assert said == []


def test_the_message_names_both_rates_and_where_to_look() -> None:
    (text,) = watched(RateWatch(250.0), 500.0, 12.0)
    assert text.startswith("500 values a second come in instead of 250; look at its data rate and filter")


def test_a_rate_that_is_right_again_and_wrong_again_is_told_again() -> None:
    watch = RateWatch(250.0)
    assert len(watched(watch, 500.0, 25.0)) == 1
    assert watched(watch, 250.0, 30.0, begin_s=25.1) == []
    assert len(watched(watch, 120.0, 25.0, begin_s=55.2)) == 1


def test_known_losses_count_as_values_that_came() -> None:
    """The caller adds them: a bad wire is told by its resyncs, not as a wrong rate."""
    watch = RateWatch(100.0)
    came, lost = 6, 4
    assert not any(watch.look(came + lost, 0.1 * n, 0.1 * n) for n in range(300))


def test_an_interruption_begins_a_new_count() -> None:
    watch = RateWatch(100.0)
    watched(watch, 100.0, 9.0)
    watch.reset()  # nothing came for a minute
    assert watched(watch, 100.0, 25.0, begin_s=70.0) == []


def test_a_short_time_is_not_judged() -> None:
    assert watched(RateWatch(100.0), 500.0, 0.9 * RATE_WINDOW_S) == []
    fast = RateWatch(100.0)  # ten times as fast as the wall: both clocks must have gone on
    assert watched(fast, 500.0, 4.0 * RATE_WINDOW_S, speed=10.0) == []
    assert len(watched(fast, 500.0, 2.0 * RATE_WINDOW_S, begin_s=4.0 * RATE_WINDOW_S + 0.1, speed=10.0)) == 1
