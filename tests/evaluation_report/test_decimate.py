from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.evaluation.figures.decimate import kept_samples, with_breaks


@given(st.integers(9, 4000), st.integers(8, 1500), st.integers(0, 2**32 - 1))
def test_keeps_every_extreme_and_both_ends_within_the_limit(size: int, limit: int, seed: int) -> None:
    noise = np.random.default_rng(seed)
    x, y = np.cumsum(noise.normal(size=size)), noise.normal(size=size)
    kept = kept_samples(x, y, limit)
    assert np.all(np.diff(kept) > 0)
    assert kept.size <= max(limit, 8) or size <= limit
    assert {kept[0], kept[-1]} == {0, size - 1}
    for curve in (x, y):
        assert curve[kept].min() == curve.min()
        assert curve[kept].max() == curve.max()


def test_a_short_curve_stays_as_it_is() -> None:
    assert kept_samples([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], 8).tolist() == [0, 1, 2]


def test_one_spike_among_many_samples_survives() -> None:
    y = np.zeros(100_000)
    y[54_321] = 1.0
    assert 54_321 in kept_samples(np.arange(y.size, dtype=float), y, 100)


def test_a_loop_looks_the_same_after_decimation() -> None:
    phase = np.linspace(0.0, 2.0 * np.pi, 40_001)
    x, y = 50.0 - 20.0 * np.cos(phase), 300.0 - 200.0 * np.cos(phase - 0.3)
    kept = kept_samples(x, y, 1500)
    # On a print 150 mm wide and 80 mm high; the line itself is 0.4 mm wide.
    drawn = np.interp(np.arange(x.size), kept, y[kept])
    assert np.abs(drawn - y).max() / (y.max() - y.min()) * 80.0 < 0.01

    def area(of_x: np.ndarray, of_y: np.ndarray) -> float:
        return abs(float(np.trapezoid(of_y, of_x)))

    assert area(x[kept], y[kept]) == pytest.approx(area(x, y), rel=1e-4)


def test_breaks_stay_so_that_no_line_is_drawn_across_them() -> None:
    x = np.arange(10_000, dtype=float)
    y = np.sin(x / 500.0)
    y[5_000] = np.nan
    kept = kept_samples(x, y, 200)
    assert np.isnan(y[kept]).sum() == 1
    assert kept.size <= 201


def test_a_gap_in_time_becomes_a_break() -> None:
    time, value = with_breaks(np.array([0.0, 1.0, 2.0, 9.0, 10.0]), np.arange(5.0), 5.0)
    assert time.size == 6
    assert np.isnan(time[3])
    assert np.isnan(value[3])
    assert value[~np.isnan(value)].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_refuses_what_is_no_curve() -> None:
    with pytest.raises(ValueError, match="one length"):
        kept_samples([1.0], [1.0, 2.0], 8)
    with pytest.raises(ValueError, match="at least 8"):
        kept_samples([1.0], [1.0], 7)
