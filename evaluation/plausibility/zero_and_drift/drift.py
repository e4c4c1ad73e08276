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

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import CycleSeries, RunView, series_of
from bufferstand.foundation.numbers import median

SHARE = 0.03
"""Share of the range of the force over the whole record, from which on a drift is told."""
STEADY = 0.25
"""In each half of the cycles it goes at this share of its mean pace at least, as no relaxation does."""
SURE, TOLD = 3.5, 2.5
"""It is so many times what the scatter of the cycles leaves uncertain: in all, and in steps that tell; of few
cycles more, by Student's distribution (JCGM 100, G.3): four cycles tell little of their scatter."""
_LEAST = 1e-3
"""Ends of a loop are not known better than to this share of its range, however little the cycles scatter."""
_FEWEST = 4
_SETTLING = 2
"""So many cycles are left out at first, of three times as many and more."""


class _Pace(NamedTuple):
    """Even movement of loops [kN] in ``lasts_s``; ``slower``: its slower half over the mean.

    ``least_kN`` is a standard deviation of it that is known beforehand, ``scatter_kN`` one by what ``free``
    degrees of freedom leave of the cycles about a line.
    """

    moved_kN: float
    lasts_s: float
    slower: float
    least_kN: float
    scatter_kN: float
    free: int

    def within(self, sigmas: float) -> float:
        """Return what it may be by chance [kN]."""
        return sigmas * self.least_kN + _student(sigmas, self.free) * self.scatter_kN

    def is_beyond(self, sigmas: float) -> bool:
        """Return whether it is more than it may be by chance; of most runs it is not, whatever the factor."""
        size_kN = abs(self.moved_kN)
        return size_kN > sigmas * (self.least_kN + self.scatter_kN) and size_kN > self.within(sigmas)


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
    whole_s = end_s - start_s
    weights = np.array([pace.lasts_s / (pace.least_kN + pace.scatter_kN) for pace in paces]) ** 2
    weights /= np.sum(weights)
    size = whole_s * float(np.dot(weights, rates))
    least_kN, scatter_kN = (
        whole_s * float(np.linalg.norm(weights * np.array(column) / [pace.lasts_s for pace in paces]))
        for column in zip(*((pace.least_kN, pace.scatter_kN) for pace in paces), strict=True)
    )
    every = _Pace(size, whole_s, 1.0, least_kN, scatter_kN, sum(pace.free for pace in paces))
    stated = look.facts.force_uncertainty
    limit = max(SHARE * look.force.span, 0.0 if stated is None else stated.zero or 0.0)
    if abs(size) <= limit or not every.is_beyond(SURE):
        return []
    told = [pace for pace in paces if pace.is_beyond(TOLD)]
    steady = all(pace.moved_kN * size > 0.0 and pace.slower > STEADY for pace in told)
    # A zero that drifts knows of no steps; what slows down from one to the next is a spring that settles.
    mean = size / whole_s
    steady &= all(
        abs(rate - mean) <= pace.within(TOLD) / pace.lasts_s for pace, rate in zip(paces, rates, strict=True)
    )
    if not steady:
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
    free = time.size - 2
    scatter_kN = float(np.sqrt(12.0 * np.dot(left, left) / free / time.size))
    slower = min(one / whole, two / whole) if whole else 0.0
    least_kN = _LEAST * median(series.force_range)
    return _Pace(whole * last, last, slower, least_kN, scatter_kN, free)


def _by_stroke(series: CycleSeries, even: FloatArray, first: int) -> FloatArray:
    """Return how much of the force's movement [kN] goes with that of the stroke, by the loop's stiffness."""
    moved_mm = series.middle_mm[first:] - series.middle_mm[first]
    by_stroke = median(series.force_range[first:] / series.range_mm[first:]) * moved_mm
    return np.where(even * by_stroke > 0.0, np.sign(by_stroke) * np.minimum(abs(even), abs(by_stroke)), 0.0)


@lru_cache(maxsize=256)
def _student(sigmas: float, free: int) -> float:
    """Return the factor of an estimated standard deviation for what so many known ones would hold."""
    from scipy.special import ndtr, stdtrit  # noqa: PLC0415 - slow to import, and seldom needed

    return float(stdtrit(free, ndtr(sigmas)))
