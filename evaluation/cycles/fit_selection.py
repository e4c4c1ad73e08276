"""Which of the fits of a turn counts: by residual and uncertainty, and by its samples near the tip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.cycles.record_ends import CONSISTENT
from bufferstand.evaluation.cycles.turn_sharpness import Tips, sharpness
from bufferstand.evaluation.numerics import BoolArray, Fits, FloatArray, IndexArray

_LIKE_TURNS = 3
"""So many turns of one kind agree on one window …"""
_MOST_TURNS = 0.8
"""… that suits this share of them …"""
_LIKE_TURNS_SLACK = 1.2
"""… and each of the others but those whose residual is larger still by this factor."""
_RESOLVED = 9
"""A rounded turn is seen as such by a polynomial over so many samples; of fewer, four tell any shape."""
_BETWEEN_TRIED = 1.0 / 6.0
"""How wide a turn is rounded is tried in steps of a third to a half
(:mod:`bufferstand.evaluation.cycles.turn_sharpness`): what lies between two of them is no nearer known than
half of such a step."""
_ABOVE = 3.0
"""A sample so many of its noise above a fitted turn shows that the stroke went on."""
_LEAST_NOISE = 1e-6
"""Of the height: what is left of an ideal record is no noise."""


@dataclass(frozen=True, eq=False)
class Selected:
    """The fit that counts at each turn, shape (R,): those of
    :class:`bufferstand.evaluation.numerics.shape_fits.Fits`, and more.

    ``value`` is turned as the turns are, ``sharp`` says where flanks count, ``found`` where anything does,
    ``blunt`` by how much a tip may be another (:class:`bufferstand.evaluation.facts.cycle.TurningPoint`).
    """

    time_s: FloatArray
    value: FloatArray
    u: FloatArray
    u_s: FloatArray
    sharp: BoolArray
    found: BoolArray
    blunt: FloatArray


@dataclass(frozen=True, eq=False)
class FittedTurns:
    """Turns, shape (R,), that were fitted: ``sign`` turns lower ones upside down, ``height`` of their lower
    side [mm], samples of each window (R, L), noise of the stroke.
    """

    sign: FloatArray
    height: FloatArray
    samples: IndexArray
    sigma_mm: float


def selected(
    time_s: FloatArray, stroke_mm: FloatArray, turns: FittedTurns, smooth: Fits, sharp: Fits
) -> Selected:
    """Return the fit that counts at each turn.

    Flanks that the samples near their tip contradict do not count, unless polynomials know still less: then
    the tip is lowered by what it is too high.

    Parameters
    ----------
    time_s, stroke_mm : arrays, shape (N,)
    turns : Turns
    smooth, sharp : Fits
        Polynomials and flanks over windows of L widths, R × L rows of each.
    """
    rows, widths = turns.samples.shape
    lines = np.arange(rows)
    both = _Both(smooth, sharp, widths)
    chosen, noise = _choice(both.residual, both.u, turns)
    blunt, lowered = np.zeros((2, rows))
    tips = np.flatnonzero((chosen >= widths) & np.isfinite(both.residual[lines, chosen]))
    if tips.size:
        own = both.tips(tips, chosen[tips], turns.sign, noise)
        rounded, least, most = sharpness(time_s, stroke_mm, own)
        lowered[tips] = 0.5 * (least + most)
        blunt[tips] = np.maximum(0.5 * (most - least), _BETWEEN_TRIED * lowered[tips])
        lowered[tips[~rounded]], blunt[tips[~rounded]] = 0.0, most[~rounded]
        if rounded.any():
            other, known = both.smooth_ones(turns)
            better = tips[rounded & (2.0 * known[tips] < 0.5 * most)]
            chosen[better], blunt[better], lowered[better] = other[better], 0.0, 0.0
    moment_s, u = both.of("time_s", lines, chosen), both.u[lines, chosen]
    value = both.of("value", lines, chosen) - lowered
    highest = _highest(time_s, stroke_mm, moment_s, turns.sign)
    # A turn far below a sample of it is none: it is there, as far as its own uncertainty goes.
    below = highest - _ABOVE * turns.sigma_mm > value
    value[below] = np.minimum(highest - turns.sigma_mm, value + _ABOVE * u)[below]
    return Selected(
        time_s=moment_s,
        value=value,
        u=u,
        u_s=both.of("u_s", lines, chosen),
        sharp=chosen >= widths,
        found=np.isfinite(both.residual[lines, chosen]) & np.isfinite(u),
        blunt=blunt,
    )


def _highest(time_s: FloatArray, stroke_mm: FloatArray, moment_s: FloatArray, sign: FloatArray) -> FloatArray:
    """Return the highest of the samples next to moments, turned as the turns are."""
    near = np.searchsorted(time_s, moment_s)[:, None] + np.arange(-2, 2)
    near = np.clip(near, 0, time_s.size - 1)
    return np.asarray(np.max(sign[:, None] * stroke_mm[near], axis=1))


class _Both:
    """Polynomials and flanks of turns, of L widths each: the columns of ``residual`` and ``u``, (R, 2 L).

    Where no flanks fit at all, these are left out.
    """

    def __init__(self, smooth: Fits, sharp: Fits, widths: int) -> None:
        self._fits, self._widths = (smooth, sharp), widths
        shapes = self._fits if np.isfinite(sharp.residual).any() else self._fits[:1]
        self.residual, self.u = (
            np.concatenate([getattr(fits, name).reshape(-1, widths) for fits in shapes], axis=1)
            for name in ("residual", "u")
        )

    def of(self, name: str, rows: IndexArray, columns: IndexArray) -> FloatArray:
        """Return what the fits of some columns have in some rows."""
        at, sharp = rows * self._widths + columns, columns >= self._widths
        found = np.asarray(getattr(self._fits[0], name)[np.where(sharp, 0, at)])
        found[sharp] = getattr(self._fits[1], name)[at[sharp] - self._widths]
        return found

    def tips(self, rows: IndexArray, columns: IndexArray, sign: FloatArray, noise: FloatArray) -> Tips:
        """Return the tips of flanks."""
        at_s, value, rise, fall, bend = (
            self.of(name, rows, columns) for name in ("time_s", "value", "rise", "fall", "bend")
        )
        return Tips(at_s, value, sign[rows], rise, fall, bend, noise[rows], self.u[rows, columns])

    def smooth_ones(self, turns: FittedTurns) -> tuple[IndexArray, FloatArray]:
        """Return the polynomial that counts at each turn, and its u; infinite where its samples are few."""
        residual = np.where(turns.samples < _RESOLVED, np.inf, self.residual[:, : self._widths])
        chosen, _ = _choice(residual, self.u[:, : self._widths], turns)
        at = np.arange(turns.sign.size), chosen
        return chosen, np.where(np.isfinite(residual[at]), self.u[at], np.inf)


def _choice(residual: FloatArray, u: FloatArray, turns: FittedTurns) -> tuple[IndexArray, FloatArray]:
    """Return the fit that counts at each turn, by its residual as a share of the noise, and that noise.

    A wide window leaves little of the noise, and of a distorted stroke a misfit that just hides in it. If
    neighbouring turns took windows of different width, it would differ between them and make cycles longer
    and shorter: all turns of one kind take the shape and window that suit most of them, where they can.
    """
    least = np.min(residual, axis=1)
    least[np.isinf(least)] = 0.0  # no fit at all: the row has no choice, and is given up
    noise = np.maximum(np.maximum(turns.sigma_mm, least), _LEAST_NOISE * turns.height)
    misfit = residual / noise[:, None]
    known = np.where(misfit <= CONSISTENT, u, np.inf)
    chosen = np.asarray(np.argmin(known, axis=1))
    # What only fits of unknown uncertainty explain, the one explains best that is sure all the same.
    unsure = np.isinf(np.min(known, axis=1))
    if unsure.any():
        worth = np.where(np.isfinite(u[unsure]) & np.isfinite(misfit[unsure]), 0.0, np.inf)
        finite = np.isfinite(worth)
        worth[finite] = misfit[unsure][finite] * u[unsure][finite]
        chosen[unsure] = np.argmin(worth, axis=1)
    for kind in (-1.0, 1.0):
        alike = np.flatnonzero(turns.sign == kind)
        if alike.size < _LIKE_TURNS:
            continue
        fits = np.mean(misfit[alike] <= CONSISTENT, axis=0) >= _MOST_TURNS
        if fits.any():
            candidates = np.flatnonzero(fits)
            common = int(candidates[np.argmin(np.median(u[np.ix_(alike, candidates)], axis=0))])
            chosen[alike[misfit[alike, common] <= _LIKE_TURNS_SLACK * CONSISTENT]] = common
    return chosen, noise
