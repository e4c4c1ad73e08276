"""Two clocks that drift apart: what is left of it in the instants of a run, and whether it is owned up to."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.recording.runfile.clock_map import ClockMap
from bufferstand.recording.runfile.drifting_clock_map import DriftingClockMap


def anchors(
    lasts_s: float, drift: float, jitter_s: float, seed: int, warming: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return device times [µs], host times of arrival, and true host times of each anchor."""
    random = np.random.default_rng(seed)
    true_s = 100.0 + np.arange(0.0, lasts_s, 0.05)
    run_s = true_s - true_s[0]
    device_s = 5.0 + run_s * (1.0 + drift) + 0.5 * warming * run_s**2 / lasts_s
    arrived_s = true_s + random.exponential(jitter_s, true_s.size)
    return np.rint(1e6 * device_s).astype(np.int64), arrived_s, true_s


def worst_s(clocks: ClockMap | DriftingClockMap, device_us: np.ndarray, true_s: np.ndarray) -> float:
    """Return the largest error of mapped instants [s]."""
    return float(np.max(np.abs(clocks.to_device_s(true_s) - device_us * 1e-6)))


@pytest.mark.parametrize("drift", [0.0, 80e-6, -80e-6])
@pytest.mark.parametrize("lasts_s", [10.0, 100.0, 3000.0])
def test_the_line_follows_the_drift(drift: float, lasts_s: float) -> None:
    device_us, host_s, true_s = anchors(lasts_s, drift, 0.3e-3, seed=1)
    clocks = DriftingClockMap(device_us, host_s)
    assert worst_s(clocks, device_us, true_s) < 60e-6
    assert clocks.drift == pytest.approx(drift, abs=60e-6 / lasts_s)
    assert clocks.spread_s < 60e-6


def test_a_smallest_difference_a_minute_does_not() -> None:
    device_us, host_s, true_s = anchors(50.0, 80e-6, 0.3e-3, seed=1)
    assert worst_s(ClockMap(device_us, host_s), device_us, true_s) > 1e-3


def test_a_crystal_that_warms_is_followed_stretch_by_stretch() -> None:
    device_us, host_s, true_s = anchors(3000.0, 20e-6, 0.3e-3, seed=2, warming=2e-6)
    assert worst_s(DriftingClockMap(device_us, host_s), device_us, true_s) < 400e-6


@given(
    drift=st.floats(-1e-4, 1e-4), jitter_s=st.floats(1e-5, 2e-3), seed=st.integers(0, 2**16),
    lasts_s=st.floats(5.0, 200.0),
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_the_spread_owns_up_to_the_error(drift: float, jitter_s: float, seed: int, lasts_s: float) -> None:
    device_us, host_s, true_s = anchors(lasts_s, drift, jitter_s, seed)
    clocks = DriftingClockMap(device_us, host_s)
    middle = slice(true_s.size // 4, 3 * true_s.size // 4)
    error_s = clocks.to_device_s(true_s[middle]) - 1e-6 * device_us[middle]
    assert float(np.sqrt(np.mean(error_s**2))) < 4.0 * clocks.spread_s + 2e-6


@given(shift_s=st.floats(-1e5, 1e5))
@settings(max_examples=20, deadline=None)
def test_another_origin_of_the_hosts_clock_changes_nothing(shift_s: float) -> None:
    device_us, host_s, true_s = anchors(60.0, 5e-5, 0.2e-3, seed=3)
    one = DriftingClockMap(device_us, host_s).to_device_s(true_s)
    two = DriftingClockMap(device_us, host_s + shift_s).to_device_s(true_s + shift_s)
    np.testing.assert_allclose(two, one, atol=2e-6)


def test_one_anchor_is_an_offset() -> None:
    clocks = DriftingClockMap(np.array([2_000_000]), np.array([12.0]))
    assert clocks.to_device_s(np.array([13.0]))[0] == pytest.approx(3.0)
    with pytest.raises(ValueError, match="no clock anchors"):
        DriftingClockMap(np.zeros(0, dtype=np.int64), np.zeros(0))
