"""Figures of similar cycles in order of time, to find changes from cycle to cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view.view import RunView

_ENDS = 0.02
"""Cycles that follow each other are alike if both ends of the stroke agree within this share of it …"""
_RATE = 0.05
"""… of harmonic runs the frequency within this one …"""
_SPEED = 0.25
"""… of others the largest speed of loading."""
_FEWEST = 24
"""Cycles of fewer samples have no extreme force."""


@dataclass(frozen=True, eq=False)
class CycleSeries:
    """Like cycles that follow each other, shape (C,) each.

    ``lower_kN`` and ``upper_kN`` are the least and the greatest force, ``pause_s`` is the rest before,
    ``temperature_C`` the highest in the cycle (NaN: not known), ``low_mm`` and ``range_mm`` say where the
    stroke goes.
    """

    index: NDArray[np.intp]
    start_s: FloatArray
    end_s: FloatArray
    lower_kN: FloatArray
    upper_kN: FloatArray
    absorbed_J: FloatArray
    pause_s: FloatArray
    temperature_C: FloatArray
    low_mm: FloatArray
    range_mm: FloatArray

    @property
    def force_range(self) -> FloatArray:
        """Greatest less least force [kN]."""
        return self.upper_kN - self.lower_kN

    @property
    def middle(self) -> FloatArray:
        """Mean of greatest and least force [kN]."""
        return 0.5 * (self.upper_kN + self.lower_kN)

    @property
    def middle_mm(self) -> FloatArray:
        """Middle of the stroke [mm]."""
        return self.low_mm + 0.5 * self.range_mm


def series_of(look: RunView, *, whole_only: bool = False) -> list[CycleSeries]:
    """Return the complete cycles of a run, cut where a cycle is not like the one before it.

    Parameters
    ----------
    look : Look
    whole_only : bool
        Without cycles of which a channel is clipped. Those in which the force is frozen never count.
    """
    table = look.whole_figures if whole_only else look.figures
    if not table.size:
        return []
    times = look.stroke.time_s
    samples = np.searchsorted(times, table[:, 2]) - np.searchsorted(times, table[:, 1])
    table = table[(samples >= _FEWEST) & ~np.isin(table[:, 0], [*look.stood])]
    if not table.size:
        return []
    cuts = np.flatnonzero(_differ(table, harmonic=look.facts.kind == "harmonic")) + 1
    return [
        CycleSeries(part[:, 0].astype(np.intp), *part[:, [1, 2, 3, 4, 5, 6, 10, 7, 8]].T)
        for part in np.split(table, cuts)
    ]


def _differ(table: FloatArray, *, harmonic: bool) -> NDArray[np.bool_]:
    low, span, speed = table[:, 7:10].T
    larger = np.maximum(span[1:], span[:-1])
    ends = np.maximum(np.abs(np.diff(low)), np.abs(np.diff(low + span)))
    pace, most = (table[:, 2] - table[:, 1], _RATE) if harmonic else (speed, _SPEED)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((ends > _ENDS * larger) | (np.abs(np.diff(np.log(pace))) > np.log1p(most)))
