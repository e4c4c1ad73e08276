"""The instants at which each channel was read: blanks, doubled rows and stamps that several rows share.

A table has one row for every instant at which any channel was read. A blank in a slower channel's column is
no lost reading, a row that was written twice is one reading, and ten rows of one stamp are ten readings of a
logger whose clock is coarse. Nothing here changes a number: it says what the rows are.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

LONG = 1.5
"""A step longer than this many usual ones holds more than one."""
_LEAST_BLANKS = 8
_ODD_SHARE = 0.1
"""Of the places where a column is blank, at most this share is a hole in its own sampling."""
_SPARSE = 0.5
"""A column that holds less than this share of the rows has its own instants, however uneven they are."""
_OFTEN = 0.02
"""Blanks lie between at least so many of a slower channel's readings."""
_UNALIKE = 0.3
_MOSTLY = 0.9
_FEWEST_SHARED = 3


def has_own_instants(time_s: Floats, filled: Mask) -> bool:
    """Tell whether a column is blank because it is read less often, and not because readings are missing.

    It is, if where it is filled its readings follow each other evenly, by rows or by time, but for a tenth
    of the places where it is blank; or if it is blank in most of the rows. A few cells that are missing in a
    full column make uneven steps, and remain what they are.

    Parameters
    ----------
    time_s : array, shape (n,)
        Stamps of the rows [s].
    filled : array of bool, shape (n,)
        Rows in which the column holds a number.
    """
    rows = np.flatnonzero(filled)
    blanks = filled.size - rows.size
    if blanks < _LEAST_BLANKS or rows.size < 2:
        return False
    row_steps = np.diff(rows)
    places = int(np.count_nonzero(row_steps > 1))
    if places < _OFTEN * rows.size:
        return False  # a few holes, or blank at its ends only: it began later, or ended before
    if rows.size < _SPARSE * filled.size:
        return True
    allowed = _ODD_SHARE * places
    return _lonely(row_steps.astype(np.float64)) <= allowed or _lonely(np.diff(time_s[rows])) <= allowed


def _lonely(steps: Floats) -> int:
    """Return how many steps are longer than 1.5 times the longer one of their neighbours."""
    beside = np.concatenate(([-np.inf], steps, [-np.inf]))
    return int(np.count_nonzero(~(steps <= LONG * np.fmax(beside[:-2], beside[2:]))))


def doubled_rows(time_s: Floats, columns: Iterable[Floats]) -> Mask:
    """Return the rows that say what the row before says: the same stamp, the same values; shape (n,)."""
    doubled = np.zeros(time_s.size, dtype=bool)
    doubled[1:] = time_s[1:] == time_s[:-1]
    for values in columns:
        if not doubled.any():
            break
        after = np.flatnonzero(doubled)
        one, other = values[after - 1], values[after]
        doubled[after] = (one == other) | (np.isnan(one) & np.isnan(other))
    return doubled


def shared_stamps(time_s: Floats) -> tuple[float, float] | None:
    """Tell whether a logger's clock is so coarse that rows share its stamps: regularly, and never backwards.

    Parameters
    ----------
    time_s : array, shape (n,)
        Without doubled rows.

    Returns
    -------
    (float, float) or None
        The clock's step [s], and how many rows share a stamp; None where that is not what the stamps show.
    """
    steps = np.diff(time_s)
    if steps.size == 0 or not np.min(steps) >= 0.0:  # NaN, too
        return None
    starts = np.flatnonzero(steps > 0.0) + 1
    sizes = np.diff(starts)
    if sizes.size < _FEWEST_SHARED:
        return None
    usual = float(np.median(sizes))
    alike = np.abs(sizes - usual) <= max(1.0, _UNALIKE * usual)
    if usual < 2.0 or np.count_nonzero(alike) < _MOSTLY * sizes.size:
        return None
    return float(np.median(np.diff(time_s[starts]))), usual


def spread_stamps(time_s: Floats) -> Floats:
    """Return instants for rows that share stamps (:func:`shared_stamps`), rising from row to row.

    Within a stretch without a gap, the first rows of the stamps lie on a straight line within one step of
    the clock: the rows are even, and that line is their time. Where they do not, the rows of each stamp are
    spread evenly up to the next one. What a coarse clock hides is at most its step, the same for all channels
    of the rows.

    Parameters
    ----------
    time_s : array, shape (n,)

    Returns
    -------
    array, shape (n,)
    """
    starts = np.concatenate(([0], np.flatnonzero(np.diff(time_s) > 0.0) + 1))
    stamps = time_s[starts]
    step_s = float(np.median(np.diff(stamps)))
    widths = np.append(np.minimum(np.diff(stamps), LONG * step_s), step_s)
    sizes = np.diff(np.append(starts, time_s.size))
    within = np.arange(time_s.size) - np.repeat(starts, sizes)
    spread = np.repeat(stamps, sizes) + within * np.repeat(widths / sizes, sizes)
    ends = np.concatenate(([0], np.flatnonzero(np.diff(stamps) > LONG * step_s) + 1, [stamps.size]))
    for first, last in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        even = _even(starts[first:last], stamps[first:last], step_s)
        if even is not None:
            slope_s, at_s, row = even
            rows = np.arange(starts[first], starts[last] if last < starts.size else time_s.size)
            spread[rows] = at_s + slope_s * (rows - row)
    return spread if np.all(np.diff(spread) > 0.0) else time_s


def _even(starts: NDArray[np.int64], stamps: Floats, step_s: float) -> tuple[float, float, float] | None:
    """Return step [s], a time [s] and its row of a line through the first rows of stamps, or None."""
    rows, known = starts[1:].astype(np.float64), stamps[1:]  # the first one's rows may have begun before it
    if rows.size < _FEWEST_SHARED:
        return None
    row, at_s = float(np.mean(rows)), float(np.mean(known))
    slope_s = float(np.dot(rows - row, known - at_s) / np.dot(rows - row, rows - row))
    if slope_s <= 0.0 or np.max(np.abs(known - at_s - slope_s * (rows - row))) > step_s:
        return None
    return slope_s, at_s, row
