"""Lower turns by like flanks: where the turn is, the fits say; how long it is to the next, the flanks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.cycle import Cycle
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.signals import Floats

RATE_HZ, PERIOD_S, NOISE_MM = 1000.0, 0.8, 0.01


def periodic(
    shape: Floats, *, cycles: float = 9.3, begins: float = 0.3, noise_mm: float = NOISE_MM, seed: int = 1
) -> tuple[Cycle, ...]:
    """Return the cycles of a motion that repeats a shape (a period of even values) exactly."""
    time = np.arange(round(cycles * PERIOD_S * RATE_HZ)) / RATE_HZ
    phase = np.mod(time / PERIOD_S + begins, 1.0)
    stroke = np.interp(phase, np.linspace(0.0, 1.0, shape.size + 1), np.append(shape, shape[0]))
    stroke = stroke + noise_mm * np.random.default_rng(seed).standard_normal(time.size)
    return find_cycles(make_record(time, stroke, stroke))


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    stands=st.tuples(st.floats(0.0, 0.06), st.floats(0.0, 0.06)),
    up=st.floats(0.35, 0.65),
    catches_up=st.floats(0.0, 0.9),
    second=st.floats(-0.1, 0.1),
    seed=st.integers(0, 1000),
)
def test_the_period_of_any_motion_that_repeats_itself(
    stands: tuple[float, float], up: float, catches_up: float, second: float, seed: int
) -> None:
    """Whatever its turns look like: flat, leaning, with a jump behind them, one branch faster."""
    phase = np.arange(4000) / 4000.0
    low, high = (own / PERIOD_S for own in stands)
    knots = np.cumsum([0.0, low, up * (1.0 - low - high), high, (1.0 - up) * (1.0 - low - high)])
    angle = np.interp(phase, knots, np.pi * np.array([0.0, 0.0, 1.0, 1.0, 2.0]))
    shape = 50.0 - 15.0 * np.cos(angle + second * np.sin(angle))
    # What a dwell keeps back comes at once behind it, within a tenth of the period.
    shape = shape + catches_up * (
        np.exp(-(((phase - knots[1] - 0.05) / 0.02) ** 2))
        - np.exp(-(((phase - knots[3] - 0.05) / 0.02) ** 2))
    )
    cycles = [cycle for cycle in periodic(shape, seed=seed) if cycle.steady]
    assert len(cycles) >= 7
    durations = np.array([cycle.duration_s for cycle in cycles])
    assert np.max(np.abs(durations / PERIOD_S - 1.0)) <= 5e-4
    mean_s = (cycles[-1].end_s - cycles[0].start_s) / len(cycles)
    assert mean_s == pytest.approx(PERIOD_S, rel=2e-4)
    u_s = np.array([np.hypot(cycle.start.u_leave_s, cycle.end.u_time_s) for cycle in cycles])
    assert np.count_nonzero(np.abs(durations - PERIOD_S) > 2.0 * u_s) <= 2


@pytest.mark.parametrize("noise_mm", [0.0, 0.002, 0.01])
def test_turns_stay_where_they_are(noise_mm: float) -> None:
    """The fastest flanks lie anywhere beside a turn; the turn is where the stroke is lowest."""
    phase = np.arange(4000) / 4000.0
    angle = 2.0 * np.pi * phase
    shape = 50.0 - 15.0 * np.cos(angle - 0.3 * np.sin(angle))  # rises slower than it falls, about its turn
    true_s = PERIOD_S * (1.0 - 0.3)
    for cycle in periodic(shape, noise_mm=noise_mm):
        if cycle.steady:
            since_s = np.mod(cycle.start_s - true_s + 0.5 * PERIOD_S, PERIOD_S) - 0.5 * PERIOD_S
            assert abs(since_s) <= 1e-3 * PERIOD_S


def test_strokes_that_differ_keep_the_moments_of_their_own_turns() -> None:
    """Up slowly and down fast, to lower turns that differ: the middle of the flanks says nothing of these."""
    random = np.random.default_rng(3)
    low = random.uniform(0.0, 2.0, 9)
    moments, levels = [0.0], [low[0]]
    for below in low[1:]:
        moments.append(moments[-1] + (60.0 - levels[-1]) / 20.0)
        levels.append(60.0)
        moments.append(moments[-1] + (60.0 - below) / 100.0)
        levels.append(below)
    time = np.arange(round(moments[-1] * RATE_HZ)) / RATE_HZ
    stroke = np.interp(time, moments, levels) + 0.002 * random.standard_normal(time.size)
    lower = np.array(moments[2:-1:2])
    cycles = [c for c in find_cycles(make_record(time, stroke, stroke)) if c.complete]
    starts = np.array([c.start_s for c in cycles if c.start.method == "lines"])
    assert starts.size >= 6
    for at in starts:
        assert np.min(np.abs(lower - at)) <= 1e-3


def test_two_motions_about_different_levels_in_one_record() -> None:
    """Each has flanks of its own; the way from one to the other has none of either."""
    time = np.arange(16_000) / RATE_HZ
    angle = 2.0 * np.pi * time / PERIOD_S
    second = np.clip((time - 6.4) / 1.6, 0.0, 1.0)
    stroke = 40.0 + 40.0 * second - (10.0 + 10.0 * second) * np.cos(angle)
    stroke = stroke + NOISE_MM * np.random.default_rng(2).standard_normal(time.size)
    steady = [c for c in find_cycles(make_record(time, stroke, stroke)) if c.steady]
    assert len(steady) >= 16
    for cycle in steady:
        assert cycle.duration_s == pytest.approx(PERIOD_S, rel=3e-4)


def test_flanks_are_not_read_across_a_break() -> None:
    time = np.arange(8_000) / RATE_HZ
    keep = (time < 3.30) | (time > 3.47)  # on the way up behind a lower turn at 3.2 s
    stroke = 50.0 - 10.0 * np.cos(2.0 * np.pi * time / PERIOD_S)
    stroke = stroke + NOISE_MM * np.random.default_rng(4).standard_normal(time.size)
    cycles = find_cycles(make_record(time[keep], stroke[keep], stroke[keep]))
    for cycle in cycles:
        if cycle.complete and not 2.4 < cycle.start_s < 4.1:
            assert cycle.duration_s == pytest.approx(PERIOD_S, rel=1e-3)


@pytest.mark.parametrize("rest_s", [0.0, 1.3])
@pytest.mark.parametrize("other_mm", [15.0, 16.0])
@pytest.mark.parametrize("other_s", [0.72, 0.5, 1.3])
def test_the_last_turn_of_a_motion_is_where_its_own_flank_says(
    other_s: float, other_mm: float, rest_s: float
) -> None:
    """Another frequency, of the same stroke or not, follows at once or after a rest at the mean stroke."""
    ends = np.cumsum([6.25 * PERIOD_S, rest_s, 6.0 * other_s])
    time = np.arange(round(ends[-1] * RATE_HZ)) / RATE_HZ
    turns = np.minimum(time, ends[0]) / PERIOD_S + np.maximum(time - ends[1], 0.0) / other_s
    stroke = 50.0 - np.where(time < ends[0], 15.0, other_mm) * np.cos(2.0 * np.pi * turns)
    stroke = stroke + NOISE_MM * np.random.default_rng(5).standard_normal(time.size)
    cycles = [c for c in find_cycles(make_record(time, stroke, stroke)) if c.complete]
    first = [c.duration_s for c in cycles if c.end_s < ends[0] + 0.1 * PERIOD_S]
    second = [c.duration_s for c in cycles if c.start_s > ends[1] + 0.5 * other_s]
    assert len(first) >= 5
    assert len(second) >= 4
    assert first == pytest.approx([PERIOD_S] * len(first), rel=3e-3)
    assert second == pytest.approx([other_s] * len(second), rel=2e-3)
