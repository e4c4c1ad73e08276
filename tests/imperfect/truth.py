"""What really happened: strokes, figures of each cycle and readings of the standard, from the fine grid.

A figure is an interval (lowest, highest): where words leave room (is a creeping dwell part of the stroke?)
either reading is true.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .figures import Cut, Interval, harmonics, loop_figures, readings
from .specimens import branches

Array = NDArray[np.float64]
CLOSES = 0.019


@dataclass(frozen=True)
class TrueCycle:
    """One stroke and its cycle, numbered as it happened."""

    number: int
    start_s: float  # loading begins
    top_s: float
    leaves_top_s: float
    end_s: float
    whole: bool  # both ends are on the record
    closes: bool  # it returns to where it began, as far as the documents ask for
    figures: dict[str, Interval]
    readings: dict[str, float | None]  # of the requirements; None: the stroke did not reach there
    dwell_s: float
    open_J: float  # what closing the loop leaves open of its area
    residual_mm: float  # stroke before loading
    left_mm: float  # stroke after unloading
    pause_s: float | None  # rest since the stroke before
    temperature_C: Interval  # over the cycle


def find_strokes(x: Array, share: float = 0.08) -> list[tuple[int | None, int, int | None]]:
    """Return (lower, upper, lower) turning points by index; None where the record ends before."""
    ends = branches(x)
    if not ends:
        return []
    threshold = share * float(np.ptp(x))
    points = [0] + [i for i, _ in ends]
    turns = [points[0]]
    for i in points[1:]:  # zigzag: keep extremes that a swing of the threshold confirms
        if len(turns) >= 2 and (x[turns[-1]] - x[turns[-2]]) * (x[i] - x[turns[-1]]) >= 0:
            turns[-1] = i
        elif abs(x[i] - x[turns[-1]]) >= threshold:
            turns.append(i)
    out: list[tuple[int | None, int, int | None]] = []
    for k, i in enumerate(turns):
        before = turns[k - 1] if k else None
        after = turns[k + 1] if k + 1 < len(turns) else None
        is_top = (before is not None and x[i] > x[before]) or (
            before is None and after is not None and x[i] > x[after]
        )
        if is_top:
            out.append((before, i, after))
    return out


def cycles(t: Array, x: Array, force: Array, temperature: Array, *, static: bool) -> list[TrueCycle]:
    """Return the cycles between the record's begin and end."""
    found = find_strokes(x)
    out: list[TrueCycle] = []
    for k, (low, top, after) in enumerate(found):
        edge = 0.0015 * float(np.ptp(x))  # what may lack of a cycle at the ends of the record
        first = 0 if low is None else low
        last = len(x) - 1 if after is None else after
        level = x[top] - 1e-9 * np.ptp(x)
        peak = first + int(np.argmax(x[first : last + 1] >= level))
        i0 = first if low is None else _last_at(x, low, peak)
        j0 = peak + int(np.argmax(x[peak : last + 1] <= np.min(x[peak : last + 1]) + 1e-9 * np.ptp(x)))
        whole = low is not None and after is not None
        if low is not None and low == 0 and x[0] > _least(x, found) + edge:
            whole = False
        if after is not None and after == len(x) - 1 and x[-1] > _least(x, found) + edge:
            whole = False
        leaves = peak + _stays(x[peak : j0 + 1], x[peak] - 2e-4 * np.ptp(x))
        arrives = i0 + int(np.argmax(x[i0 : peak + 1] >= x[peak] - 2e-4 * np.ptp(x)))
        # over one more cycle its end: the lower turn, where the next loading begins
        next_low = j0 if after is None else _last_at(x, j0, found[k + 1][1]) if k + 1 < len(found) else j0
        cut = Cut(t, x, force, i0, peak, j0, arrives)
        figures = loop_figures(cut, static=static) if whole else {}
        if whole and not static:
            figures |= harmonics(t, x, force, i0, next_low)
        span = slice(i0, max(j0, i0 + 1) + 1)
        figures["temperature_start_C"] = (float(temperature[i0]),) * 2
        figures["temperature_max_C"] = (float(np.max(temperature[span])),) * 2
        out.append(
            TrueCycle(
                number=k + 1,
                start_s=float(t[i0]),
                top_s=float(t[peak]),
                leaves_top_s=float(t[leaves]),
                end_s=float(t[j0]),
                whole=whole,
                closes=whole and abs(float(x[j0] - x[i0])) < CLOSES * float(np.ptp(x)),
                figures=figures,
                readings=readings(cut) if static and low is not None else {},
                dwell_s=cut.dwell_s(),
                open_J=float(np.ptp(cut.closings(static=static))),
                residual_mm=float(x[i0]),
                left_mm=float(x[j0]),
                pause_s=float(t[i0]) - out[-1].end_s if out else None,
                temperature_C=(float(np.min(temperature[span])), float(np.max(temperature[span]))),
            )
        )
    return out


def _least(x: Array, found: list[tuple[int | None, int, int | None]]) -> float:
    inner = [x[after] for _, _, after in found[:-1] if after is not None]
    return float(np.median(inner)) if inner else float(np.min(x))


def _last_at(x: Array, low: int, top: int) -> int:
    piece = x[low : top + 1]
    lowest = np.flatnonzero(piece <= piece.min() + 1e-9 * (piece.max() - piece.min() + 1e-12))
    at = low + int(lowest[-1])
    # a rest above a short dip (overshoot) is where loading begins
    rest = (np.abs(np.diff(x[at : top + 1])) < 1e-9) & (x[at:top] < x[at] + 0.1 * np.ptp(piece))
    return at + int(np.flatnonzero(rest)[-1]) + 1 if rest.any() else at


def _stays(x: Array, level: float) -> int:
    below = x < level
    return int(np.argmax(below)) if below.any() else len(x) - 1
