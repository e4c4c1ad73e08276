"""Residuals of a spring model against drives, and how they change with every parameter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.curves import Curves
from bufferstand.model.identification.drive import Drive
from bufferstand.model.identification.laws import LAWS
from bufferstand.model.identification.parameters import STAGE_OF, FixedParts, curves_of, model_of, scales
from bufferstand.model.identification.response import Answer, BandStage, LagStage, answer, spectrum_lags
from bufferstand.model.simulation import lag_history
from bufferstand.model.tables import BandTables

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_STEP = 1e-5
STATES = 3
"""Unknowns of an experiment: first temperatures of mass and sensor [°C], first inner stroke [mm]."""
START_SIGMA_K = 2.0
"""How far the mass of a spring that has not rested may be from its sensor's first readings."""
STATE_RANGES = (2.0 * START_SIGMA_K, 2.0 * START_SIGMA_K, 10.0)
"""Their plausible ranges: the unit of steps and of the SVD."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """One drive with its weights: what the fit sees of a run, or of several that follow each other.

    Parameters
    ----------
    drive : Drive
    rested : bool
        Whether spring and sensor are equally warm at the first node, and no overstress is left.
    used : array of bool, shape (m,)
        Which of the drive's forces count (False: held out, or its state is not known).
    sensor_sigma_C : float
        Noise of the temperature readings, resolution included.
    force_factor, sensor_factor : float
        Factors on the stated noise, found from the residuals.
    """

    drive: Drive
    rested: bool
    used: Mask
    sensor_sigma_C: float = 0.05
    force_factor: float = 1.0
    sensor_factor: float = 1.0

    @property
    def first_C(self) -> float | None:  # noqa: N802 - the unit keeps its capital
        """Mean of the first few readings [°C]; None without a sensor."""
        readings = self.drive.sensor_C[:5]
        return float(np.mean(readings)) if readings.size else None


@dataclass(frozen=True, eq=False)
class _Stages:
    curves: Curves
    tables: BandTables
    bands: tuple[BandStage, ...]
    own_mm: tuple[Floats, ...]
    """Lag of each experiment's own viscous branch: no curve changes it."""
    lags: tuple[LagStage, ...]


class Problem:
    """Weighted residuals of experiments as a function of one vector: the spring, then three states each.

    Parameters
    ----------
    frame : Frame
        What is given.
    experiments : sequence of Experiment
    """

    def __init__(self, frame: FixedParts, experiments: Sequence[Experiment]) -> None:
        self.frame = frame
        self.experiments = tuple(experiments)
        self.size = frame.size + STATES * len(self.experiments)

    def start(self, spring: Floats) -> Floats:
        """Return the whole vector of a spring's vector: every temperature begins at its sensor's."""
        temperatures: list[float] = []
        for experiment in self.experiments:
            first = experiment.first_C
            temperatures += [*[experiment.drive.ambient_C if first is None else first] * 2, 0.0]
        return np.concatenate([spring, temperatures])

    def temperature_places(self, number: int) -> tuple[int, int]:
        """Return where the first temperatures of mass and sensor of an experiment stand in the vector."""
        at = self.frame.size + STATES * number
        return at, at + 1

    def inner_place(self, number: int) -> int:
        """Return where the first inner stroke of an experiment stands in the vector."""
        return self.temperature_places(number)[1] + 1

    def always_free(self) -> Mask:
        """Return which first states are to be found: temperatures only where a sensor was read."""
        free = np.zeros(self.size, dtype=np.bool_)
        for number, experiment in enumerate(self.experiments):
            mass, sensor = self.temperature_places(number)
            read = experiment.drive.sensor_C.size > 0
            free[mass] = read
            free[sensor] = read and not experiment.rested
            free[sensor + 1] = not experiment.rested
        return free

    def scales(self, vector: Floats) -> Floats:
        """Return the plausible range of every entry."""
        return np.concatenate([scales(self.frame, vector), np.tile(STATE_RANGES, len(self.experiments))])

    def answers(self, vector: Floats) -> list[Answer]:
        """Return what the model answers to every experiment's drive.

        Raises
        ------
        BadInput
            If the vector's curves contradict themselves.
        """
        stages = self._stages(vector)
        return [self._answer(vector, number, stages) for number in range(len(self.experiments))]

    def residuals(self, vector: Floats) -> Floats:
        """Return all weighted residuals (model less measurement over noise), shape (N,)."""
        stages = self._stages(vector)
        numbers = range(len(self.experiments))
        return np.concatenate([self._residuals(vector, n, self._answer(vector, n, stages)) for n in numbers])

    def jacobian(self, vector: Floats, free: Mask) -> Floats:
        """Return the derivative of the residuals by the free entries, shape (N, free).

        By forward differences of only those stages that an entry changes; exact zeros elsewhere.
        """
        return self.derivatives(vector, free)[0]

    def derivatives(self, vector: Floats, free: Mask) -> tuple[Floats, Floats]:
        """Return the derivatives of the residuals, and of the states in which the experiments end.

        Returns
        -------
        jacobian : array, shape (N, free)
            As :meth:`jacobian`.
        ends : array, shape (3 E, free)
            Of temperatures of mass and sensor [K] and inner stroke [mm] at the last node of each experiment.
        """
        stages = self._stages(vector)
        warm = [self._answer(vector, n, stages) for n in range(len(self.experiments))]
        near = [given.temperature_C for given in warm]
        base = [self._residuals(vector, n, given) for n, given in enumerate(warm)]
        last = [self._end(n, given, stages) for n, given in enumerate(warm)]
        edges = np.cumsum([0, *(part.size for part in base)])
        columns = np.flatnonzero(free)
        result = np.zeros((int(edges[-1]), columns.size))
        ends = np.zeros((STATES * len(self.experiments), columns.size))
        step_of = _STEP * self.scales(vector)
        for column, place in enumerate(columns.tolist()):
            moved = vector.copy()
            moved[place] += step_of[place]
            after = self._changed(moved, place, stages)
            for number in self._touched(place):
                given = self._answer(moved, number, after, near[number])
                part = slice(int(edges[number]), int(edges[number + 1]))
                change = self._residuals(moved, number, given) - base[number]
                result[part, column] = change / step_of[place]
                state = slice(STATES * number, STATES * (number + 1))
                ends[state, column] = (self._end(number, given, after) - last[number]) / step_of[place]
        return result, ends

    def groups(self) -> list[tuple[int, Literal["force", "temperature", "start"], slice]]:
        """Return experiment, kind and place of every group of residuals."""
        found: list[tuple[int, Literal["force", "temperature", "start"], slice]] = []
        at = 0
        for number, experiment in enumerate(self.experiments):
            forces, readings = int(np.count_nonzero(experiment.used)), experiment.drive.sensor_C.size
            found.append((number, "force", slice(at, at + forces)))
            found.append((number, "temperature", slice(at + forces, at + forces + readings)))
            at += forces + readings
            if readings and not experiment.rested:
                found.append((number, "start", slice(at, at + 1)))
                at += 1
        return found

    def reweighted(self, residuals: Floats, freedom: float) -> Problem:
        """Return the same problem with noise as large as the residuals show, one factor a quantity.

        ``freedom`` is the share of residuals that the parameters leave free.
        """
        factor: dict[str, float] = {}
        for kind in ("force", "temperature"):
            parts = [residuals[place] for _, which, place in self.groups() if which == kind]
            together = np.concatenate(parts) if parts else np.empty(0)
            factor[kind] = float(np.sqrt(np.mean(together**2) / freedom)) if together.size > 10 else 1.0
        return Problem(
            self.frame,
            [
                replace(
                    e,
                    force_factor=e.force_factor * max(factor["force"], 1e-6),
                    sensor_factor=e.sensor_factor * max(factor["temperature"], 1e-6),
                )
                for e in self.experiments
            ],
        )

    def _stages(self, vector: Floats, own_mm: tuple[Floats, ...] | None = None) -> _Stages:
        """Return every stage; ``own_mm``, if the lags of the own branches are known."""
        curves = curves_of(self.frame, vector)
        tables = BandTables.of(curves, self.frame.value(vector, "depth_mm"))
        bands = tuple(BandStage.of(tables, e.drive.stroke_mm) for e in self.experiments)
        own_mm = self._own_lags(vector) if own_mm is None else own_mm
        return _Stages(curves, tables, bands, own_mm, self._lags(vector, bands, own_mm))

    def _own_lags(self, vector: Floats) -> tuple[Floats, ...]:
        tau = self.frame.value(vector, "tau_s")
        firsts = [float(vector[self.temperature_places(n)[1] + 1]) for n in range(len(self.experiments))]
        return tuple(
            lag_history(e.drive.time_s, x, tau, float(x[0]) - first)
            for e, x, first in zip(self.experiments, self._strokes, firsts, strict=True)
        )

    @cached_property
    def _strokes(self) -> tuple[Floats, ...]:
        """Stroke of every experiment within the curves [mm]."""
        return tuple(np.clip(e.drive.stroke_mm, 0.0, self.frame.knots_mm[-1]) for e in self.experiments)

    @cached_property
    def _spectrum(self) -> tuple[Floats, ...]:
        """Lags of the flat spectrum's branches, whose times are fixed: found once."""
        return tuple(
            spectrum_lags(e.drive.time_s, x, e.drive.half)
            for e, x in zip(self.experiments, self._strokes, strict=True)
        )

    def _lags(
        self, vector: Floats, bands: Sequence[BandStage], own_mm: Sequence[Floats]
    ) -> tuple[LagStage, ...]:
        if self.frame.value(vector, "spectrum_per_decade") > 0.0:
            parts = zip(bands, own_mm, self._spectrum, strict=True)
            return tuple(LagStage.looked_up(band, own, fast) for band, own, fast in parts)
        return tuple(LagStage.looked_up(band, own, None) for band, own in zip(bands, own_mm, strict=True))

    def _changed(self, vector: Floats, place: int, stages: _Stages) -> _Stages:
        """Return the stages after one entry has changed: anew only what depends on it."""
        if place >= self.frame.size:
            inner = (place - self.frame.size) % STATES == STATES - 1
            return self._lagged(vector, stages) if inner else stages
        if place < 2 * self.frame.points:
            return self._stages(vector, stages.own_mm)
        stage = STAGE_OF.get(LAWS[place - 2 * self.frame.points].name)
        if stage == "band":
            return self._stages(vector, stages.own_mm)
        return self._lagged(vector, stages) if stage == "lag" else stages

    def _lagged(self, vector: Floats, stages: _Stages) -> _Stages:
        own_mm = self._own_lags(vector)
        return replace(stages, own_mm=own_mm, lags=self._lags(vector, stages.bands, own_mm))

    def _touched(self, place: int) -> Sequence[int]:
        if place < self.frame.size:
            return range(len(self.experiments))
        return ((place - self.frame.size) // STATES,)

    def _answer(self, vector: Floats, number: int, stages: _Stages, near_C: Floats | None = None) -> Answer:
        experiment = self.experiments[number]
        mass, sensor = self.temperature_places(number)
        return answer(
            model_of(self.frame, vector, stages.curves),
            experiment.drive.time_s,
            stages.bands[number],
            stages.lags[number],
            start_C=float(vector[mass]),
            sensor_start_C=float(vector[mass if experiment.rested else sensor]),
            ambient_C=experiment.drive.ambient_C,
            near_C=near_C,
        )

    def _end(self, number: int, given: Answer, stages: _Stages) -> Floats:
        """Return the state at the last node: temperatures of mass and sensor [°C], inner stroke [mm]."""
        inner_mm = self._strokes[number][-1] - stages.own_mm[number][-1]
        return np.array([given.temperature_C[-1], given.sensor_C[-1], inner_mm])

    def _residuals(self, vector: Floats, number: int, given: Answer) -> Floats:
        experiment = self.experiments[number]
        drive, used = experiment.drive, experiment.used
        force = (given.force_kN[drive.node[used]] - drive.force_kN[used]) / (
            drive.force_sigma_kN[used] * experiment.force_factor
        )
        force = whitened(
            force, drive.turn_kN[used] / drive.force_sigma_kN[used], drive.half[drive.node[used]]
        )
        if not drive.sensor_C.size:
            return force
        read = np.interp(drive.sensor_s, drive.time_s, given.sensor_C)
        sensor = (read - drive.sensor_C) / (experiment.sensor_sigma_C * experiment.sensor_factor)
        if experiment.rested:
            return np.concatenate([force, sensor])
        mass, first = self.temperature_places(number)
        start = (vector[mass] - vector[first]) / START_SIGMA_K
        return np.concatenate([force, sensor, [start]])


def whitened(values: Floats, common: Floats, half: NDArray[np.intp]) -> Floats:
    """Return values of unit noise plus one common error a half stroke as values of unit noise.

    The covariance I + c cᵀ of a half stroke has the inverse root I - (1 - 1/√(1 + c²)) c cᵀ / c².
    """
    if not values.size:
        return values
    starts = np.flatnonzero(np.diff(half, prepend=half[0] - 1))
    square = np.add.reduceat(common**2, starts)
    share = np.divide(
        1.0 - 1.0 / np.sqrt(1.0 + square), square, out=np.zeros_like(square), where=square > 1e-12
    )
    pull = share * np.add.reduceat(values * common, starts)
    return np.asarray(values - np.repeat(pull, np.diff(starts, append=half.size)) * common)
