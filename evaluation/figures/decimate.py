"""Reduces the points of a drawn curve to those that a printed line can show."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def kept_samples(x: ArrayLike, y: ArrayLike, limit: int) -> NDArray[np.intp]:
    """Return the indices of the samples that a drawn curve needs, ascending.

    The samples are divided into equal buckets; of each the lowest and the highest ``y`` stay, so that no
    peak is lost. First and last sample, the extremes of ``x`` (a loop's turning points) and every break in
    the curve (NaN) stay as well.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        The curve, in the order in which it is drawn; a NaN in either interrupts the line.
    limit : int
        Most points to keep, breaks not counted; at least 8.

    Returns
    -------
    ndarray of int, shape (m,)
        Indices; all of them when the curve is short enough.

    Raises
    ------
    ValueError
        If ``x`` and ``y`` differ in length or ``limit`` is below 8.
    """
    xs = np.asarray(x, dtype=np.float64)
    ys = np.asarray(y, dtype=np.float64)
    if xs.shape != ys.shape or xs.ndim != 1:
        raise ValueError(f"x and y must be of one length, not {xs.shape} and {ys.shape}")
    if limit < 8:
        raise ValueError(f"limit must be at least 8, not {limit}")
    broken = np.isnan(xs) | np.isnan(ys)
    drawn = np.flatnonzero(~broken)
    if drawn.size <= limit:
        return np.arange(xs.size)
    ends = drawn[np.array([0, -1, np.argmin(xs[drawn]), np.argmax(xs[drawn])])]
    return np.unique(
        np.concatenate([ends, *_bucket_extremes(drawn, ys, (limit - 4) // 2), np.flatnonzero(broken)])
    )


def _bucket_extremes(drawn: NDArray[np.intp], y: NDArray[np.float64], buckets: int) -> list[NDArray[np.intp]]:
    """Return where the lowest and the highest ``y`` of each bucket lie; the first buckets have one more."""
    size, longer = divmod(drawn.size, buckets)
    whole = longer * (size + 1)
    found = []
    for part in (drawn[:whole].reshape(longer, size + 1), drawn[whole:].reshape(-1, size)):
        if part.size:
            row = np.arange(len(part))
            found += [part[row, which(y[part], axis=1)] for which in (np.argmin, np.argmax)]
    return found


def with_breaks(
    time_s: NDArray[np.float64], value: NDArray[np.float64], longest_s: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return time and value with a NaN wherever two samples lie further apart than ``longest_s``.

    A line drawn across such a gap would show values that nobody measured.

    Parameters
    ----------
    time_s, value : ndarray, shape (n,)
        Samples in the order of time.
    longest_s : float
        Longest distance of two samples that a line may join [s].

    Returns
    -------
    tuple of ndarray, shape (n + gaps,)
        Time [s] and value, each with NaN at the gaps.
    """
    gaps = np.flatnonzero(np.diff(time_s) > longest_s) + 1
    return np.insert(time_s, gaps, np.nan), np.insert(value, gaps, np.nan)
