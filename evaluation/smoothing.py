"""Local polynomials by least squares: smoothed values and slopes of even samples, and single fits."""

from __future__ import annotations

from functools import lru_cache
from math import factorial

import numpy as np

from evaluation.record import FloatArray
from evaluation.turn_fits import powers


@lru_cache(maxsize=512)
def _operators(window: int, degree: int, derivative: int) -> tuple[FloatArray, FloatArray]:
    """Return weights of a window's middle (window,) and of its first half (window // 2, window)."""
    half = window // 2
    at = np.arange(-half, half + 1.0) / half
    inverse = np.linalg.pinv(powers(at, degree))[derivative:]
    gain = np.array([factorial(k) / factorial(k - derivative) for k in range(derivative, degree + 1)])
    rows = powers(at[: half + 1], degree - derivative) * gain @ inverse / half**derivative
    return rows[half], rows[:half]


def smoothed(values: FloatArray, window: int, degree: int, derivative: int = 0) -> FloatArray:
    """Return a moving polynomial's value or derivative (Savitzky and Golay, Anal. Chem. 36, 1964).

    Parameters
    ----------
    values : array, shape (N,)
        Evenly spaced; N not below ``window``.
    window : int
        Samples of a window, odd. The first and last half windows are read off the outermost polynomials.
    degree, derivative : int
        The derivative is by the sample: divide by the step once for each.
    """
    middle, start = _operators(window, degree, derivative)
    inner = np.convolve(values, middle[::-1], mode="valid")
    sign = -1.0 if derivative % 2 else 1.0
    return np.concatenate((start @ values[:window], inner, (sign * start @ values[: -window - 1 : -1])[::-1]))


def polynomial(z: FloatArray, value: FloatArray, degree: int) -> FloatArray:
    """Return the coefficients of a polynomial by least squares, lowest power first; ``z`` within about ±1."""
    matrix = powers(z, degree)
    return np.asarray(np.linalg.solve(matrix.T @ matrix, matrix.T @ value), dtype=np.float64)
