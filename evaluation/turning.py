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
from evaluation.turn_fits import LEAST_POINTS, Fits, best_fits, points_of
from evaluation.turn_sides import IndexArray, Reversal, Side, side_of

_LEVELS = np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5])
"""Widths of the windows tried: samples within this share of the half-cycle's range below the extreme."""
_SPARSE = 12
"""The two widest are only for where 0.2 has fewer samples (20 a cycle), and the last for flanks alone: over
0.3 of its range a sine is no polynomial of fourth degree, and that misfit, three times what noise leaves of a
thousand samples a cycle, would hide in the noise."""

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
    sides = [side_of(time_s, stroke_mm, r, sigma_mm, LEAST_SAMPLES * held) for r in reversals]
    dwells = [plateau(side) for side in sides]
    whole = [
        i for i, side in enumerate(sides) if dwells[i] is None and not (side.open_left or side.open_right)
    ]
    fitted = dict(
        zip(
            whole,
            _fitted(time_s, stroke_mm, [sides[i] for i in whole], [reversals[i] for i in whole]),
            strict=True,
        )
    )
    turns = []
    for i, (reversal, side) in enumerate(zip(reversals, sides, strict=True)):
        dwell, turn = dwells[i], fitted.get(i)
        if dwell is not None:
            turns.append(_rested(dwell, reversal))
        elif side.open_left or side.open_right:
            turns.append(_one_sided(edge_fit(side), side, reversal))
        else:
            turns.append(turn or _extreme(side, reversal))
    return turns


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
    time_s: FloatArray, stroke_mm: FloatArray, sides: Sequence[Side], reversals: Sequence[Reversal]
) -> list[TurningPoint | None]:
    """Return the surest fit of each turn that is on record from both sides; None where there is none."""
    if not sides:
        return []
    edges = np.array([_windows(side) for side in sides])
    sign = np.array([1.0 if r.kind == "upper" else -1.0 for r in reversals])
    turn, level = np.nonzero(edges[:, 1] - edges[:, 0] >= LEAST_POINTS)
    smooth, sharp = (Fits.none(0),) * 2
    if turn.size:
        points = points_of(time_s, stroke_mm, sign[turn], edges[turn, 0, level], edges[turn, 1, level])
        smooth, sharp = best_fits(points, sides[0].sigma)
        smooth.residual[level == _LEVELS.size - 1] = np.inf
    both = [Fits.none(edges[:, 0].size), Fits.none(edges[:, 0].size)]
    place = np.zeros(edges[:, 0].shape, dtype=bool)
    place[turn, level] = True
    for all_rows, found in zip(both, (smooth, sharp), strict=True):
        all_rows.put(place.ravel(), found)
    shape = edges[:, 0].shape
    residual, u, moment, value, u_s = (
        np.concatenate([getattr(fits, name).reshape(shape) for fits in both], axis=1)
        for name in ("residual", "u", "time_s", "value", "u_s")
    )
    height = np.array([side.height for side in sides])
    noise = np.maximum(np.maximum(sides[0].sigma, np.min(residual, axis=1)), 1e-6 * height)
    chosen = _choice(residual / noise[:, None], u, sign)
    turns: list[TurningPoint | None] = []
    for i, (j, side, reversal) in enumerate(zip(chosen.tolist(), sides, reversals, strict=True)):
        if not np.isfinite(residual[i, j]):
            turns.append(None)
            continue
        at_s, stroke = float(moment[i, j]), float(sign[i] * value[i, j])
        index = side.first + _nearest(side.time_s, at_s)
        method: TurnMethod = "polynomial" if j < shape[1] else "lines"
        turns.append(
            TurningPoint(
                at_s,
                at_s,
                stroke,
                stroke,
                reversal.kind,
                index,
                method,
                u_stroke_mm=float(u[i, j]),
                u_time_s=float(u_s[i, j]),
                u_leave_s=float(u_s[i, j]),
            )
        )
    return turns


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


def _windows(side: Side) -> tuple[IndexArray, IndexArray]:
    """Return first and last (excluded) samples of the windows to be fitted, in the record."""
    first, last = side.windows(_LEVELS)
    same = np.zeros(_LEVELS.size, dtype=bool)
    same[1:] = (first[1:] == first[:-1]) & (last[1:] == last[:-1])
    same[-2:] |= last[-3] - first[-3] >= _SPARSE
    last = np.where(same, first, last)
    if np.all((last - first)[:-1] < LEAST_POINTS):  # few samples, or a turn near the end of the record
        at = side.first + side.peak
        first[0] = max(side.first, at - LEAST_POINTS + 1)
        last[0] = min(side.first + side.value.size, at + LEAST_POINTS)
    return first, last
