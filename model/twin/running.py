"""The twin: a fitted model that is driven by the strokes of a run, and judges every finished cycle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.file import load_model
from bufferstand.model.fit_uncertainty import FitUncertainty
from bufferstand.model.identification import START_SIGMA_K, STATE_RANGES, Drive, cycles_of
from bufferstand.model.spring import SpringModel
from bufferstand.model.twin.alarming import Chart, TwinAlarm
from bufferstand.model.twin.following import Followed, SteppedTwin
from bufferstand.model.twin.judging import CycleJudgement, MeasuredCycle, judge_cycle
from bufferstand.model.twin.parameter_spread import ParameterSpread

Floats = NDArray[np.float64]

RESTED_U_K = 0.3
"""Standard uncertainty of a rested spring's temperature: it is within 0.5 K of its sensor and the air."""
UNDER_LOAD_MM = 1.0
CONTACT_MM = 0.5
"""Forces below this stroke belong to the plate, not to the spring."""
LEAST_RANGE_MM = 2.0
"""Cycles of less stroke say little, and are not judged."""
_LEAST_NODES = 12


@dataclass(frozen=True)
class TwinStep:
    """What came of some nodes: cycles judged, and alarms."""

    judged: tuple[CycleJudgement, ...]
    alarms: tuple[TwinAlarm, ...]


class Twin:
    """A fitted model alongside a specimen.

    Parameters
    ----------
    model : SpringModel
        With what its fit knows (``[fit]`` of its file).

    Raises
    ------
    BadInput
        If nobody says how well it is known, or no cycle was held out from its fit.
    """

    def __init__(self, model: SpringModel) -> None:
        self.model = model
        self._fit = known_fit(model)
        self._spread = ParameterSpread(model, self._fit)
        self._chart = Chart(self._fit.held_out_cycles)
        self._spring: SteppedTwin | None = None
        self._start_C = 0.0
        self._start_u_K = START_SIGMA_K
        self._rested, self._began_s = False, 0.0
        self._known_from_s = -math.inf

    @property
    def cycles(self) -> int:
        """Number of cycles judged so far."""
        return self._chart.cycles

    def begin(self, drive: Drive, start_C: float | None = None) -> None:
        """Begin a run whose spring has a history that nobody knows.

        Parameters
        ----------
        drive : Drive
            Its first nodes and readings: spring and sensor are taken to be as warm as the first readings, or
            as the air where there are none.
        start_C : float, optional
            Temperature of the spring, if it is known better [°C].
        """
        read = float(np.mean(drive.sensor_C[:3])) if drive.sensor_C.size else drive.ambient_C
        self._start_C = read if start_C is None else start_C
        self._start_u_K = RESTED_U_K if drive.rested or start_C is not None else START_SIGMA_K
        self._rested, self._began_s = drive.rested, float(drive.time_s[0])
        self._spring = SteppedTwin(self.model, self._start_C, drive.ambient_C)
        under_load = drive.stroke_mm[0] > UNDER_LOAD_MM
        self._known_from_s = float(drive.time_s[np.argmax(drive.half >= 2)]) if under_load else -math.inf

    def take(self, drive: Drive, after_s: float = -math.inf, until_s: float = math.inf) -> TwinStep:
        """Follow the nodes of a drive, and judge the cycles that are wholly in between.

        Parameters
        ----------
        drive : Drive
            Goes on where the last one ended, in the same clock.
        after_s, until_s : float
            Nodes behind the first and up to the second are followed [s].
        """
        if self._spring is None:
            self.begin(drive)
        assert self._spring is not None
        chosen = np.flatnonzero((drive.time_s > after_s) & (drive.time_s <= until_s))
        if not chosen.size:
            return TwinStep((), ())
        followed = self._spring.follow(drive.time_s[chosen], drive.stroke_mm[chosen], drive.half[chosen])
        first = int(chosen[0])
        judged, alarms = [], []
        for cycle in self._cycles(drive, followed, first, first + chosen.size):
            one = self._judge(cycle)
            judged.append(one)
            if alarm := self._chart.take(one):
                alarms.append(alarm)
        return TwinStep(tuple(judged), tuple(alarms))

    def _judge(self, cycle: MeasuredCycle) -> CycleJudgement:
        parts = self._spread.components(cycle.stroke_mm, cycle.rising, cycle.period_s, cycle.temperature_C)
        return judge_cycle(cycle, parts, self._fit.held_out_rms_share)

    def _cycles(self, drive: Drive, followed: Followed, first: int, end: int) -> list[MeasuredCycle]:
        """Return the closed cycles among followed nodes (places ``first`` to ``end`` of the drive)."""
        used = drive.stroke_mm[drive.node] > CONTACT_MM
        found = []
        for nodes in cycles_of(drive):
            whole = drive.node[nodes]
            kept = nodes[used[nodes]]
            at = drive.node[kept]
            if whole[0] < first or whole[-1] >= end or kept.size < max(_LEAST_NODES, 0.8 * nodes.size):
                continue
            if np.ptp(drive.stroke_mm[at]) < LEAST_RANGE_MM or drive.time_s[at[0]] < self._known_from_s:
                continue
            place = at - first
            warm = self._temperature_u_K(float(followed.temperature_C[place[-1]]))
            found.append(
                MeasuredCycle(
                    run=drive.name_at(float(drive.time_s[at[0]])),
                    start_s=float(drive.time_s[at[0]]),
                    end_s=float(drive.time_s[at[-1]]),
                    stroke_mm=drive.stroke_mm[at],
                    force_kN=drive.force_kN[kept],
                    model_kN=followed.force_kN[place],
                    rising=drive.half[at] == drive.half[at[0]],
                    sigma_kN=drive.force_sigma_kN[kept],
                    turn_kN=drive.turn_kN[kept],
                    sensitivity=followed.sensitivity[place],
                    start_kN=self._start_parts(
                        drive.time_s[at], drive.stroke_mm[at], followed.per_K[place] * warm
                    ),
                    temperature_C=float(np.mean(followed.temperature_C[place])),
                    temperature_u_K=warm,
                )
            )
        return found

    def _start_parts(self, time_s: Floats, stroke_mm: Floats, warm_kN: Floats) -> Floats:
        """Return what the unknown start does to the force [kN], (n, k): warmth; overstress, which fades."""
        if self._rested:
            return warm_kN[:, None]
        tables, viscous = self.model.tables, self.model.viscous
        ends = np.clip([stroke_mm.min(), stroke_mm.max()], 0.0, tables.end_mm)
        middle = tables.at(tables.middle, tables.cells_of(ends))
        slope = float(np.diff(middle)[0] / max(np.diff(ends)[0], 1.0))
        faded = np.exp(-np.maximum(time_s - self._began_s, 0.0) / viscous.tau_s)
        return np.stack([warm_kN, viscous.beta * slope * STATE_RANGES[2] * faded], axis=1)

    def _temperature_u_K(self, temperature_C: float) -> float:  # noqa: N802 - the unit's own letter
        """Return the standard uncertainty of the spring's temperature: of its start, and of its warming."""
        warming = temperature_C - self._start_C
        at = {name: k for k, name in enumerate(self._fit.parameter)}
        relative = [
            self._fit.standard_uncertainty[at[name]]
            for name in ("ln capacity_J_per_K", "ln loss_W_per_K")
            if name in at
        ]
        return math.hypot(self._start_u_K, warming * math.hypot(*relative) if relative else warming)


def known_fit(model: SpringModel) -> FitUncertainty:
    """Return what the fit of a model knows.

    Raises
    ------
    BadInput
        If nobody says it, or no cycle was held out.
    """
    fit = model.stated_fit
    if fit.held_out_cycles == 0:
        raise BadInput(
            f"no cycle was held out from the fit of “{model.name}”: what it misses is not known",
            place="fit.held_out_cycles",
            remedy="fit it again without --no-validation, from runs of three or more cycles",
        )
    return fit


def load_known(path: Path) -> SpringModel:
    """Read a model file by which cycles can be judged.

    Raises
    ------
    BadInput
        If it cannot be read, or :func:`known_fit` refuses it; with the file.
    """
    model = load_model(path)
    try:
        known_fit(model)
    except BadInput as error:
        raise error.of_file(path) from None
    return model


def twin_of_runs(model: SpringModel, drives: list[Drive]) -> tuple[Twin, list[TwinStep]]:
    """Judge recorded runs, each with a start of its own; return the twin and what came of each.

    Parameters
    ----------
    model : SpringModel
    drives : list of Drive
        In the order of time. Runs in a row are joined first, so that warmth goes on.

    Raises
    ------
    BadInput
        As :class:`Twin`.
    """
    twin = Twin(model)
    steps = []
    for drive in drives:
        twin.begin(drive)
        steps.append(twin.take(drive))
    return twin, steps
