"""What really happened: strokes, figures of each cycle and readings of the standard, from the fine grid.

A figure is an interval (lowest, highest): where words leave room (is a creeping dwell part of the stroke?)
either reading is true.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .figures import Cut, Interval, fastest, harmonics, loop_figures, readings
from .specimens import branches

Array = NDArray[np.float64]
# evaluation/cycles.md, "complete": lower ends agree within 5 % of the range at rests, 2 % where the record
# begins or ends there, 0.3 % where it does so in motion; a little less, so that noise does not decide
AT_REST, AT_THE_RECORDS_END, IN_MOTION = 0.045, 0.018, 0.0025
RESTED_S = 0.2  # a stand's longest reversal in this world: what stands still for longer rests


@dataclass(frozen=True)
class TrueCycle:
    """One stroke and its cycle, numbered as it happened."""

    number: int
    start_s: float  # loading begins
    top_s: float
    leaves_top_s: float
    end_s: float
    whole: bool  # both ends are on the record
    closes: bool  # it is complete by the documents
    figures: dict[str, Interval]
    readings: dict[str, Interval | None]  # of the requirements; None: the stroke did not reach there
    unknown: frozenset[str]  # requirements that need what lies before or behind the record
    fastest_mm_per_s: Interval  # of what is on record
    dwell_s: float
    residual_mm: float  # stroke before loading
    left_mm: float  # stroke after unloading
    pause_s: float | None  # rest since the stroke before
    temperature_C: Interval  # over the cycle
    released_s: float  # from then on the stroke is at its end but for 2e-4 of the range: lag dies away slowly


def find_strokes(x: Array, share: float = 0.05) -> list[tuple[int | None, int, int | None]]:
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
    # a ramp that hardly turns may or may not end a cycle (evaluation/cycles.md: not below 5 %)
    sure = set(find_strokes(x, 0.03)) & set(find_strokes(x, 0.08))
    out: list[TrueCycle] = []
    for k, (low, top, after) in enumerate(found):
        first = 0 if low is None else low
        last = len(x) - 1 if after is None else after
        level = x[top] - 1e-9 * np.ptp(x)
        peak = first + int(np.argmax(x[first : last + 1] >= level))
        i0 = first if low is None else _last_at(x, low, peak)
        j0 = peak + int(np.argmax(x[peak : last + 1] <= np.min(x[peak : last + 1]) + 1e-9 * np.ptp(x)))
        whole = low is not None and after is not None and (low, top, after) in sure
        # what lacks of a cycle where the record begins or ends in motion; one that ends at rest has its end
        ends_moving = after == len(x) - 1 and t[-1] - t[j0] < RESTED_S
        lacks = [float(x[0]) if low == 0 else -np.inf, float(x[-1]) if ends_moving else -np.inf]
        share = (max(lacks) - _least(x, found)) / float(np.ptp(x))
        whole = whole and share < 0.02
        leaves = peak + _stays(x[peak : j0 + 1], x[peak] - 2e-4 * np.ptp(x))
        arrives = i0 + int(np.argmax(x[i0 : peak + 1] >= x[peak] - 2e-4 * np.ptp(x)))
        # over one more cycle its end: the lower turn, where the next loading begins
        next_low = j0 if after is None else _last_at(x, j0, found[k + 1][1]) if k + 1 < len(found) else j0
        cut = Cut(t, x, force, i0, peak, j0, arrives)
        figures = loop_figures(cut) if whole else {}
        if whole and not static:
            rests = t[next_low] - t[j0] > 0.05 * (t[j0] - t[i0])  # which counts for neither cycle
            figures |= harmonics(t, x, force, i0, j0 if rests else next_low)
        span = slice(i0, max(j0, i0 + 1) + 1)
        ends = low in (None, 0) or after in (None, len(x) - 1)
        most = AT_THE_RECORDS_END if ends else AT_REST
        speeds = [fastest(t[part], x[part]) for part in (cut.up, cut.down)]
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
                closes=whole
                and share < IN_MOTION
                and abs(float(x[j0] - x[i0])) < most * float(x[peak] - x[i0]),
                figures=figures,
                readings=readings(cut) if static and low is not None else {},
                unknown=_unknown(cut, whole=whole, static=static and low is not None),
                fastest_mm_per_s=(max(v[0] for v in speeds), max(v[1] for v in speeds)),
                dwell_s=cut.dwell_s(),
                residual_mm=float(x[i0]),
                left_mm=float(x[j0]),
                pause_s=float(t[i0]) - out[-1].end_s if out else None,
                temperature_C=(float(np.min(temperature[span])), float(np.max(temperature[span]))),
                released_s=float(t[peak + int(np.argmax(x[peak : j0 + 1] <= x[j0] + 2e-4 * np.ptp(x)))]),
            )
        )
    return out


def _unknown(cut: Cut, *, whole: bool, static: bool) -> frozenset[str]:
    if whole or not static:
        return frozenset()
    out = {"absorbed-energy-ratio"}
    start = float(cut.x[cut.low])
    if start > 2.0:
        out |= {"preload"}
    if start > 2.0 or cut.low == 0:  # what was stored before the record began is not known
        out |= {"stored-energy"}
    return frozenset(out | {f"force-at-{p}mm" for p in (25, 60, 100) if start > p - 2.5})


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
