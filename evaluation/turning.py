"""Fitted turning points: the extreme sample of a noisy stroke always overreaches and biases the energies.

Three shapes compete at each reversal, over windows of several widths: a polynomial (smooth turn), two
straight or curved flanks that meet (triangular turn), and a plateau (dwell). The residual decides.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from evaluation.dwells import LEAST_SAMPLES, Dwell, plateau
from evaluation.edges import CONSISTENT, EdgeFit, edge_fit
from evaluation.motion import TurningPoint, TurnMethod
from evaluation.record import FloatArray
from evaluation.turn_fits import LEAST_POINTS, MANY_POINTS, Fits, points_of, sharp_fits, smooth_fits
from evaluation.turn_screen import screened
from evaluation.turn_sides import IndexArray, Reversal, Side, side_of

_LEVELS = np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5])
"""Widths of the windows tried: samples within this share of the half-cycle's range below the extreme."""
_SPARSE = 12
"""The two widest are only for where 0.2 has fewer samples (20 a cycle), and the last for flanks alone: over
0.3 of its range a sine is no polynomial of fourth degree, and that misfit, three times what noise leaves of a
thousand samples a cycle, would hide in the noise."""

_POLYNOMIAL_GAIN, _FLANKS_GAIN = 2.9, 4.5
"""A quartic read inside its window has at least so large a variance, times its samples: 2.98 to 3.5 about the
middle; the mean of two parabolas that meet has 9 of many samples, 4.8 of eleven."""

_LIKE_TURNS = 3
"""So many turns of one kind agree on one window …"""
_MOST_TURNS = 0.8
"""… that suits this share of them …"""
_LIKE_TURNS_SLACK = 1.2
"""… and each of the others but those whose residual is larger still by this factor."""


def fit_turning_points(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    reversals: Sequence[Reversal],
    sigma_mm: float,
    *,
    held: int = 1,
) -> list[TurningPoint]:
    """Fit reversals of the stroke.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
    reversals : sequence of Reversal
    sigma_mm : float
        Noise of the stroke.
    held : int
        Samples for which a value is held (:func:`evaluation.reversals.held_samples`).

    Returns
    -------
    list of TurningPoint
        ``edge`` or ``cut`` when only one side of the turn is on record.
    """
    plain = screened(time_s, stroke_mm, reversals, sigma_mm, _LEVELS)
    first, last = _distinct(plain.first, plain.last)
    enough = ~np.all((last - first)[:, :-1] < LEAST_POINTS, axis=1)
    alone = sorted({*range(len(reversals))} - {*plain.rows[enough].tolist()})
    sides = {i: side_of(time_s, stroke_mm, reversals[i], sigma_mm, LEAST_SAMPLES * held) for i in alone}
    dwells = {i: dwell for i, side in sides.items() if (dwell := plateau(side)) is not None}
    whole = [i for i, side in sides.items() if i not in dwells and not (side.open_left or side.open_right)]
    edges = [_windows(sides[i]) for i in whole]
    rows = np.concatenate((plain.rows[enough], np.array(whole, dtype=np.intp)))
    order = np.argsort(rows)
    fitted = _fitted(
        time_s,
        stroke_mm,
        np.concatenate((first[enough], *(a[None] for a, _ in edges)))[order],
        np.concatenate((last[enough], *(b[None] for _, b in edges)))[order],
        np.concatenate((plain.height[enough], [sides[i].height for i in whole]))[order],
        [reversals[i] for i in rows[order]],
        sigma_mm,
    )
    turns = dict(zip(rows[order].tolist(), fitted, strict=True))
    found = []
    for i, reversal in enumerate(reversals):
        turn = turns.get(i)
        if turn is not None:
            found.append(turn)
            continue
        side = (
            sides[i] if i in sides else side_of(time_s, stroke_mm, reversal, sigma_mm, LEAST_SAMPLES * held)
        )
        if i in dwells:
            found.append(_rested(dwells[i], reversal))
        elif side.open_left or side.open_right:
            found.append(_one_sided(edge_fit(side), side, reversal))
        else:
            found.append(_extreme(side, reversal))
    return found


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


def _one_sided(fit: EdgeFit, side: Side, reversal: Reversal) -> TurningPoint:
    moment = float(side.time_s[side.peak]) if fit.method == "cut" else fit.time_s
    stroke = fit.value if reversal.kind == "upper" else -fit.value
    index = side.first + _nearest(side.time_s, moment)
    # Where nothing was fitted that has a vertex, the moment is known to a step of the samples.
    u_s = fit.u_s if fit.u_s > 0.0 else side.step_s
    return TurningPoint(moment, moment, stroke, stroke, reversal.kind, index, fit.method, fit.u, u_s, u_s)


def _extreme(side: Side, reversal: Reversal) -> TurningPoint:
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
    reversals: Sequence[Reversal],
    sigma: float,
) -> list[TurningPoint | None]:
    """Return the surest fit of each turn that is on record from both sides; None where there is none.

    ``first`` … ``last`` (excluded), shape (R, L), are the windows tried, ``height`` (R,) that of each turn.
    """
    if not reversals:
        return []
    sign = np.array([1.0 if r.kind == "upper" else -1.0 for r in reversals])
    both = _all_fits(time_s, stroke_mm, sign, first, last, height, sigma)
    residual, u, moment, value, u_s = (
        np.concatenate([getattr(fits, name).reshape(first.shape) for fits in both], axis=1)
        for name in ("residual", "u", "time_s", "value", "u_s")
    )
    noise = np.maximum(np.maximum(sigma, np.min(residual, axis=1)), 1e-6 * height)
    chosen = _choice(residual / noise[:, None], u, sign)
    lines = np.arange(sign.size)
    at_s, stroke = moment[lines, chosen], sign * value[lines, chosen]
    after = np.clip(np.searchsorted(time_s, at_s), 1, time_s.size - 1)
    index = after - (time_s[after] - at_s >= at_s - time_s[after - 1])
    columns = (at_s, stroke, index, chosen, u[lines, chosen], u_s[lines, chosen], residual[lines, chosen])
    turns: list[TurningPoint | None] = []
    for reversal, at, x, near, j, u_x, u_t, left in zip(
        reversals, *(column.tolist() for column in columns), strict=True
    ):
        method: TurnMethod = "polynomial" if j < first.shape[1] else "lines"
        is_fit = left < np.inf
        turns.append(
            TurningPoint(at, at, x, x, reversal.kind, near, method, u_x, u_t, u_t) if is_fit else None
        )
    return turns


def _all_fits(
    time_s: FloatArray,
    stroke_mm: FloatArray,
    sign: FloatArray,
    first: IndexArray,
    last: IndexArray,
    height: FloatArray,
    sigma: float,
) -> tuple[Fits, Fits]:
    """Return the polynomials and the flanks of all windows that may be the surest, rows of all windows.

    The widest windows come first. A fit that is consistent with the noise has a u that no fit over so much
    fewer samples can have: such windows are left out.
    """
    shape = first.shape
    smooth, sharp = Fits.none(first.size), Fits.none(first.size)
    known, least = np.full(sign.size, np.inf), np.maximum(sigma, 1e-6 * height)
    size = last - first
    place = np.arange(first.size).reshape(shape)
    for level in range(shape[1] - 1, -1, -1):
        rows = size[:, level] >= LEAST_POINTS
        rows &= sigma * least_gain(size[:, level], _POLYNOMIAL_GAIN) < known
        if not rows.any():
            continue
        points = points_of(time_s, stroke_mm, sign[rows], first[rows, level], last[rows, level])
        at = np.zeros(first.size, dtype=bool)
        if level < shape[1] - 1:  # the widest is for flanks alone
            fits = smooth_fits(points, sigma)
            at[place[rows, level]] = True
            smooth.put(at, fits)
            consistent = fits.residual <= CONSISTENT * least[rows]
            known[rows] = np.minimum(known[rows], np.where(consistent, fits.u, np.inf))
        chosen = sigma * least_gain(size[rows, level], _FLANKS_GAIN) < known[rows]
        if chosen.any():
            fits = sharp_fits(points.rows(chosen), sigma)
            at[:] = False
            at[place[rows, level][chosen]] = True
            sharp.put(at, fits)
            consistent = fits.residual <= CONSISTENT * least[rows][chosen]
            own = np.flatnonzero(rows)[chosen]
            known[own] = np.minimum(known[own], np.where(consistent, fits.u, np.inf))
    return smooth, sharp


def least_gain(samples: IndexArray, variance: float) -> FloatArray:
    """Return the least u of a fit over so many samples, for noise of 1; of a few samples, 0."""
    return np.where(samples >= MANY_POINTS, np.sqrt(variance / np.maximum(samples, 1)), 0.0)


def _choice(misfit: FloatArray, u: FloatArray, sign: FloatArray) -> IndexArray:
    """Return the fit that counts at each turn, by its residual as a share of the noise, and its u.

    A wide window leaves little of the noise, and of a distorted stroke a misfit that just hides in it. If
    neighbouring turns took windows of different width, it would differ between them and make cycles longer
    and shorter: all turns of one kind take the shape and window that suit most of them, where they can.
    """
    chosen = np.asarray(np.argmin(np.where(misfit <= CONSISTENT, u, np.inf), axis=1))
    for kind in (-1.0, 1.0):
        alike = np.flatnonzero(sign == kind)
        if alike.size < _LIKE_TURNS:
            continue
        fits = np.mean(misfit[alike] <= CONSISTENT, axis=0) >= _MOST_TURNS
        if fits.any():
            common = int(np.argmin(np.where(fits, np.median(u[alike], axis=0), np.inf)))
            chosen[alike[misfit[alike, common] <= _LIKE_TURNS_SLACK * CONSISTENT]] = common
    return chosen


def _distinct(first: IndexArray, last: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Return windows (R, L), each empty that is the same as the one before or that nobody needs."""
    same = np.zeros(first.shape, dtype=bool)
    same[:, 1:] = (first[:, 1:] == first[:, :-1]) & (last[:, 1:] == last[:, :-1])
    same[:, -2:] |= (last[:, -3] - first[:, -3] >= _SPARSE)[:, None]
    return first, np.where(same, first, last)


def _windows(side: Side) -> tuple[IndexArray, IndexArray]:
    """Return first and last (excluded) samples of the windows to be fitted, in the record."""
    first, last = (edge[0] for edge in _distinct(*(edge[None] for edge in side.windows(_LEVELS))))
    if np.all((last - first)[:-1] < LEAST_POINTS):  # few samples, or a turn near the end of the record
        at = side.first + side.peak
        first[0] = max(side.first, at - LEAST_POINTS + 1)
        last[0] = min(side.first + side.value.size, at + LEAST_POINTS)
    return first, last
