"""What readings leave of a clock's rate, whatever the computer does between request and reply."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog

from bufferstand.drivers.check.clock import OLD_S, UNEVEN_S, ClockDrift, drift_row, fit_drift
from bufferstand.drivers.check.clock_bounds import ClockBounds
from bufferstand.drivers.check.verdict import Verdict

Floats = NDArray[np.float64]
LEAST_S = 1e-4
"""No way takes less."""


def loaded(random: np.random.Generator, at_s: Floats, load: str) -> Floats:
    """Return how long one way takes at some moments [s]: on an idle computer, or one that others use too."""
    share = at_s / at_s[-1]
    delay_s = LEAST_S + random.exponential(3e-5, at_s.size)
    if load == "ramp":
        delay_s += random.uniform(0.0, 5e-3) * share
    elif load == "falls":
        delay_s += random.uniform(0.0, 5e-3) * (1.0 - share)
    elif load == "bursts":
        for begin in random.uniform(0.0, 1.0, 4):
            delay_s += np.where(abs(share - begin) < 0.06, random.uniform(1e-3, 2e-2), 0.0)
    elif load == "busy":
        delay_s += random.exponential(2e-3, at_s.size)
    elif load == "later":
        delay_s += np.where(share > random.uniform(0.2, 0.8), random.uniform(1e-4, 4e-3), 0.0)
    return np.asarray(delay_s)


def readings(
    ppm: float, there: str, back: str, seed: int, *, count: int = 120, scan_s: float = 0.0
) -> tuple[Floats, Floats, list[int]]:
    """Return middles and durations of round trips, and what a clock that wraps showed.

    ``scan_s``: the register is written so seldom.
    """
    random = np.random.default_rng(seed)
    planned_s = np.cumsum(random.uniform(0.01, 0.015, count))
    there_s, back_s = loaded(random, planned_s, there), loaded(random, planned_s, back)
    pauses_s = np.diff(planned_s, prepend=0.0)
    # One after the other: the next request goes out a while after the reply.
    asked_s = np.cumsum(pauses_s) + np.concatenate(([0.0], np.cumsum(there_s + back_s)[:-1]))
    true_s = asked_s + there_s
    answered_s = true_s + back_s
    seen_s = np.floor(true_s / scan_s) * scan_s if scan_s else true_s
    ticks = np.rint(seen_s * (1e6 + ppm)).astype(np.int64) + (1 << 32) - 700_000
    return 0.5 * (asked_s + answered_s), answered_s - asked_s, np.mod(ticks, 1 << 32).tolist()


def drift_of(ppm: float, there: str, back: str, seed: int, **how: float) -> ClockDrift:
    drift = fit_drift(*readings(ppm, there, back, seed, **how))  # type: ignore[arg-type]
    assert drift is not None
    return drift


LOADS = st.sampled_from(["idle", "ramp", "falls", "bursts", "busy", "later"])


@settings(max_examples=150, deadline=None)
@given(ppm=st.floats(-500.0, 500.0), there=LOADS, back=LOADS, seed=st.integers(0, 10_000))
def test_the_true_rate_is_within_the_bounds_whatever_the_load(
    ppm: float, there: str, back: str, seed: int
) -> None:
    drift = drift_of(ppm, there, back, seed)
    assert abs(drift.ppm - ppm) <= drift.expanded_ppm
    assert drift.slack_s == 0.0
    # On the way there and back it never takes less than the least: no line can be surer than two of these.
    assert drift.expanded_ppm >= 0.5 * 2.0 * LEAST_S / drift.span_s * 1e6


def test_a_ramp_of_load_one_way_deceives_the_middles_of_the_round_trips() -> None:
    """What a line through the middles, with twice its standard uncertainty, says is wrong nearly always."""
    outside = 0
    for seed in range(20):
        middle_s, trip_s, ticks = readings(20.0, "idle", "ramp", seed)
        device_us = np.concatenate(([0.0], np.cumsum(np.mod(np.diff(ticks), 1 << 32))))
        (slope, _), covariance = np.polyfit(middle_s, device_us, 1, cov=True)
        outside += abs(slope - 1e6 - 20.0) > 2.0 * np.sqrt(covariance[0, 0])
        drift = fit_drift(middle_s.tolist(), trip_s.tolist(), ticks)
        assert drift is not None
        assert abs(drift.ppm - 20.0) <= drift.expanded_ppm
    assert outside >= 15


@settings(max_examples=40, deadline=None)
@given(there=LOADS, back=LOADS, seed=st.integers(0, 10_000))
def test_the_interval_is_that_of_the_linear_program(there: str, back: str, seed: int) -> None:
    """Against a solver that knows nothing of hulls."""
    middle_s, trip_s, ticks = readings(70.0, there, back, seed, count=60)
    asked_s, answered_s = middle_s - 0.5 * trip_s, middle_s + 0.5 * trip_s
    device_us = np.concatenate(([0.0], np.cumsum(np.mod(np.diff(ticks), 1 << 32))))
    allowed = ClockBounds(asked_s, answered_s, device_us, 1.0).interval()
    assert allowed is not None
    ones = np.ones(asked_s.size)
    rows = np.concatenate((np.stack((ones, asked_s), axis=1), -np.stack((ones, answered_s), axis=1)))
    most = np.concatenate((device_us - asked_s * 1e6 + 1.0, answered_s * 1e6 - device_us + 1.0))
    for sign, found in ((1.0, allowed[0]), (-1.0, allowed[1])):
        solved = linprog([0.0, sign], A_ub=rows, b_ub=most, bounds=[(None, None)] * 2)
        assert solved.status == 0
        assert found == pytest.approx(sign * float(solved.fun or 0.0), abs=0.01)


@pytest.mark.slow
def test_more_readings_never_know_less() -> None:
    middle_s, trip_s, ticks = readings(20.0, "bursts", "busy", 3, count=400)
    before = np.inf
    for count in (3, 10, 50, 100, 200, 400):
        drift = fit_drift(middle_s[:count].tolist(), trip_s[:count].tolist(), ticks[:count])
        assert drift is not None
        assert drift.pairs == count
        assert drift.expanded_ppm <= 2.0 * before  # from the likeliest rate, which may lie at one end
        before = drift.expanded_ppm


@pytest.mark.slow
@pytest.mark.parametrize("scan_s", [2e-3, 5e-3, 2e-2])
def test_a_register_that_is_written_once_in_a_scan(scan_s: float) -> None:
    """Its reading may be older than the request, which no line explains: that is told, and in the bounds."""
    for seed in range(20):
        drift = drift_of(20.0, "idle", "idle", seed, scan_s=scan_s)
        assert abs(drift.ppm - 20.0) <= drift.expanded_ppm
        assert 0.3 * scan_s <= 2.0 * drift.slack_s <= scan_s
        row = drift_row(drift)
        assert row.verdict is Verdict.OK
        assert ("ms old when it is read" in row.remark) == (drift.slack_s > OLD_S)


@pytest.mark.slow
def test_a_clock_that_jumps_is_no_drift() -> None:
    middle_s, trip_s, ticks = readings(20.0, "idle", "idle", 1)
    ticks = ticks[:60] + [(tick + 800_000) % (1 << 32) for tick in ticks[60:]]
    row = drift_row(fit_drift(middle_s.tolist(), trip_s.tolist(), ticks))
    assert row.verdict is Verdict.FAULT
    assert "from every clock that runs evenly: look for a restart" in row.remark
    drift = fit_drift(middle_s.tolist(), trip_s.tolist(), ticks)
    assert drift is not None
    assert UNEVEN_S < drift.slack_s <= 0.4


@pytest.mark.slow
def test_trips_of_no_duration() -> None:
    """As a virtual clock makes them: request, reading and reply at one moment."""
    middle_s = (np.arange(50) * 0.01).tolist()
    drift = fit_drift(middle_s, [0.0] * 50, [round(at_s * (1e6 + 35.0)) for at_s in middle_s])
    assert drift is not None
    assert abs(drift.ppm - 35.0) <= drift.expanded_ppm <= 5.0
