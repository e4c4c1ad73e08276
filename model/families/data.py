"""What every family is fitted to: the nodes of a run, its forces and weights, and how warm the spring was."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.identification import (
    Answer,
    CycleCheck,
    Experiment,
    Identification,
    check_cycles,
    cycles_of,
    spectrum_lags,
    whitened,
)
from bufferstand.model.simulation import lag_history
from bufferstand.model.spring import SPECTRUM_TAU_S, TemperatureLaw

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

GRID_TAU_S = tuple(10.0 ** (-3.0 + 0.5 * j) for j in range(13))
"""Relaxation times [s] of every family that has more than one: half decades from 1 ms to 1000 s."""
_SLOW_S = 1.0
"""Faster branches have relaxed when a run begins."""
_INSTANT_S = 1e-4
"""A branch that relaxes so fast shows the speed: lag = time x speed."""


@dataclass(frozen=True, eq=False)
class FamilyData:
    """Nodes of one experiment; arrays of shape (n,) unless another is said.

    Parameters
    ----------
    experiment : Experiment
        Drive and weights.
    x_mm : array
        Strokes within the curves.
    softening : array
        c_ts (T - T_ref) by the fit of our own model: warmth is no difference between families.
    width_scale : array
        1 - c_eta (T - T_ref), likewise.
    depth_mm : float
        alpha, likewise.
    temperature_C : array
        Of the spring, likewise.
    first_lag_mm : float
        x - xi at the first node, likewise: overstress that is left from the run before, in slow branches.
    """

    experiment: Experiment
    x_mm: Floats
    softening: Floats
    width_scale: Floats
    depth_mm: float
    temperature_C: Floats
    first_lag_mm: float = 0.0
    kept: dict[tuple[str, bytes], Floats] = field(default_factory=dict)
    """What a law of the band answered to parameters: curves leave it as it is."""

    @cached_property
    def half_strokes(self) -> tuple[tuple[int, int, int], ...]:
        """First and last node (a turn each) and direction of every half stroke; 0 is a rest."""
        half = self.experiment.drive.half
        starts = np.flatnonzero(np.diff(half, prepend=half[0] - 1))
        ends = np.append(starts[1:], half.size - 1)
        ways = np.sign(self.x_mm[ends] - self.x_mm[starts]).astype(int)
        return tuple(zip(starts.tolist(), ends.tolist(), ways.tolist(), strict=True))

    @cached_property
    def grid_lags(self) -> Floats:
        """Lags [mm] of branches at the times of the grid, shape (13, n)."""
        return self._lags(GRID_TAU_S)

    @cached_property
    def spectrum_lags(self) -> Floats:
        """Lags [mm] of the branches of our flat spectrum, shape (6, n)."""
        return self._lags(SPECTRUM_TAU_S)

    @cached_property
    def speed_mm_per_s(self) -> Floats:
        """Speed of the step before each node."""
        return self.lag(_INSTANT_S) / _INSTANT_S

    def lag(self, tau_s: float) -> Floats:
        """Return x - xi [mm] of a branch with one relaxation time, from rest."""
        first = self.first_lag_mm if tau_s >= _SLOW_S else 0.0
        return lag_history(self.experiment.drive.time_s, self.x_mm, tau_s, first)

    def scaled(self, x_mm: Floats) -> Floats:
        """Return s of eq. (5) at strokes of shape (n,) or (k, n)."""
        return 1.0 + self.softening * np.expm1(-x_mm / self.depth_mm)

    def residuals(self, force_kN: Floats) -> Floats:
        """Return model less measured over noise, at the forces that count."""
        drive, used = self.experiment.drive, self.experiment.used
        sigma = drive.force_sigma_kN[used]
        rest = (force_kN[drive.node[used]] - drive.force_kN[used]) / (sigma * self.experiment.force_factor)
        return whitened(rest, drive.turn_kN[used] / sigma, drive.half[drive.node[used]])

    def checked(self, force_kN: Floats) -> list[CycleCheck]:
        """Return each cycle whose forces all count, measured and by the model."""
        return check_cycles(self.experiment, Answer(force_kN, self.temperature_C, self.temperature_C))

    def with_used(self, used: Mask) -> FamilyData:
        """Return the same nodes with other forces that count."""
        return replace(self, experiment=replace(self.experiment, used=used))

    @property
    def cycles(self) -> int:
        """Number of closed cycles."""
        return len(cycles_of(self.experiment.drive))

    def _lags(self, times_s: Sequence[float]) -> Floats:
        drive = self.experiment.drive
        fast = spectrum_lags(drive.time_s, self.x_mm, drive.half, times_s)
        for number, tau_s in enumerate(times_s):
            if tau_s >= _SLOW_S:  # these begin with what the run before has left
                fast[number] = self.lag(tau_s)
        return fast


def data_of(found: Identification) -> list[FamilyData]:
    """Return what families are fitted to: weights, temperatures and first overstress of our own fit."""
    solution = found.solution
    law, end_mm = found.model.temperature, solution.problem.frame.knots_mm[-1]
    answers = solution.problem.answers(solution.vector)
    found_data = []
    for number, (experiment, given) in enumerate(zip(solution.problem.experiments, answers, strict=True)):
        one = nodes_of(experiment, given.temperature_C, law, end_mm)
        inner = float(solution.vector[solution.problem.inner_place(number)])
        found_data.append(replace(one, first_lag_mm=float(one.x_mm[0]) - inner))
    return found_data


def nodes_of(experiment: Experiment, temperature_C: Floats, law: TemperatureLaw, end_mm: float) -> FamilyData:
    """Return the nodes of an experiment at known temperatures, shape (n,)."""
    warmer = temperature_C - law.reference_C
    return FamilyData(
        experiment=experiment,
        x_mm=np.clip(experiment.drive.stroke_mm, 0.0, end_mm),
        softening=law.softening(temperature_C),
        width_scale=np.maximum(1.0 - law.loss_sensitivity_per_K * warmer, 0.0),
        depth_mm=law.depth_mm,
        temperature_C=temperature_C,
    )
