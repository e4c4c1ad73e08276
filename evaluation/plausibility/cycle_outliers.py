"""Cycles that do not belong to the others of their set, though the stroke repeats them."""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import CycleSeries, RunView, series_of
from bufferstand.foundation.numbers import median

SHARE = 0.05
"""Area or force range of a cycle is off those beside it, before and after, by this share …"""
STANDS_OUT = 5.0
"""… and by so many times what these differ by among each other."""
_BESIDE = 2
_FEWEST = 5
_WARMER_K = 2.0
"""A cycle that is so much warmer or colder is another."""
_PAUSE_S = 60.0
"""After a longer rest a spring has recovered: the cycle after it is another."""


def unlike_cycles(look: RunView) -> list[Finding]:
    """Return cycles whose area or force range is far off those of the cycles before and after them.

    Parameters
    ----------
    look : Look
    """
    found = []
    for series in series_of(look):
        if series.index.size < _FEWEST:
            continue
        for name, level in (("area", series.absorbed_J), ("force range", series.force_range)):
            found += [_finding(series, name, row, off) for row, off in _outliers(series, level)]
    return _once(found)


def _outliers(series: CycleSeries, level: FloatArray) -> list[tuple[int, float]]:
    """Return (row, share by which it is off) of cycles that differ from two on either side."""
    scale = median(np.abs(level))
    rows = np.arange(_BESIDE, level.size - _BESIDE)
    if not scale > 0.0 or not rows.size:
        return []
    beside = np.stack([level[rows + k] for k in (-2, -1, 1, 2)])
    off = level[rows] - np.median(beside, axis=0)
    apart = np.ptp(beside, axis=0)
    suspect = (np.abs(off) > SHARE * scale) & (np.abs(off) > STANDS_OUT * apart)
    if not suspect.any():
        return []
    heat_K = series.temperature_C[rows] - np.median(
        [series.temperature_C[rows + k] for k in (-2, -1, 1, 2)], axis=0
    )
    suspect &= ~(np.abs(heat_K) > _WARMER_K)
    suspect &= series.pause_s[rows] <= max(_PAUSE_S, 2.0 * median(series.pause_s))
    return [(row, float(off[row - _BESIDE]) / scale) for row in rows[suspect].tolist()]


def _once(found: list[Finding]) -> list[Finding]:
    """Return one finding a cycle."""
    by_cycle: dict[tuple[int, ...], Finding] = {}
    for finding in found:
        by_cycle.setdefault(finding.cycles, finding)
    return list(by_cycle.values())


def _finding(series: CycleSeries, name: str, row: int, off: float) -> Finding:
    number = int(series.index[row])
    text = (
        f"cycle {number} is unlike those before and after it: its {name} is {off:+.1%} off theirs at the "
        "same stroke; see what happened there: it is left out of means"
    )
    start_s, end_s = float(series.start_s[row]), float(series.end_s[row])
    return Finding("unlike", "force", start_s, end_s, (number,), off, "1", text, "spoils")
