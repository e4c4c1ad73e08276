"""One cycle against the model: what each kind of fault would have to be, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from bufferstand.model.twin.fault_kinds import FAULT_KINDS

Floats = NDArray[np.float64]

FIGURES = 4.0
"""So many independent figures a cycle has against what the model's form cannot follow."""
COVERAGE = 2.0


@dataclass(frozen=True, eq=False)
class MeasuredCycle:
    """A cycle at its nodes, shape (n,) each: what was measured, and what the model says of the same strokes.

    Attributes
    ----------
    run : str
    start_s, end_s : float
    stroke_mm, force_kN, model_kN : arrays
    rising : array of bool
        Which nodes belong to its loading.
    sigma_kN, turn_kN : arrays
        Noise of a node, and the error that all nodes of a half stroke have from its fitted turn.
    sensitivity : array, shape (n, 6)
    start_kN : array, shape (n, k)
        Components of the force's uncertainty from the state in which the run began: warmth, overstress.
    temperature_C, temperature_u_K : float
        Of the spring by the model, and its standard uncertainty.
    """

    run: str
    start_s: float
    end_s: float
    stroke_mm: Floats
    force_kN: Floats
    model_kN: Floats
    rising: NDArray[np.bool_]
    sigma_kN: Floats
    turn_kN: Floats
    sensitivity: Floats
    start_kN: Floats
    temperature_C: float
    temperature_u_K: float

    @property
    def residual_kN(self) -> Floats:  # noqa: N802 - the unit's own letters
        """Measured less model, shape (n,)."""
        return self.force_kN - self.model_kN

    @property
    def period_s(self) -> float:
        """How long it took."""
        return self.end_s - self.start_s


@dataclass(frozen=True, eq=False)
class CycleJudgement:
    """A cycle, the band round the model, and what each kind of fault would have to be by itself.

    Attributes
    ----------
    cycle : MeasuredCycle
    half_width_kN : array, shape (n,)
        Half width of the band (k = 2): parameters, temperature, what the model misses, noise.
    alone : array, shape (6,)
        Each kind of fault if it were the only one: least squares over the residuals.
    alone_noise, alone_u : array, shape (6,)
        Standard uncertainties: from noise, new in every cycle; and from what stays from cycle to cycle
        (parameters, temperature, form of the model).
    together : array, shape (6,)
        All of them at once, with plausible ranges beforehand, by generalised least squares.
    together_covariance : array, shape (6, 6)
    missed_kN : float
        By how much (rms) the model misses a cycle of this force that is as the fit's.
    """

    cycle: MeasuredCycle
    half_width_kN: Floats
    alone: Floats
    alone_noise: Floats
    alone_u: Floats
    together: Floats
    together_covariance: Floats
    missed_kN: float

    @property
    def share_outside(self) -> float:
        """Share of the nodes whose measured force lies outside the band."""
        return float(np.mean(np.abs(self.cycle.residual_kN) > self.half_width_kN))


def judge_cycle(cycle: MeasuredCycle, parts_kN: Floats, missed_share: float) -> CycleJudgement:
    """Judge a cycle.

    Parameters
    ----------
    cycle : MeasuredCycle
    parts_kN : array, shape (n, k)
        Components of the force's uncertainty from the parameters
        (:meth:`bufferstand.model.twin.parameter_spread.ParameterSpread.components`).
    missed_share : float
        Root mean square of what the model misses, over the cycle's largest force: from held-out cycles.

    Returns
    -------
    CycleJudgement

    Notes
    -----
    What the form of the model misses may run along with any one trace: for a fault by itself it counts in
    full (a bound by Cauchy and Schwarz), for all together as if a cycle had :data:`FIGURES` figures.
    """
    residual, traces = cycle.residual_kN, cycle.sensitivity
    missed = missed_share * float(np.max(cycle.force_kN))
    lasting = np.concatenate([parts_kN, cycle.start_kN], axis=1)
    square = np.maximum(np.sum(traces**2, axis=0), 1e-12)
    weights = traces / square
    turns = np.stack([weights[side].T @ cycle.turn_kN[side] for side in (cycle.rising, ~cycle.rising)])
    noise = np.sqrt(np.sum((weights * cycle.sigma_kN[:, None]) ** 2, axis=0) + np.sum(turns**2, axis=0))
    bound = missed / np.sqrt(square / residual.size)
    u = np.sqrt(np.sum((weights.T @ lasting) ** 2, axis=1) + bound**2)
    together, covariance = _together(cycle, lasting, missed)
    spread = np.sqrt(np.sum(lasting**2, axis=1) + missed**2 + cycle.sigma_kN**2 + cycle.turn_kN**2)
    return CycleJudgement(
        cycle, COVERAGE * spread, weights.T @ residual, noise, u, together, covariance, missed
    )


def _together(cycle: MeasuredCycle, lasting: Floats, missed_kN: float) -> tuple[Floats, Floats]:
    """Return all faults at once and their covariance: generalised least squares with plausible ranges."""
    same = cycle.rising[:, None] == cycle.rising[None, :]
    whole = lasting @ lasting.T + np.outer(cycle.turn_kN, cycle.turn_kN) * same
    size = cycle.stroke_mm.size
    whole[np.diag_indices(size)] += cycle.sigma_kN**2 + missed_kN**2 * size / FIGURES + 1e-12
    factor = cho_factor(whole)
    solved = cho_solve(factor, cycle.sensitivity)
    plausible = np.array([kind.plausible for kind in FAULT_KINDS])
    information = cycle.sensitivity.T @ solved + np.diag(1.0 / plausible**2)
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return covariance @ (solved.T @ cycle.residual_kN), covariance
