"""Weighted least squares over a problem, and what the data say about each parameter."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bufferstand.foundation import BadInput
from bufferstand.model.identification.laws import LAWS, NAMES
from bufferstand.model.identification.parameters import bounds, curves_at_knots
from bufferstand.model.identification.problem import Problem

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_COARSE_ROUNDS = 60
_FINE_ROUNDS = 1
_REFUSED = 1e3
IDENTIFIED_SHARE = 0.5
"""A parameter is identified if the runs bring its standard deviation below this share of its range."""
COVERAGE = 1.959963984540054


@dataclass(frozen=True)
class Estimate:
    """One parameter with its 95 % interval.

    Attributes
    ----------
    name, unit : str
    value : float
        Estimate.
    low, high : float or None
        Ends of the interval, within what was allowed; None where the runs do not tell the parameter.
    identified : bool
        False if the runs do not say what it is, and the value is an assumption, or fitted along.
    at_bound : bool
        Whether the estimate lies at the end of what was allowed.
    of_prior : float, optional
        Standard deviation after the runs over that before them (the plausible range); None if not fitted.
    """

    name: str
    unit: str
    value: float
    low: float | None
    high: float | None
    identified: bool = True
    at_bound: bool = False
    of_prior: float | None = None


@dataclass(frozen=True, eq=False)
class Solution:
    """A minimum and its surroundings.

    Attributes
    ----------
    problem : Problem
        With the weights that the residuals demanded.
    vector : array, shape (p,)
    free : array of bool, shape (p,)
    residuals : array, shape (N,)
        Weighted; their mean square is about 1.
    jacobian : array, shape (N, free)
    covariance : array, shape (free, free)
        Of the free entries of the vector.
    correlation : float
        Factor on the variances because residuals in a row resemble each other; 1 if they do not.
    """

    problem: Problem
    vector: Floats
    free: Mask
    residuals: Floats
    jacobian: Floats
    covariance: Floats
    correlation: float


def solve(problem: Problem, start: Floats, free: Mask) -> Solution:
    """Return the least squares over the free entries, with the noise that the residuals show.

    Parameters
    ----------
    problem : Problem
    start : array, shape (p,)
    free : array of bool, shape (p,)

    Raises
    ------
    BadInput
        If there are fewer residuals than free entries, or the model cannot follow the data at all.
    """
    _enough(problem, start, free)
    vector, jacobian = _minimise(problem, start, free, ftol=1e-4, rounds=_COARSE_ROUNDS)
    for _ in range(_FINE_ROUNDS):
        residuals = problem.residuals(vector)
        freedom = 1.0 - np.count_nonzero(free) / residuals.size
        problem = problem.reweighted(residuals, freedom)
        vector, jacobian = _minimise(problem, vector, free, ftol=1e-6, rounds=12)
    residuals = problem.residuals(vector)
    correlation = correlation_factor(problem, residuals)
    covariance = correlation * inverse_normal(jacobian, problem.scales(vector)[free])
    return Solution(problem, vector, free, residuals, jacobian, covariance, correlation)


def _enough(problem: Problem, start: Floats, free: Mask) -> None:
    count, unknown = problem.residuals(start).size, int(np.count_nonzero(free))
    if count <= 2 * unknown:
        raise BadInput(
            f"{count} usable measurements cannot determine {unknown} parameters",
            remedy="give more runs, or fewer knots",
        )


def _minimise(
    problem: Problem, start: Floats, free: Mask, *, ftol: float, rounds: int
) -> tuple[Floats, Floats]:
    """Return the minimum by a bounded trust region, and the Jacobian there."""
    low, high = _bounds(problem)
    scale = problem.scales(start)
    vector = start.copy()
    count = problem.residuals(start).size

    def whole(entries: Floats) -> Floats:
        vector[free] = entries
        return vector

    def fun(entries: Floats) -> Floats:
        try:
            return problem.residuals(whole(entries))
        except BadInput:  # curves that cross on the way: refused, and the step shortened
            return np.full(count, _REFUSED)

    def jac(entries: Floats) -> Floats:
        return problem.jacobian(whole(entries), free)

    inside = np.clip(start[free], low[free] + 1e-9 * scale[free], high[free] - 1e-9 * scale[free])
    found = least_squares(
        fun,
        inside,
        jac=jac,
        bounds=(low[free], high[free]),
        x_scale=scale[free],
        ftol=ftol,
        xtol=1e-6,
        gtol=1e-10,
        max_nfev=rounds,
    )
    if not np.all(np.isfinite(found.fun)) or found.fun[0] == _REFUSED:
        raise BadInput("the model cannot follow these runs", remedy="check units and signs of the records")
    result = start.copy()
    result[free] = found.x
    return result, np.asarray(found.jac, dtype=np.float64)


def _bounds(problem: Problem) -> tuple[Floats, Floats]:
    low, high = bounds(problem.frame)
    runs = len(problem.experiments)
    return (
        np.concatenate([low, np.tile((-100.0, -100.0, 0.0), runs)]),
        np.concatenate([high, np.tile((250.0, 250.0, problem.frame.knots_mm[-1]), runs)]),
    )


def inverse_normal(jacobian: Floats, scale: Floats) -> Floats:
    """Return (JᵀJ)⁻¹ by the SVD of the Jacobian in plausible ranges; what nothing tells of stays finite.

    Parameters
    ----------
    jacobian : array, shape (N, p)
    scale : array, shape (p,)
        Plausible ranges; nothing is known worse than a hundred of them.
    """
    _, singular, rows = np.linalg.svd(jacobian * scale, full_matrices=False)
    inverse = rows.T / np.maximum(singular, 1e-2)
    return np.asarray(inverse @ inverse.T * np.outer(scale, scale))


def correlation_factor(problem: Problem, residuals: Floats) -> float:
    """Return by how much residuals that resemble their neighbours widen the variances; 1 for white ones.

    1 + 2 Σ r_k over the lags at which the autocorrelation of the forces' residuals is significant (below
    which it is taken as white), at most a hundred of them. A model that misses systematically is caught here:
    its residuals run along in the same direction for many samples.
    """
    return correlation_of(
        [
            residuals[place]
            for _, kind, place in problem.groups()
            if kind == "force" and place.stop - place.start
        ]
    )


def correlation_of(parts: Sequence[Floats]) -> float:
    """Return :func:`correlation_factor` of the residuals of several stretches, each in the order of time."""
    count = sum(part.size for part in parts)
    if count < 50:
        return 1.0
    power = sum(float(part @ part) for part in parts)
    total = 1.0
    for lag in range(1, 101):
        shared = sum(float(part[lag:] @ part[:-lag]) for part in parts if part.size > lag)
        r = shared / power
        if r < 3.0 / np.sqrt(count):
            break
        total += 2.0 * r
    return total


def estimates(solution: Solution, untold: Collection[str] = ()) -> list[Estimate]:
    """Return the laws' parameters and the curves at the knots, with their 95 % intervals.

    ``untold`` names parameters that were fitted along but have no interval: nothing in the runs contrasts
    them with the rest, so that their figures rest on the form of the model alone.
    """
    frame, vector = solution.problem.frame, solution.vector
    low, high = _bounds(solution.problem)
    scale = solution.problem.scales(vector)
    sigma = np.zeros(vector.size)
    sigma[solution.free] = np.sqrt(np.diag(solution.covariance))
    at_bound = (vector - low < 1e-4 * scale) | (high - vector < 1e-4 * scale)
    found = []
    for law in LAWS:
        at = frame.place(law.name)
        free = bool(solution.free[at])
        told = free and law.name not in untold
        ends = [
            law.to_value(float(np.clip(vector[at] + side * COVERAGE * sigma[at], low[at], high[at])))
            for side in (-1.0, 1.0)
        ]
        found.append(
            Estimate(
                law.name,
                law.unit,
                law.to_value(float(vector[at])),
                ends[0] if told else None,
                ends[1] if told else None,
                told,
                bool(at_bound[at]),
                float(sigma[at] / scale[at]) if free else None,
            )
        )
    values, spread = curve_spread(solution)
    for name, value, part in zip(("loading", "unloading"), values, spread, strict=True):
        for knot, force, deviation in zip(frame.knots_mm, value, part, strict=True):
            half = COVERAGE * float(deviation)
            found.append(
                Estimate(f"{name}_kN at {knot:g} mm", "kN", float(force), float(force) - half, force + half)
            )
    return found


def curve_spread(solution: Solution) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Return F_l and F_u at the knots, and their standard deviations [kN], shape (n,) each."""
    n = solution.problem.frame.points
    base = np.concatenate(curves_at_knots(solution.problem.frame, solution.vector))
    transform = curve_transform(solution)
    spread = np.sqrt(np.einsum("ij,jk,ik->i", transform, solution.covariance, transform))
    return (base[:n], base[n:]), (spread[:n], spread[n:])


def curve_transform(solution: Solution) -> Floats:
    """Return the derivative of F_l and then F_u at the knots by the free entries, shape (2 n, free)."""
    frame, vector = solution.problem.frame, solution.vector
    n = frame.points
    base = np.concatenate(curves_at_knots(frame, vector))
    scale = solution.problem.scales(vector)
    columns = np.flatnonzero(solution.free)
    transform = np.zeros((2 * n, columns.size))
    for column, place in enumerate(columns.tolist()):
        if place < 2 * n:
            moved = vector.copy()
            step = 1e-6 * scale[place]
            moved[place] += step
            transform[:, column] = (np.concatenate(curves_at_knots(frame, moved)) - base) / step
    return transform


def identified(problem: Problem, vector: Floats, free: Mask, correlation: float = 1.0) -> Mask:
    """Return which of the free entries the experiments say something about, given their plausible ranges.

    ``correlation`` divides the information, as in :func:`correlation_factor`.
    """
    scale = problem.scales(vector)[free]
    jacobian = problem.jacobian(vector, free) * scale
    known = jacobian.T @ jacobian / correlation + np.eye(
        scale.size
    )  # the plausible range is what is known beforehand
    deviation = np.sqrt(np.diag(np.linalg.inv(known)))
    result = free.copy()
    result[free] = deviation < IDENTIFIED_SHARE
    return result


def freeze(problem: Problem, vector: Floats, names: Sequence[str]) -> tuple[Floats, Mask]:
    """Return the vector with what stands for unknown parameters, and the mask of the others."""
    frozen = vector.copy()
    free = np.ones(problem.size, dtype=np.bool_)
    free[problem.frame.size :] = problem.always_free()[problem.frame.size :]
    for name in names:
        law = LAWS[NAMES.index(name)]
        at = problem.frame.place(name)
        frozen[at] = law.to_vector(law.off)
        free[at] = False
    return frozen, free
