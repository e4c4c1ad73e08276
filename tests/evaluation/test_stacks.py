"""Work on many rows at once: the same as SciPy's on one, whatever the lengths of the others."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from bufferstand.evaluation.numerics.cubic_splines import splines
from bufferstand.evaluation.numerics.smoothing import moving_slopes, polynomials, smoothed

COUNT = np.array([40, 23, 31])
RANDOM = np.random.default_rng(7)
VALUES = np.cumsum(RANDOM.standard_normal((3, 40)), axis=1)


def test_splines_are_those_of_each_row() -> None:
    time = np.cumsum(RANDOM.uniform(0.2, 1.0, (3, 40)), axis=1)
    moments, found = splines(time, [VALUES], COUNT, 100)
    for row, count in enumerate(COUNT):
        expected = CubicSpline(time[row, :count], VALUES[row, :count])(moments[row])
        np.testing.assert_allclose(found[row], expected, rtol=1e-9, atol=1e-9)


def test_moving_polynomials_are_those_of_each_row() -> None:
    level, slope = smoothed(VALUES, COUNT, 9, 2), moving_slopes(VALUES, COUNT, 9)
    for row, count in enumerate(COUNT):
        own = VALUES[row, :count]
        np.testing.assert_allclose(level[row, :count], savgol_filter(own, 9, 2), atol=1e-9)
        np.testing.assert_allclose(slope[row, :count], savgol_filter(own, 9, 2, deriv=1), atol=1e-9)
        assert np.all(
            (level[row, count:] >= level[row, :count].min())
            & (level[row] <= level[row, :count].max())[count:]
        )


def test_polynomials_are_those_of_each_row() -> None:
    z = RANDOM.uniform(-1.0, 1.0, VALUES.shape)
    used = np.arange(40) < COUNT[:, None]
    for degree in (0, 1, 2, 3):
        found = polynomials(z, VALUES, used, degree)
        for row, count in enumerate(COUNT):
            expected = np.polynomial.polynomial.polyfit(z[row, :count], VALUES[row, :count], degree)
            np.testing.assert_allclose(found[row], expected, atol=1e-9)
