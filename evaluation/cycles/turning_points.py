"""Fitted turning points: the extreme sample of a noisy stroke always overreaches and biases the energies.

Three shapes compete at each reversal, over windows of several widths: a polynomial (smooth turn), two
straight or curved flanks that meet (triangular turn), and a plateau (dwell). The residual decides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from bufferstand.evaluation.cycles.dwells import LEAST_SAMPLES, Dwell, plateau
from bufferstand.evaluation.cycles.fit_selection import FittedTurns, selected
from bufferstand.evaluation.cycles.record_ends import CONSISTENT, EdgeFit, edge_fits
from bufferstand.evaluation.cycles.turn_neighbourhood import (
    Reversal,
    Reversals,
    TurnKind,
    TurnNeighbourhood,
    side_of,
)
from bufferstand.evaluation.cycles.turn_screening import screened
from bufferstand.evaluation.facts import TurningPoint, TurnMethod
from bufferstand.evaluation.numerics import (
    LEAST_POINTS,
    MOST_POINTS,
    UNSURE_POINTS,
    BoolArray,
    Fits,
    FloatArray,
    IndexArray,
    WindowPoints,
    points_of,
    sharp_fits,
    smooth_fits,
)

_LEVELS = np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5])
"""Widths of the windows tried: samples within this share of the half-cycle's range below the extreme."""
_SPARSE = 12
"""The two widest are only for where 0.2 has fewer samples (20 a cycle), and the last for flanks alone: over
0.3 of its range a sine is no polynomial of fourth degree, and that misfit, three times what noise leaves of a
thousand samples a cycle, would hide in the noise."""

_POLYNOMIAL_GAIN, _PARABOLA_GAIN, _FLANKS_GAIN = 2.9, 1.8, 4.5
"""A quartic read inside its window has at least so large a variance, times its samples: 2.98 to 3.5 about the
middle; the parabola through five 1.82; the mean of two parabolas that meet 9 of many samples, 4.8 of eleven,
that of two straight lines 5.7 and more."""

_CORNER_SHOWS = 80.0
"""Times the noise: over a window of such a height the best quartic misses a corner by 3 of it (0.037 of the
height, root mean square)."""
_NO_CORNER = 2.0
"""Times the noise: so little misfit over such a window is no corner's."""

_KINDS: tuple[TurnKind, TurnKind] = ("lower", "upper")
_METHODS: tuple[TurnMethod, TurnMethod] = ("polynomial", "lines")

_FEW_POINTS = 16_384
"""Points of several levels that are fitted together."""
_LIKE_TURNS = 3
"""So many turns of one kind, most of them smooth, speak for the others."""


def fit_turning_points(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    reversals: Reversals,
    sigma_mm: float,
    *,
    held: int = 1,
    averaged: int = 1,
    read: BoolArray | None = None,
) -> list[TurningPoint]:
    """Fit reversals of the stroke.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
    reversals : Reversals
    sigma_mm : float
        Noise of the stroke.
    held : int
        Samples for which a value is held (:func:`bufferstand.evaluation.numerics.reversals.held_samples`).
    averaged : int
        Samples as recorded that each sample is the mean of.
    read : array of bool, shape (N,), optional
        Which samples were read, where others were put into rests
        (:class:`bufferstand.evaluation.record.record.Record`).

    Returns
    -------
    list of TurningPoint
        ``edge`` or ``cut`` when only one side of the turn is on record.
    """
    plain = screened(time_s, stroke_mm, reversals, sigma_mm, _LEVELS, LEAST_SAMPLES * held)
    first, last = _distinct(plain.first, plain.last)
    enough = ~np.all((last - first)[:, :-1] < LEAST_POINTS, axis=1)
    plain_rows = plain.rows[enough]
    others = np.ones(reversals.index.size, dtype=bool)
    others[plain_rows] = False
    alone = np.flatnonzero(others).tolist()
    least_samples = LEAST_SAMPLES * held

    def side(row: int) -> TurnNeighbourhood:
        return side_of(time_s, stroke_mm, reversals.row(row), sigma_mm, least_samples, read)

    sides = {i: side(i) for i in alone}
    dwells = {i: dwell for i, own in sides.items() if (dwell := plateau(own)) is not None}
    whole = [i for i, own in sides.items() if i not in dwells and not (own.open_left or own.open_right)]
    edges = [_windows(sides[i]) for i in whole]
    rows = np.concatenate((plain_rows, np.array(whole, dtype=np.intp)))
    order = np.argsort(rows)
    fitted = _fitted(
        time_s,
        stroke_mm,
        np.concatenate((first[enough], *(a[None] for a, _ in edges)))[order],
        np.concatenate((last[enough], *(b[None] for _, b in edges)))[order],
        np.concatenate((plain.height[enough], [sides[i].height for i in whole]))[order],
        reversals.upper[rows[order]],
        sigma_mm,
        averaged,
    )
    found: list[TurningPoint | None] = [None] * reversals.index.size
    for i, turn in zip(rows[order].tolist(), fitted, strict=True):
        found[i] = turn
    for i, dwell in dwells.items():
        found[i] = _rested(dwell, reversals.row(i))
    cut = [i for i, own in sides.items() if i not in dwells and (own.open_left or own.open_right)]
    for i, fit in zip(cut, edge_fits([sides[i] for i in cut]), strict=True):
        found[i] = _one_sided(fit, sides[i], reversals.row(i))
    return [
        _extreme(sides.get(i) or side(i), reversals.row(i)) if turn is None else turn
        for i, turn in enumerate(found)
    ]


def _rested(dwell: Dwell, reversal: Reversal) -> TurningPoint:
    sign = 1.0 if reversal.kind == "upper" else -1.0
    return TurningPoint(
        time_s=dwell.arrive_s,
        leave_s=dwell.leave_s,
        stroke_mm=sign * dwell.arrive,
        leave_mm=sign * dwell.leave,
        kind=reversal.kind,
        index=dwell.index,
        method="plateau",
        u_stroke_mm=dwell.u,
        u_time_s=dwell.u_arrive_s,
        u_leave_s=dwell.u_leave_s,
    )


def _one_sided(fit: EdgeFit, side: TurnNeighbourhood, reversal: Reversal) -> TurningPoint:
    moment = float(side.time_s[side.peak]) if fit.method == "cut" else fit.time_s
    stroke = fit.value if reversal.kind == "upper" else -fit.value
    index = side.first + _nearest(side.time_s, moment)
    # Where nothing was fitted that has a vertex, the moment is known to a step of the samples.
    u_s = fit.u_s if fit.u_s > 0.0 else side.step_s
    return TurningPoint(moment, moment, stroke, stroke, reversal.kind, index, fit.method, fit.u, u_s, u_s)


def _extreme(side: TurnNeighbourhood, reversal: Reversal) -> TurningPoint:
    """Return the extreme sample of a turn that has too few samples for any fit."""
    at = float(side.time_s[side.peak])
    value = float(side.value[side.peak])
    about = side.value[max(0, side.peak - 1) : side.peak + 2]
    u = max(side.sigma, 0.5 * (value - float(np.max(about[about < value], initial=float(np.min(about))))))
    stroke = value if reversal.kind == "upper" else -value
    return TurningPoint(
        at, at, stroke, stroke, reversal.kind, reversal.index, "polynomial", u, *(side.step_s,) * 2
    )


def _nearest(time_s: FloatArray, moment_s: float) -> int:
    after = int(np.clip(np.searchsorted(time_s, moment_s), 1, time_s.size - 1))
    return after if time_s[after] - moment_s < moment_s - time_s[after - 1] else after - 1


def _fitted(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    first: IndexArray,
    last: IndexArray,
    height: FloatArray,
    upper: BoolArray,
    sigma: float,
    averaged: int,
) -> list[TurningPoint | None]:
    """Return the surest fit of each turn that is on record from both sides; None where there is none.

    ``first`` … ``last`` (excluded), shape (R, L), are the windows tried, ``height`` (R,) that of each turn.
    """
    if not upper.size:
        return []
    sign = np.where(upper, 1.0, -1.0)
    both = _all_fits(time_s, stroke_mm, sign, first, last, height, sigma, averaged)
    own = selected(time_s, stroke_mm, FittedTurns(sign, height, last - first, sigma), *both)
    stroke = sign * own.value
    after = np.clip(np.searchsorted(time_s, own.time_s), 1, time_s.size - 1)
    index = after - (time_s[after] - own.time_s >= own.time_s - time_s[after - 1])
    kinds = [_KINDS[is_upper] for is_upper in upper.tolist()]
    methods = [_METHODS[is_sharp] for is_sharp in own.sharp.tolist()]
    moments, strokes, places, u_x, u_t, blunt = (
        column.tolist() for column in (own.time_s, stroke, index, own.u, own.u_s, own.blunt)
    )
    own_samples = [0.0] * len(moments)
    columns = (moments, moments, strokes, strokes, kinds, places, methods, u_x, u_t, u_t, blunt, own_samples)
    turns: list[TurningPoint | None] = list(map(TurningPoint._make, zip(*columns, strict=True)))
    for row in np.flatnonzero(~own.found).tolist():
        turns[row] = None
    return turns


def _all_fits(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    sign: FloatArray,
    first: IndexArray,
    last: IndexArray,
    height: FloatArray,
    sigma: float,
    averaged: int,
) -> tuple[Fits, Fits]:
    """Return the polynomials and the flanks of all windows that may be the surest, rows of all windows.

    The widest windows come first, and polynomials before flanks. A fit that is consistent with the noise has
    a u that no fit over so much fewer samples can have: such windows are left out. So are flanks where a
    polynomial is consistent over a window so high that a corner would show, or nearly so at a turn most of
    whose kind are smooth.
    """
    size = last - first
    known, least = np.full(sign.size, np.inf), np.maximum(sigma, 1e-6 * height)
    wide = size.copy()
    wide[:, -1] = 0  # the widest is for flanks alone
    no_corner = (_LEVELS * height[:, None] >= _CORNER_SHOWS * least[:, None]) & (size > UNSURE_POINTS)
    found = []
    shapes: tuple[tuple[IndexArray, float, Callable[[WindowPoints], Fits]], ...] = (
        (wide, _POLYNOMIAL_GAIN, lambda points: smooth_fits(points, sigma, averaged)),
        (size, _FLANKS_GAIN, lambda points: sharp_fits(points, sigma)),
    )
    smooth = np.zeros(sign.size, dtype=bool)
    for own, variance, fit in shapes:
        fits = Fits.none(first.size)
        gain = np.where((own >= LEAST_POINTS) & ~smooth[:, None], sigma * least_gain(own, variance), np.inf)
        for levels in _together(np.where(smooth[:, None], 0, own)):
            may = gain[:, levels] < known[:, None]
            rows, columns = np.nonzero(may)
            if not rows.size:
                continue
            at = rows * first.shape[1] + levels.start + columns
            points = points_of(time_s, stroke_mm, sign[rows], first.ravel()[at], last.ravel()[at])
            part = fit(points)
            u = np.full(may.shape, np.inf)
            u[may] = np.where(part.residual <= CONSISTENT * least[rows], part.u, np.inf)
            for level in range(may.shape[1] - 1, -1, -1):
                may[:, level] &= gain[:, levels.start + level] < known
                known = np.where(may[:, level], np.minimum(known, u[:, level]), known)
            smooth |= np.any(may & no_corner[:, levels] & np.isfinite(u), axis=1)
            kept = may[rows, columns]
            fits.put(at[kept], part.rows(kept))
        found.append(fits)
        if own is wide:
            best = np.min(np.where(no_corner, fits.residual.reshape(size.shape), np.inf), axis=1)
            smooth |= _like_most(smooth, best <= _NO_CORNER * least, sign)
    return found[0], found[1]


def _like_most(smooth: BoolArray, nearly: BoolArray, sign: FloatArray) -> BoolArray:
    """Return which turns are nearly smooth, where most turns of their kind are smooth."""
    alike = np.zeros(sign.size, dtype=bool)
    for kind in (-1.0, 1.0):
        own = sign == kind
        if np.count_nonzero(own) >= _LIKE_TURNS and 2 * np.count_nonzero(smooth[own]) > np.count_nonzero(own):
            alike |= own & nearly
    return alike


def _together(size: IndexArray) -> Iterator[slice]:
    """Return the levels of windows (R, L) that are fitted at once, the widest first.

    Many turns are fitted level by level, as what is found over wide windows spares narrow ones. Of few turns,
    to spare the calls is to spare more.
    """
    turns = np.count_nonzero(size >= LEAST_POINTS, axis=0).tolist()
    widest = np.minimum(np.max(size, axis=0, initial=1), MOST_POINTS).tolist()
    stop = size.shape[1]
    while stop > 0:
        start, together, width = stop - 1, turns[stop - 1], widest[stop - 1]
        while start > 0 and (together + turns[start - 1]) * max(width, widest[start - 1]) <= _FEW_POINTS:
            start -= 1
            together, width = together + turns[start], max(width, widest[start])
        yield slice(start, stop)
        stop = start


def least_gain(samples: IndexArray, variance: float) -> FloatArray:
    """Return the least u of a fit over so many samples, for noise of 1."""
    least = np.where(samples > LEAST_POINTS, variance, min(variance, _PARABOLA_GAIN))
    return np.asarray(np.sqrt(least / np.maximum(samples, 1)))


def _distinct(first: IndexArray, last: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Return windows (R, L), each empty that is the same as the one before or that nobody needs."""
    same = np.zeros(first.shape, dtype=bool)
    same[:, 1:] = (first[:, 1:] == first[:, :-1]) & (last[:, 1:] == last[:, :-1])
    same[:, -2:] |= (last[:, -3] - first[:, -3] >= _SPARSE)[:, None]
    return first, np.where(same, first, last)


def _windows(side: TurnNeighbourhood) -> tuple[IndexArray, IndexArray]:
    """Return first and last (excluded) samples of the windows to be fitted, in the record."""
    first, last = (edge[0] for edge in _distinct(*(edge[None] for edge in side.windows(_LEVELS))))
    if np.all((last - first)[:-1] < LEAST_POINTS):  # few samples, or a turn near the end of the record
        at = side.first + side.peak
        first[0] = max(side.first, at - LEAST_POINTS + 1)
        last[0] = min(side.first + side.value.size, at + LEAST_POINTS)
    return first, last
