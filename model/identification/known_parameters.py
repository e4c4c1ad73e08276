"""What a fit says of its own parameters, as the model file keeps it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.model.fit_uncertainty import CURVES, LOGARITHM, FitUncertainty, knot_name
from bufferstand.model.identification.fitting import Solution, curve_transform
from bufferstand.model.identification.laws import LAWS
from bufferstand.model.identification.validation import CycleCheck


def uncertainty_of(solution: Solution, held_out: Sequence[CycleCheck]) -> FitUncertainty:
    """Return the covariance of all that was fitted of the spring, and the errors on held-out cycles.

    The states of the single runs (first temperatures, inner strokes) are left out: the covariance of the rest
    has their share. A parameter that was fitted along without contrast is in it, too.

    Parameters
    ----------
    solution : Solution
    held_out : sequence of CycleCheck
        As foretold by fits that did not see them.
    """
    frame = solution.problem.frame
    columns = np.flatnonzero(solution.free)
    laws = [law for law in LAWS if solution.free[frame.place(law.name)]]
    picked = np.zeros((len(laws), columns.size))
    for row, law in enumerate(laws):
        picked[row, columns == frame.place(law.name)] = 1.0
    transform = np.concatenate([picked, curve_transform(solution)])
    names = [LOGARITHM * (law.kind == "log") + law.name for law in laws]
    names += [knot_name(curve, knot) for curve in CURVES for knot in frame.knots_mm]
    freedom = solution.residuals.size / solution.correlation - columns.size
    return FitUncertainty.of(
        tuple(names),
        transform @ solution.covariance @ transform.T,
        max(freedom, 1.0),
        _missed(held_out),
    )


def _missed(held_out: Sequence[CycleCheck]) -> tuple[int, float, float]:
    """Return number of cycles, rms [kN] of their residuals, and rms as a share of their largest forces."""
    if not held_out:
        return 0, 0.0, 0.0
    rms = np.array([check.rms_kN for check in held_out])
    share = rms / np.array([check.peak_force_kN for check in held_out])
    return len(held_out), float(np.sqrt(np.mean(rms**2))), float(np.sqrt(np.mean(share**2)))
