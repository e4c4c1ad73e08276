"""Compares a spring model with recorded runs: the forces of the recorded strokes, without a fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.record import Record
from bufferstand.model import SpringModel
from bufferstand.model.identification import (
    Answer,
    BandStage,
    CycleCheck,
    Drive,
    LagStage,
    answer,
    check_cycles,
    experiment_of,
    reduce_run,
)

Floats = NDArray[np.float64]

RESTED_K = 0.5
"""A specimen no further from the air than this has rested."""
AT_CONTACT_MM = 1.0
"""A run that never goes beyond this compresses nothing."""
UNKNOWN_C = 20.0
"""Temperature of the air where no sensor tells it."""
KINDS = ("static", "harmonic")
"""Runs that show the spring alone."""


@dataclass(frozen=True, eq=False)
class RunCheck:
    """What the model says to one run: the run's nodes, the answer there, and its closed cycles compared."""

    drive: Drive
    answer: Answer
    cycles: tuple[CycleCheck, ...]
    residual_kN: Floats
    """Model less measured, at the nodes whose forces count."""

    @property
    def largest_force_kN(self) -> float:  # noqa: N802 - the unit's own letters
        """Largest measured force."""
        return float(np.max(self.drive.force_kN))


def drive_of(record: Record, name: str, ambient_C: float | None = None) -> Drive:
    """Reduce a record to what the model is compared with.

    Parameters
    ----------
    record : Record
    name : str
        Of the run.
    ambient_C : float, optional
        Temperature of the air [°C]; that of the run's own sensor if not given, else the specimen's first
        reading, else 20 °C.

    Raises
    ------
    BadInput
        If it has no usable samples.
    """
    specimen = [t for t in record.temperatures if t.role == "specimen" and t.time_s.size > 1]
    air = [t for t in record.temperatures if t.role == "ambient" and t.time_s.size > 0]
    sensor_s, sensor_C = np.empty(0), np.empty(0)
    if specimen:
        first = specimen[0]
        readings = np.array([np.interp(first.time_s, t.time_s, t.temperature_C) for t in specimen])
        good = np.all(np.isfinite(readings), axis=0) & np.isfinite(first.time_s)
        sensor_s, sensor_C = first.time_s[good], readings.mean(axis=0)[good]
    if ambient_C is None and air:
        ambient_C = float(np.nanmean(np.concatenate([t.temperature_C for t in air])))
    if ambient_C is None:
        ambient_C = float(sensor_C[0]) if sensor_C.size else UNKNOWN_C
    if record.time_s.size:
        inside = (sensor_s >= record.time_s[0]) & (sensor_s <= record.time_s[-1])
        sensor_s, sensor_C = sensor_s[inside], sensor_C[inside]
    return reduce_run(
        record.time_s,
        record.stroke_mm,
        record.force_kN,
        sensor_s=sensor_s,
        sensor_C=sensor_C,
        ambient_C=ambient_C,
        rested=bool(sensor_C.size and abs(float(sensor_C[0]) - ambient_C) <= RESTED_K),
        name=name,
    )


def start_temperature_C(drive: Drive) -> float:  # noqa: N802 - the unit's own letter
    """Return the temperature at which a run begins: the mean of the first readings, else that of the air."""
    return float(np.mean(drive.sensor_C[:3])) if drive.sensor_C.size else drive.ambient_C


def answer_to(
    model: SpringModel, drive: Drive, *, start_C: float | None = None, isothermal: bool = False
) -> Answer:
    """Return force and temperatures of the model at the nodes of a run.

    Parameters
    ----------
    model : SpringModel
    drive : Drive
    start_C : float, optional
        Temperature of spring and sensor at the first node [°C]; as measured if not given.
    isothermal : bool
        Keep that temperature, as the paper's Fig. 10 does.
    """
    start = start_temperature_C(drive) if start_C is None else start_C
    band = BandStage.of(model.tables, drive.stroke_mm)
    lag = LagStage.of(band, drive.time_s, model.viscous, half=drive.half)
    return answer(
        model,
        drive.time_s,
        band,
        lag,
        start_C=start,
        sensor_start_C=start,
        ambient_C=start if isothermal else drive.ambient_C,
        isothermal=isothermal,
    )


def check_run(drive: Drive, given: Answer) -> RunCheck:
    """Compare a run with the model's answer, over the forces that count."""
    experiment = experiment_of(drive)
    residual = (given.force_kN[drive.node] - drive.force_kN)[experiment.used]
    return RunCheck(drive, given, tuple(check_cycles(experiment, given)), residual)
