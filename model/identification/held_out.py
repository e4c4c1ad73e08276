"""Cycles that a fit does not see, and what it says about them: the judge between two models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.identification.fitting import Solution, solve
from bufferstand.model.identification.problem import Experiment, Problem
from bufferstand.model.identification.validation import CycleCheck, check_cycles, cycles_of

HOLD_OUT = 5
"""One cycle in so many is held out for the cross-validation, of runs that have three or more."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class HeldOut:
    """What a fit says about cycles that it did not see.

    Attributes
    ----------
    checks : tuple of CycleCheck
        Each of these cycles as measured and as foretold; empty if none could be held out.
    square : float
        Mean of their squared residuals, weighted as in the fit of all cycles.
    count : int
        Number of these residuals.
    """

    checks: tuple[CycleCheck, ...] = ()
    square: float = 0.0
    count: int = 0


def held_out_of(experiments: Sequence[Experiment]) -> list[Mask]:
    """Return for each experiment which of its forces belong to cycles that are held out."""
    held = []
    for experiment in experiments:
        out = np.zeros(experiment.used.size, dtype=np.bool_)
        cycles = cycles_of(experiment.drive)
        if len(cycles) >= 3:
            for nodes in cycles[HOLD_OUT // 2 :: HOLD_OUT]:
                out[nodes] = True
        held.append(out & experiment.used)
    return held


def cross_validate(solution: Solution, weights: Solution | None = None) -> HeldOut:
    """Fit again without one cycle in five, and look at what the fit says about those.

    Parameters
    ----------
    solution : Solution
        Whose parameters are fitted again.
    weights : Solution, optional
        By whose noise the residuals are weighted, so that two models are measured alike; its own if none.
    """
    problem = solution.problem
    held = held_out_of(problem.experiments)
    if not any(np.any(out) for out in held):
        return HeldOut()
    seen = Problem(
        problem.frame,
        [replace(e, used=e.used & ~out) for e, out in zip(problem.experiments, held, strict=True)],
    )
    fitted = solve(seen, solution.vector, solution.free)
    weighed = (weights or solution).problem.experiments
    judged = Problem(problem.frame, [replace(e, used=out) for e, out in zip(weighed, held, strict=True)])
    rest = judged.residuals(fitted.vector)
    forces = np.concatenate([rest[place] for _, kind, place in judged.groups() if kind == "force"])
    checks = [
        check
        for experiment, given in zip(judged.experiments, judged.answers(fitted.vector), strict=True)
        for check in check_cycles(experiment, given)
    ]
    return HeldOut(tuple(checks), float(np.mean(forces**2)), int(forces.size))
