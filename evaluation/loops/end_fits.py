"""Selects terms and number of points for the force at an end: the surest fit that the noise explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.cycles import CONSISTENT
from bufferstand.evaluation.loops.branch_ends import Windows
from bufferstand.evaluation.numerics import FloatArray, IndexArray

POINTS = np.array([5, 7, 10, 14, 20, 28, 40])
"""Points of the windows that are tried; of a branch of fewer, all that it has."""
MODELS = ((0,), (0, 1), (0, 1, 2), (0, 1, 3), (0, 1, 2, 3))
"""Terms of fits (:class:`bufferstand.evaluation.loops.branch_ends.Windows`)."""
MOVING = (2, 4)
"""Where the speed changes it is a term: what it does would hide in the noise of few samples near the turn."""
STILL = (3,)
"""Elsewhere the force may bend, which would hide in the same way."""
PEAK = (0, 3)
"""At an extreme the force has no slope."""
_RIDGE = 1e-9
"""Where two terms are one, each takes half; it costs 1e-9 of a value."""
_LEAST_NOISE = 1e-7
"""Of the force's span in a window: what is left of an ideal record is no noise."""


_FORCE = 4
"""The force's place behind the terms …"""
Sums = dict[tuple[int, int], FloatArray]
"""… in sums of products of two of these, by their places, the larger one first."""


@dataclass(frozen=True, eq=False)
class EndFit:
    """Fits, any shape: value at the end, its gain of a point's noise, residual, slope by the second term, and
    what the last term takes (the square of the second one, where it is among them).
    """

    value: FloatArray
    gain: FloatArray
    residual: FloatArray
    slope: FloatArray
    bend: FloatArray


@dataclass(frozen=True, eq=False)
class Choice:
    """What was chosen for each end, shape (E,): points, place in :data:`MODELS`, and its doubt [kN]."""

    points: IndexArray
    model: IndexArray
    doubt_kN: FloatArray

    def rows(self, chosen: IndexArray) -> Choice:
        """Return some of them."""
        return Choice(self.points[chosen], self.model[chosen], self.doubt_kN[chosen])


def choose(
    windows: Windows,
    sigma_kN: float,
    sigma_mm: float,
    still: tuple[int, ...] = STILL,
) -> Choice:
    """Return the surest fit of each window that the noise explains.

    Parameters
    ----------
    windows : Windows
    sigma_kN, sigma_mm : float
        Noise of a sample's force and stroke.
    still : tuple of int
        Places in :data:`MODELS` of what is tried where the speed is no term.
    """
    count = windows.count
    points = np.minimum(POINTS, np.maximum(count, 1)[:, None])
    moves = np.any(windows.terms[2] != 0.0, axis=1)
    tried = np.array([*(MOVING if moves.any() else ()), *(still if not moves.all() else ())], dtype=np.intp)
    every = tuple(sorted({term for model in tried for term in MODELS[model]}))
    sums = _sums_of(windows, points, every)
    fits = [_fitted(windows, points, MODELS[model], sums) for model in tried]
    value, gain, residual = (
        np.stack([getattr(one, name) for one in fits], axis=1) for name in ("value", "gain", "residual")
    )
    lines = np.arange(count.size)
    noise = np.hypot(sigma_kN, _steepness(windows) * sigma_mm) / np.sqrt(windows.group)
    spare = points[:, None, :] - np.array([len(MODELS[model]) for model in tried])[:, None]
    allowed = spare >= 1
    allowed[moves] &= np.isin(tried, MOVING)[:, None]
    allowed[~moves] &= np.isin(tried, still)[:, None]
    residual[~allowed] = np.inf
    span = np.ptp(windows.force_kN, axis=1)
    least = np.min(residual, axis=(1, 2), initial=np.inf)
    least[np.isinf(least)] = 0.0
    known = noise
    noise = np.maximum(np.maximum(noise, least), _LEAST_NOISE * span)[:, None, None]
    u = np.maximum(residual, noise) * gain
    explained = residual <= CONSISTENT * noise
    u[~explained] = np.inf
    flat = np.argmin(u.reshape(count.size, -1), axis=1)
    model, at = np.divmod(flat, POINTS.size)
    apart = np.abs(value - value[lines, model, at][:, None, None])
    own = u[lines, model, at]
    beyond = np.where(explained, apart - u, 0.0)
    doubt = np.maximum(np.max(beyond, axis=(1, 2)), 0.0)
    # What more there is than noise is misfit, which the gain carries to the end as it carries noise.
    misfit = np.sqrt(np.maximum(residual[lines, model, at] ** 2 - (CONSISTENT * known) ** 2, 0.0))
    doubt = np.hypot(doubt, misfit * gain[lines, model, at])
    chosen = points[lines, at]
    none = np.isinf(own)
    few = np.minimum(count, 2) - 1  # a line through two samples, the only one, nothing
    model = np.where(none, np.maximum(few, 0), tried[model])
    chosen[none], doubt[none] = np.minimum(count[none], 2), 0.0
    return Choice(chosen, model, doubt)


def _steepness(windows: Windows) -> FloatArray:
    """Return how much the force changes with the stroke about the first ten points [kN/mm], shape (E,)."""
    half = np.minimum(np.maximum(windows.count, 1), 10) // 2
    order = np.arange(windows.force_kN.shape[1])
    near, far = order < half[:, None], (order >= half[:, None]) & (order < 2 * half[:, None])
    force, along = (
        np.sum(np.where(far, column, 0.0) - np.where(near, column, 0.0), axis=1)
        for column in (windows.force_kN, windows.terms[1])
    )
    return np.asarray(np.abs(force / np.where(along == 0.0, np.inf, along)) / windows.reach_mm)


def fit(windows: Windows, points: IndexArray, terms: tuple[int, ...]) -> EndFit:
    """Return fits by some of the terms over the first ``points`` (E, K) of each window, shape (E, K)."""
    return _fitted(windows, points, terms, _sums_of(windows, points, terms))


def _sums_of(windows: Windows, points: IndexArray, terms: tuple[int, ...]) -> Sums:
    """Return the sums of products of terms, and of the force, over the first ``points`` of each window."""
    width = int(np.max(points, initial=1))
    columns = {term: windows.terms[term, :, :width] for term in terms}
    columns[_FORCE] = (windows.force_kN[:, :width] - windows.force_kN[:, :1]) * windows.terms[0, :, :width]
    return _sums(columns, points)


def _fitted(windows: Windows, points: IndexArray, terms: tuple[int, ...], sums: Sums) -> EndFit:
    number = len(terms)
    matrix = [[sums[a, b] for b in terms[: place + 1]] for place, a in enumerate(terms)]
    right, squares = [sums[_FORCE, a] for a in terms], sums[_FORCE, _FORCE]
    found, first = solved(matrix, right, points)
    away = squares - sum(f * r for f, r in zip(found, right, strict=True))
    spare = np.maximum(points - number, 1)
    return EndFit(
        found[0] + windows.force_kN[:, :1],
        np.sqrt(first),
        np.sqrt(np.maximum(away, 0.0) / spare),
        found[1] if number > 1 else np.zeros_like(found[0]),
        found[-1],
    )


def _sums(columns: dict[int, FloatArray], points: IndexArray) -> Sums:
    """Return the sums of products of columns (E, P) over the first ``points`` (E, K) of each row.

    Behind its own points a row has zeros: where all rows are asked for the same windows, one matrix sums all.
    """
    pairs = [(a, b) for a in columns for b in columns if b <= a]
    order = np.arange(columns[_FORCE].shape[1])
    if points.shape[1] == 1:
        inside = (order < points).astype(np.float64)
        own = {name: column * inside for name, column in columns.items()}
        return {(a, b): np.einsum("ij,ij->i", own[a], own[b])[:, None] for a, b in pairs}
    windows = (order[:, None] < POINTS[: points.shape[1]]).astype(np.float64)
    totals = np.stack([columns[a] * columns[b] for a, b in pairs]) @ windows
    return dict(zip(pairs, totals, strict=True))


def solved(
    matrix: list[list[FloatArray]], right: list[FloatArray], count: IndexArray
) -> tuple[list[FloatArray], FloatArray]:
    """Return the solutions of symmetric systems, and the first element of their inverses.

    The library takes ten times as long for so small ones. From the last unknown up to the first, which is the
    value that is asked for: what is left of its own equation is one over that element.
    """
    size = len(right)
    ridge = _RIDGE * np.maximum(count, 1)
    full = [[matrix[max(a, b)][min(a, b)] for b in range(size)] for a in range(size)]
    for a in range(1, size):
        full[a][a] = full[a][a] + ridge
    right = list(right)
    for pivot in range(size - 1, 0, -1):
        for row in range(pivot):
            share = full[row][pivot] / full[pivot][pivot]
            full[row] = [full[row][b] - share * full[pivot][b] for b in range(pivot)] + full[row][pivot:]
            right[row] = right[row] - share * right[pivot]
    least = np.maximum(full[0][0], _RIDGE * np.maximum(count, 1))
    found = [right[0] / least]
    for row in range(1, size):
        rest = right[row] - sum(full[row][b] * found[b] for b in range(row))
        found.append(rest / full[row][row])
    return found, 1.0 / least
