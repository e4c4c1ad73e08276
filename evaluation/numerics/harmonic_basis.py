"""Harmonics of many periods that are sampled alike, by one matrix instead of one fit each.

The matrix depends on where the samples lie in their period, and not on their values. For even samples it
depends on their number and step alone. In a run whose cycles repeat, the step varies by parts in a thousand;
over this range each element of the matrix is a parabola of the step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bufferstand.evaluation.numerics.arrays import BoolArray, FloatArray

_STEPS_ALIKE = 2e-3
"""Steps are alike within this share: over it the parabola is right to 4e-8 of the first harmonic, and to 4e-5
of the tenth."""
_GRID = 5e-4
"""A basis is made for steps that differ by this share, so that runs of one frequency have it in common."""
_NEARLY_ONE_STEP = 0.25
"""Where steps differ by less than this share of that, a straight line is right to 1e-6 and 1e-4 of them."""


@dataclass(frozen=True, eq=False)
class EvenBasis:
    """The solution for points at ``place`` (P,), in steps, whose step is near ``step`` of a period.

    ``middle`` is the place that phases are counted from; ``powers`` (3, P, 2 order + 1) are the terms of the
    solution in powers of the step's deviation, as a share of :data:`_STEPS_ALIKE`.
    """

    place: FloatArray
    middle: float
    step: float
    powers: FloatArray

    @classmethod
    def of(cls, place: FloatArray, step: float, order: int) -> EvenBasis:
        """Prepare the solution for points at places, in steps, that are ``step`` of a period each."""
        middle = 0.5 * float(place[0] + place[-1])
        near = np.array([1.0 - _STEPS_ALIKE, 1.0, 1.0 + _STEPS_ALIKE])
        below, at, above = _solutions(np.outer(near * step, place - middle), order)
        return cls(place, middle, step, np.stack((at, 0.5 * (above - below), 0.5 * (above + below) - at)))

    def suits(self, step: FloatArray) -> BoolArray:
        """Say which steps are alike."""
        return np.asarray(np.abs(step / self.step - 1.0) <= _STEPS_ALIKE)

    def fitted(self, values: FloatArray, first: FloatArray, step: FloatArray) -> FloatArray:
        """Return cosine and sine amplitudes, shape (S + 1, R, order + 1, 2); the last are those of the time.

        Parameters
        ----------
        values : array, shape (S, R, P)
        first, step : arrays, shape (R,)
            Time of the first point since the start of each period, and the step, over its length.
        """
        off = ((step / self.step - 1.0) / _STEPS_ALIKE)[:, None]
        terms = self.powers[:2] if np.max(np.abs(off), initial=0.0) < _NEARLY_ONE_STEP else self.powers
        since = step[:, None] * (self.place - self.place[0]) @ terms
        since[0, :, 0] += first
        solved = sum(
            off**power * np.concatenate((values @ term, since[power][None]))
            for power, term in enumerate(terms)
        )
        order = solved.shape[2] // 2
        phase = 2.0 * np.pi * (first + step * (self.middle - self.place[0]))
        turn = np.exp(1j * phase[:, None] * np.arange(1.0, order + 1.0))
        turned = (solved[..., 1 : order + 1] - 1j * solved[..., order + 1 :]) * np.conj(turn)
        found = np.zeros((*solved.shape[:2], order + 1, 2))
        found[..., 0, 0] = solved[..., 0]
        found[..., 1:, 0], found[..., 1:, 1] = turned.real, -turned.imag
        return found


def basis_for(size: int, points: int, order: int, step: float) -> EvenBasis:
    """Return the basis for periods of ``size`` samples, averaged to ``points`` points, whose step is alike.

    ``step`` is from sample to sample, as a share of the period.
    """
    return _basis(size, points, order, round(math.log(step) / _GRID))


@lru_cache(maxsize=128)
def _basis(size: int, points: int, order: int, number: int) -> EvenBasis:
    ends = np.arange(points + 1) * size // points
    place = np.asarray(0.5 * (ends[1:] + ends[:-1]), dtype=np.float64)
    return EvenBasis.of(place, math.exp(number * _GRID), order)


def _solutions(share: FloatArray, order: int) -> FloatArray:
    """Return the matrices that make values at moments, over the period, the coefficients of 1, cos and sin.

    ``share`` (K, P) are the moments for each of the matrices, shape (K, P, 2 order + 1).
    """
    angle = 2.0 * np.pi * share[..., None] * np.arange(1.0, order + 1.0)
    rows = np.concatenate((np.ones((*share.shape, 1)), np.cos(angle), np.sin(angle)), axis=2)
    weight = np.gradient(share, axis=1)  # an integral over the period, with what is beyond the outermost
    weighted = (rows * weight[..., None]).transpose(0, 2, 1)
    return np.asarray(np.linalg.solve(weighted @ rows, weighted).transpose(0, 2, 1))
