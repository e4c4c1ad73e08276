"""Drift of the force in harmonic runs: loops that move evenly, at both ends, all the time.

Softening, by heat or by use, takes from all forces the same share; a drift moves them by the same amount.
What is left of the middle of a loop when its force range tells the share is the drift. A spring that relaxes
under its prestress moves evenly, too, but fast at first and then less and less. A stroke whose middle moves
takes the force with it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, stdtrit

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import CycleSeries, RunView, series_of
from bufferstand.foundation.numbers import median

SHARE = 0.03
"""Share of the range of the force over the whole record, from which on a drift is told."""
STEADY = 0.25
"""In each half of the cycles it goes at this share of its mean pace at least, as no relaxation does."""
SURE, TOLD = 3.5, 2.5
"""It is so many times what the scatter of the cycles leaves uncertain: in all, and in steps that tell. The
scatter of few cycles is a poor estimate: it counts by so much more as Student's t does (JCGM 100, G.6.4)."""
_LEAST = 1e-3
"""No scatter is taken to be less than this share of the range."""
_FEWEST = 4
_SETTLING = 2
"""So many cycles are left out at first, of three times as many and more."""


class _Pace(NamedTuple):
    """Even movement of loops [kN] in ``lasts_s``; ``slower``: its slower half over the mean.

    ``u_kN`` is its standard deviation by the scatter of the cycles.
    """

    moved_kN: float
    lasts_s: float
    slower: float
    u_kN: float


def drift_of_loops(look: RunView) -> list[Finding]:
    """Return whether the loops of a harmonic run drift.

    Parameters
    ----------
    look : Look
    """
    if look.facts.kind != "harmonic":
        return []
    paces = [
        _pace(series)
        for series in series_of(look, whole_only=True)
        if series.index.size >= _FEWEST and _has_loops(series)
    ]
    if not paces:
        return []
    start_s, end_s = float(look.force.time_s[0]), float(look.force.time_s[-1])
    rates = np.array([pace.moved_kN / pace.lasts_s for pace in paces])
    weights = np.array([pace.lasts_s / pace.u_kN for pace in paces]) ** 2
    size = (end_s - start_s) * float(np.sum(weights * rates) / np.sum(weights))
    u_kN = (end_s - start_s) / float(np.sqrt(np.sum(weights)))
    stated = look.facts.force_uncertainty
    limit = max(SHARE * look.force.span, 0.0 if stated is None else stated.zero or 0.0)
    told = [pace for pace in paces if abs(pace.moved_kN) > TOLD * pace.u_kN]
    steady = all(pace.moved_kN * size > 0.0 and pace.slower > STEADY for pace in told)
    # A zero that drifts knows of no steps; what slows down from one to the next is a spring that settles.
    mean = size / (end_s - start_s)
    steady &= all(
        abs(rate - mean) <= TOLD * pace.u_kN / pace.lasts_s for pace, rate in zip(paces, rates, strict=True)
    )
    if abs(size) <= max(limit, SURE * u_kN) or not steady:
        return []
    text = (
        f"force drifts by {size:+.3g} kN over the record: greatest and least force of the cycles move "
        "evenly, which no softening does: let cell and amplifier settle, and repeat the test"
    )
    cycles = look.all_cycles
    return [Finding("drift", "force", start_s, end_s, cycles, size, "kN", text, "spoils", whole_record=True)]


def _has_loops(series: CycleSeries) -> bool:
    """Say whether the force moves in every cycle: one that stands still drifts nowhere."""
    return bool(np.all(series.force_range > 0.0))


def _pace(series: CycleSeries) -> _Pace:
    first = _SETTLING if series.index.size >= 3 * _SETTLING else 0
    time = 0.5 * (series.start_s + series.end_s)[first:]
    share = series.force_range[first:] / series.force_range[first]
    even = series.middle[first:] - series.middle[first] * share
    even = even - _by_stroke(series, even - even[0], first)
    time = time - time[0]
    half, last = time.size // 2, float(time[-1])
    line, *halves = (
        np.polyfit(time[part], even[part], 1)
        for part in (slice(None), slice(None, half + 1), slice(half, None))
    )
    whole, one, two = (float(fit[0]) for fit in (line, *halves))
    left = even - np.polyval(line, time)
    # Standard deviation of a movement over the whole by what the cycles scatter about the line.
    u_kN = _LEAST * median(series.force_range) + _few(time.size - 2) * float(
        np.sqrt(12.0 * np.dot(left, left) / (time.size - 2) / time.size)
    )
    slower = min(one / whole, two / whole) if whole else 0.0
    return _Pace(whole * last, last, slower, u_kN)


def _by_stroke(series: CycleSeries, even: FloatArray, first: int) -> FloatArray:
    """Return how much of the force's movement [kN] goes with that of the stroke, by the loop's stiffness."""
    moved_mm = series.middle_mm[first:] - series.middle_mm[first]
    by_stroke = median(series.force_range[first:] / series.range_mm[first:]) * moved_mm
    return np.where(even * by_stroke > 0.0, np.sign(by_stroke) * np.minimum(abs(even), abs(by_stroke)), 0.0)


@lru_cache
def _few(degrees_of_freedom: int) -> float:
    """Return how much wider Student's distribution is than the normal one where a drift begins to be told."""
    return float(stdtrit(degrees_of_freedom, ndtr(SURE))) / SURE
