"""The time stamps of a foreign record: how fast it was sampled, and where it is interrupted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recording.content import Segment

LONG = 1.5
"""An interval is a gap if it is longer than this many usual ones: half-way to one lost sample."""
LONG_IF_UNEVEN = 3.0
"""The same, where stamps are uneven by themselves, so that many intervals look long."""
_FEW_SHARE, _FEW = 0.01, 5
_SURELY_GAP = 5.0
_WHOLE = 0.1
_COUNTABLE = 10**9
"""A gap of more samples than any record has: its stamps are wrong, and its size is not known."""


@dataclass(frozen=True)
class Stamps:
    """What was found out about time stamps.

    ``rate_Hz`` is the usual sample rate (None with fewer than two good stamps); ``segments`` the
    uninterrupted stretches; ``findings`` what a user must know.
    """

    rate_Hz: float | None
    segments: tuple[Segment, ...]
    findings: tuple[str, ...]


def examine(
    time_s: NDArray[np.float64], row: NDArray[np.int64], word: str = "line", breaks: Sequence[int] = ()
) -> Stamps:
    """Find gaps, repeated, backward and missing time stamps. Nothing is changed or interpolated.

    The usual interval is the mean of the positive ones up to 1.5 times their median. What is longer than 1.5
    usual ones is a gap, of ``round(length / usual) − 1`` samples. If that holds for more than 1 % of them,
    the stamps may be uneven by themselves: rounded to the logger's clock (they then keep within one interval
    of a regular grid), or irregular (the long ones then are no whole multiples of the usual one). Only what
    is longer than three mean intervals is a gap then.

    Parameters
    ----------
    time_s : NDArray[float64]
        Times [s], shape (n,), NaN where missing.
    row : NDArray[int64]
        Number of each row in the file, shape (n,).
    word : str
        What a row is called in messages.
    breaks : sequence of int
        Rows before which the record was interrupted, whatever the stamps say.
    """
    known = np.array(sorted(breaks), dtype=np.int64) - 1
    steps = np.diff(time_s)
    forward = steps[steps > 0]
    if not len(forward):
        stuck = np.flatnonzero(~(steps > 0))
        missing = np.flatnonzero(np.isnan(time_s))
        findings = _counted("missing time stamp(s)", missing, row, word)
        findings += _counted("time stamp(s) do not advance", np.flatnonzero(steps <= 0) + 1, row, word)
        return Stamps(None, _segments(len(time_s), np.union1d(stuck, known), {}), tuple(findings))
    usual = float(forward[forward <= LONG * np.median(forward)].mean())
    long = steps > LONG * usual
    findings = []
    if _is_uneven(steps, long, usual):
        usual = float(forward[forward <= _SURELY_GAP * usual].mean())
        long = steps > LONG_IF_UNEVEN * usual
        findings.append(f"uneven time stamps, {usual:.6g} s apart in the mean")
    gaps = np.flatnonzero(long)
    lost = {int(row): max(1, round(min(float(steps[row]) / usual, 2.0 * _COUNTABLE)) - 1) for row in gaps}
    lost = {row: count for row, count in lost.items() if count <= _COUNTABLE}
    if len(gaps):
        longest = float(steps[gaps].max())
        about = f", about {sum(lost.values())} sample(s) missing" if len(lost) == len(gaps) else ""
        findings.append(
            f"{len(gaps)} gap(s){about}, the longest {longest:.6g} s; "
            f"the first before {word} {row[gaps[0] + 1]}"
        )
    findings += _counted("missing time stamp(s)", np.flatnonzero(np.isnan(time_s)), row, word)
    findings += _counted("repeated time stamp(s)", np.flatnonzero(steps == 0) + 1, row, word)
    findings += _counted("backward time stamp(s)", np.flatnonzero(steps < 0) + 1, row, word)
    ends = np.union1d(np.flatnonzero(long | ~(steps > 0)), known)
    return Stamps(1.0 / usual, _segments(len(time_s), ends, lost), tuple(findings))


def _is_uneven(steps: NDArray[np.float64], long: NDArray[np.bool_], usual: float) -> bool:
    """Tell whether many long intervals come from uneven stamps rather than from samples that are missing."""
    if long.sum() < _FEW or long.sum() <= _FEW_SHARE * len(steps):
        return False
    kept = steps[(steps > 0) & (steps <= _SURELY_GAP * usual)]
    grid = np.cumsum(kept - kept.mean())
    if np.ptp(grid) <= 2.0 * kept.mean():  # one interval to either side
        return True
    ratio = steps[long] / usual
    return bool(np.median(abs(ratio - np.round(ratio))) > _WHOLE)


def _segments(rows: int, breaks: NDArray[np.int64], lost: dict[int, int]) -> tuple[Segment, ...]:
    """Return the stretches between the breaks; a break is named by the row before it."""
    segments = [Segment(0, 0, 0)] if rows else []
    missing = 0
    for before in breaks.tolist():
        missing += lost.get(before, 0)
        segments.append(Segment(before + 1, before + 1 + missing, lost.get(before, 0)))
    return tuple(segments)


def _counted(what: str, rows: NDArray[np.int64], row: NDArray[np.int64], word: str) -> list[str]:
    return [f"{len(rows)} {what}, the first in {word} {row[rows[0]]}"] if len(rows) else []
