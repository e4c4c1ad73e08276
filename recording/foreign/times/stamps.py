"""The time stamps of a foreign record: its sample rate, and its interruptions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bufferstand.recording.content import Segment
from bufferstand.recording.foreign.times.instants import doubled_rows, shared_stamps, spread_stamps

LONG = 1.5
"""An interval is a gap if it is longer than this many usual ones: half-way to one lost sample."""
LONG_IF_UNEVEN = 3.0
"""The same, where stamps are uneven by themselves, so that many intervals look long."""
ABOUT = 15
"""So many intervals say what is usual about a place: of a slower stretch, it is its own interval."""
_FEW_SHARE, _FEW = 0.01, 5
_SURELY_GAP = 5.0
_WHOLE = 0.1
_COUNTABLE = 10**9
"""A gap of more samples than any record has: its stamps are wrong, and its size is not known."""
_MOST_NAMED = 3
_EXPLAINED = 0.1
_PIECE = 65_536
_USUAL_CHANGE = 0.98
"""Share of the intervals by which it is judged how much a channel changes from row to row."""
_LEAST_CHANGE = 0.4
_LARGER = 1.6


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
    time_s: NDArray[np.float64],
    row: NDArray[np.int64],
    word: str = "line",
    breaks: Sequence[int] = (),
    values: Sequence[NDArray[np.float64]] = (),
) -> Stamps:
    """Find gaps, repeated, backward and missing time stamps. Nothing is changed or interpolated.

    The usual interval is the mean of the positive ones up to 1.5 times their median. What is longer than 1.5
    usual ones is a gap, of ``round(length / usual) - 1`` samples, unless the median of the 15 intervals about
    it is as long: the logger changed its rate there. If gaps are more than 1 % of the intervals,
    the stamps may be uneven by themselves: rounded to the logger's clock (they then keep within one interval
    of a regular grid), or irregular (the long ones then are no whole multiples of the usual one). Only what
    is longer than three mean intervals is a gap then. Rows that a logger writes when something changed are
    uneven, too, and in the long intervals nothing changed: none of them is a gap.

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
    values : sequence of NDArray[float64]
        What the rows hold, shape (n,) each: by these, a row that was written twice is told from a stamp that
        is repeated, and a logger that writes what changed from one that lost samples.
    """
    known = np.array(sorted(breaks), dtype=np.int64) - 1
    findings = []
    doubled = doubled_rows(time_s, values) if values else np.zeros(time_s.size, dtype=bool)
    if doubled.any():
        findings += _counted(
            "doubled row(s) (stamp and values of the row before), which count once",
            np.flatnonzero(doubled),
            row,
            word,
        )
    once = np.flatnonzero(~doubled)
    stamps, rows = time_s[once], row[once]
    coarse = shared_stamps(stamps)
    if coarse is not None:
        findings.append(
            f"time stamps rounded to {coarse[0]:.6g} s: about {coarse[1]:.3g} rows share each, and their "
            "instants are taken as even in between"
        )
        stamps = spread_stamps(stamps)
    found = _Intervals(stamps, rows, word, [column[once] for column in values])
    findings += found.findings
    # A doubled row follows its twin: what is before or behind both is before the first, behind the second.
    last_of = np.append(once[1:], time_s.size) - 1
    ends = np.union1d(last_of[found.ends], known)
    lost = {int(last_of[at]): count for at, count in found.lost.items()}
    return Stamps(found.rate_Hz, _segments(time_s.size, ends, lost), tuple(findings))


class _Intervals:
    """The intervals between rows: ``ends``, the rows before breaks; samples ``lost`` there; what to say."""

    def __init__(
        self,
        time_s: NDArray[np.float64],
        row: NDArray[np.int64],
        word: str,
        values: Sequence[NDArray[np.float64]],
    ) -> None:
        self.rate_Hz: float | None = None
        self.lost: dict[int, int] = {}
        self.findings: list[str] = []
        steps = np.diff(time_s)
        forward = steps[steps > 0]
        missing = _counted("missing time stamp(s)", np.flatnonzero(np.isnan(time_s)), row, word)
        if not forward.size:
            self.ends = np.flatnonzero(~(steps > 0))
            self.findings = missing + _counted(
                "time stamp(s) do not advance", np.flatnonzero(steps <= 0) + 1, row, word
            )
            return
        usual = float(forward[forward <= LONG * np.median(forward)].mean())
        long, lasts = steps > LONG * usual, np.full(steps.size, usual)
        uneven = _unevenness(steps, long, usual)
        missed = _by_event(long, values) if _are_many(long) and uneven != "rounded" else None
        stretches = _stretches(steps, usual) if missed is None and uneven != "rounded" else None
        if stretches is not None:
            lasts, changes = stretches
            long = steps > LONG * lasts
            self.findings.append(_changing(changes, lasts, row, word))
        elif uneven or missed is not None:
            usual = float(forward[forward <= _SURELY_GAP * usual].mean())
            lasts = np.full(steps.size, usual)
            apart = f"{usual:.6g} s apart in the mean"
            long = steps > LONG_IF_UNEVEN * usual if missed is None else missed
            self.findings.append(
                f"uneven time stamps, {apart}"
                if missed is None
                else f"rows at uneven instants, {apart}: they were written when something changed"
            )
        self.rate_Hz = 1.0 / usual
        gaps = np.flatnonzero(long)
        for at in gaps.tolist():
            count = max(1, round(min(float(steps[at] / lasts[at]), 2.0 * _COUNTABLE)) - 1)
            if count <= _COUNTABLE:
                self.lost[at] = count
        if gaps.size:
            about = (
                f", about {sum(self.lost.values())} sample(s) missing" if len(self.lost) == gaps.size else ""
            )
            self.findings.append(
                f"{gaps.size} gap(s){about}, the longest {float(steps[gaps].max()):.6g} s; "
                f"the first before {word} {row[gaps[0] + 1]}"
            )
        self.findings += missing
        self.findings += _counted("repeated time stamp(s)", np.flatnonzero(steps == 0) + 1, row, word)
        self.findings += _counted("backward time stamp(s)", np.flatnonzero(steps < 0) + 1, row, word)
        self.ends = np.flatnonzero(long | ~(steps > 0))


def _stretches(
    steps: NDArray[np.float64], usual: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    """Return what is usual about each interval, and the intervals at which that changes; None if it is one.

    About a place, the median of 15 intervals is usual; it changes where it does so by more than half. That
    must explain nine tenths of what is longer or shorter.
    """
    odd = (steps > LONG * usual) | (steps < usual / LONG)
    if steps.size < ABOUT or np.count_nonzero(odd) <= ABOUT // 2:
        return None
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps, ABOUT // 2, mode="reflect"), ABOUT)
    parts = [np.median(windows[first : first + _PIECE], axis=1) for first in range(0, steps.size, _PIECE)]
    about = np.concatenate(parts)
    about = np.where(about > 0.0, about, usual)  # NaN, too
    changes = np.flatnonzero(np.abs(np.diff(np.log(about))) > np.log(LONG)) + 1
    left = _EXPLAINED * np.count_nonzero(odd)
    if not 0 < changes.size <= left or np.count_nonzero(steps > LONG * about) > left:
        return None
    return about, changes


def _changing(
    changes: NDArray[np.int64], lasts: NDArray[np.float64], row: NDArray[np.int64], word: str
) -> str:
    """Return how the rate changes, in words."""
    rates = [f"{1.0 / lasts[at]:.4g} Hz from {word} {row[at]} on" for at in changes[:_MOST_NAMED].tolist()]
    more = f" and {changes.size - _MOST_NAMED} more change(s)" if changes.size > _MOST_NAMED else ""
    first = f"{1.0 / lasts[0]:.4g} Hz"
    return f"the sample rate changes: {first}, {', '.join(rates)}{more}; nothing is missing there"


def _are_many(long: NDArray[np.bool_]) -> bool:
    return bool(np.count_nonzero(long) >= max(_FEW, _FEW_SHARE * long.size))


def _unevenness(
    steps: NDArray[np.float64],
    long: NDArray[np.bool_],
    usual: float,
) -> Literal["", "rounded", "irregular"]:
    """Tell why many intervals are long; nothing where samples are missing, or few of them are long."""
    if not _are_many(long):
        return ""
    kept = steps[(steps > 0) & (steps <= _SURELY_GAP * usual)]
    grid = np.cumsum(kept - kept.mean())
    within = np.count_nonzero(steps[long] <= _SURELY_GAP * usual) > 0.5 * np.count_nonzero(long)
    if within and np.ptp(grid) <= 2.0 * kept.mean():  # one interval to either side
        return "rounded"
    ratio = steps[long] / usual
    return "irregular" if np.median(abs(ratio - np.round(ratio))) > _WHOLE else ""


def _by_event(long: NDArray[np.bool_], values: Sequence[NDArray[np.float64]]) -> NDArray[np.bool_] | None:
    """Return before which rows samples are missing, where rows were written on a change; None where not.

    Then a channel's changes, or the largest of those of all, are alike from row to row and do not grow with
    the interval. What is larger by far was not written when it should have been.
    """
    shares = []
    for column in values:
        change = np.abs(np.diff(column))
        usual = float(np.quantile(change, _USUAL_CHANGE))  # NaN where one is missing
        if usual > 0.0:
            shares.append(change / usual)
    if len(shares) > 1:
        shares.append(np.max(np.stack(shares), axis=0))
    for share in shares:
        alike = np.quantile(share, 1.0 - _USUAL_CHANGE) >= _LEAST_CHANGE
        if alike and np.median(share[long]) <= _LARGER * np.median(share[~long]):
            return np.asarray(long & (share > _LARGER))
    return None


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
