"""Local polynomials by least squares, of many rows at once: smoothed values and slopes, and single fits.

A row holds ``count`` values and is padded behind them, so that rows of different length are one array.
"""

from __future__ import annotations

from functools import lru_cache
from math import factorial

import numpy as np

from bufferstand.evaluation.numerics.arrays import BoolArray, FloatArray, IndexArray
from bufferstand.evaluation.numerics.shape_fits import powers

_FEW_PAIRS = 4
"""Of a window of so few pairs the sum is formed pair by pair, else from running sums."""


@lru_cache(maxsize=512)
def _operators(window: int, degree: int, derivative: int) -> tuple[FloatArray, FloatArray]:
    """Return weights of a window's middle (window,) and of its first half (window // 2, window)."""
    half = window // 2
    at = np.arange(-half, half + 1.0) / half
    inverse = np.linalg.pinv(powers(at, degree))[derivative:]
    gain = np.array([factorial(k) / factorial(k - derivative) for k in range(derivative, degree + 1)])
    rows = powers(at[: half + 1], degree - derivative) * gain @ inverse / half**derivative
    return rows[half], rows[:half]


def smoothed(values: FloatArray, count: IndexArray, window: int, degree: int) -> FloatArray:
    """Return a moving polynomial's values (Savitzky and Golay, Anal. Chem. 36, 1964), shape (R, P).

    Parameters
    ----------
    values : array, shape (R, P)
        Evenly spaced.
    count : array of int, shape (R,)
        Values of each row, not below ``window``; behind them the result repeats one of its own values.
    window : int
        Samples of a window, odd. The first and last half windows are read off the outermost polynomials.
    degree : int
    """
    weights, start = _operators(window, degree, 0)
    half = window // 2
    moved = np.convolve(values.ravel(), weights[::-1], mode="same").reshape(values.shape)
    return _with_ends(moved, values, count, start, half, 1.0)


def moving_slopes(values: FloatArray, count: IndexArray, window: int) -> FloatArray:
    """Return the slope by the sample of a moving parabola in the same way."""
    _, start = _operators(window, 2, 1)
    half = window // 2
    moved = np.zeros_like(values)
    inner = values.shape[1] - 2 * half
    rise = moved[:, half : half + inner]
    # Σ j (x[c+j] - x[c-j]) for j up to half
    if half <= _FEW_PAIRS:
        for j in range(1, half + 1):
            rise += j * (values[:, half + j : half + j + inner] - values[:, half - j : half - j + inner])
    else:  # from sums of sums: the window costs nothing
        once = np.zeros((values.shape[0], values.shape[1] + 1))
        np.cumsum(values - values[:, :1], axis=1, out=once[:, 1:])
        twice = np.zeros((values.shape[0], values.shape[1] + 2))
        np.cumsum(once, axis=1, out=twice[:, 1:])
        # once[c + 1] is the sum up to value c, twice[c + 2] the sum of these sums up to it.
        rise += once[:, 2 * half + 1 : 2 * half + 1 + inner]
        rise += once[:, :inner]
        rise *= half
        rise -= twice[:, 2 * half + 1 : 2 * half + 1 + inner]
        rise += twice[:, 1 : 1 + inner]
    rise *= 3.0 / (half * (half + 1.0) * (2.0 * half + 1.0))
    return _with_ends(moved, values, count, start, half, -1.0)


def _with_ends(
    moved: FloatArray, values: FloatArray, count: IndexArray, start: FloatArray, half: int, sign: float
) -> FloatArray:
    """Put the values of the outermost polynomials at both ends of each row, and one of its own behind it."""
    window = 2 * half + 1
    first = int(np.min(count)) - half
    tail = moved[:, first:]
    behind = np.arange(first, values.shape[1]) >= (count - half)[:, None]
    tail[behind] = np.broadcast_to(moved[:, half, None], tail.shape)[behind]
    at = (count - 1)[:, None] - np.arange(window)
    end = sign * np.take_along_axis(values, at, axis=1) @ start.T
    np.put_along_axis(moved, at[:, :half], end, axis=1)
    moved[:, :half] = values[:, :window] @ start.T
    return moved


def polynomials(z: FloatArray, value: FloatArray, used: BoolArray, degree: int) -> FloatArray:
    """Return the coefficients of polynomials by least squares, lowest power first, shape (R, degree + 1).

    Parameters
    ----------
    z, value : arrays, shape (R, P)
        ``z`` within about ±1.
    used : array of bool, shape (R, P)
        What is fitted; the rest is left out. NaN for rows with fewer points than coefficients.
    degree : int
    """
    at, level = np.where(used, z, 0.0), np.where(used, value, 0.0)
    power = used.astype(np.float64)
    moments = np.empty((2 * degree + 1, z.shape[0]))
    right = np.empty((z.shape[0], degree + 1))
    for k in range(2 * degree + 1):
        moments[k] = np.einsum("ij->i", power)
        if k <= degree:
            right[:, k] = np.einsum("ij,ij->i", power, level)
        power *= at
    if degree == 1:  # most fits by far are lines: without the linear algebra library, row by row
        spread = moments[0] * moments[2] - moments[1] ** 2
        good = (moments[0] >= 2.0) & (spread > 0.0)
        slope = np.where(good, moments[0] * right[:, 1] - moments[1] * right[:, 0], np.nan)
        slope /= np.where(good, spread, 1.0)
        value_at_0 = right[:, 0] - slope * moments[1]
        return np.stack((value_at_0 / np.where(good, moments[0], 1.0), slope), axis=1)
    normal = moments[np.add.outer(np.arange(degree + 1), np.arange(degree + 1))].transpose(2, 0, 1).copy()
    weak = moments[0] <= degree
    normal[weak] = np.eye(degree + 1)
    found = np.linalg.solve(normal, right[..., None])[..., 0]
    found[weak] = np.nan
    return np.asarray(found, dtype=np.float64)
