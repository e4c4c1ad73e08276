"""Errors of the channels: the same in every run, so that no repetition lowers what comes of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.identification import Answer, Experiment, whitened

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SharedErrors:
    """Standard uncertainties of what is wrong with the channels in all runs alike; 0 where nothing is stated.

    Attributes
    ----------
    force_share, stroke_share : float
        Relative error of force and stroke.
    force_zero_kN : float
    reversibility_share : float
        Difference of the force between rising and falling, relative.
    delay_s : float
        Of the force against the stroke.
    sensor_C : float
        Of the specimen's thermometers.
    """

    force_share: float = 0.0
    force_zero_kN: float = 0.0
    reversibility_share: float = 0.0
    delay_s: float = 0.0
    stroke_share: float = 0.0
    sensor_C: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Those that are stated."""
        return tuple(one.name for one in fields(self) if getattr(self, one.name) > 0.0)

    @property
    def stated(self) -> bool:
        """Whether any is."""
        return bool(self.names)


def limit(half_width: float | None) -> float:
    """Return the standard uncertainty of a limit: of a rectangle (JCGM 100, 4.3.7); 0 where there is none."""
    return 0.0 if half_width is None else half_width / math.sqrt(3.0)


def columns(experiment: Experiment, given: Answer, errors: SharedErrors) -> Floats:
    """Return what one standard deviation of each stated error does to an experiment's weighted residuals.

    Returns
    -------
    array, shape (N, errors)
        Rows as :meth:`bufferstand.model.identification.problem.Problem.residuals` orders them, the row that
        joins the first temperatures left out.
    """
    drive, used = experiment.drive, experiment.used
    at, sigma = drive.node[used], drive.force_sigma_kN[used] * experiment.force_factor
    force, stroke, time = given.force_kN, drive.stroke_mm, drive.time_s
    rate = np.gradient(force, np.maximum.accumulate(time + 1e-9 * np.arange(time.size)))
    way = np.diff(stroke)
    slope = np.divide(np.diff(force), way, out=np.zeros_like(way), where=np.abs(way) > 1e-6)
    effect = {
        "force_share": force[at],
        "force_zero_kN": np.ones(at.size),
        "reversibility_share": 0.5 * force[at] * np.sign(np.gradient(stroke)[at]),
        "delay_s": rate[at],
        "stroke_share": np.append(slope, 0.0)[at] * stroke[at],
        "sensor_C": np.zeros(at.size),
    }
    common, half = drive.turn_kN[used] / drive.force_sigma_kN[used], drive.half[at]
    readings = drive.sensor_C.size
    found = []
    for name in errors.names:
        size = getattr(errors, name)
        rows = whitened(size * effect[name] / sigma, common, half)
        read = size / (experiment.sensor_sigma_C * experiment.sensor_factor) if name == "sensor_C" else 0.0
        found.append(np.concatenate([rows, np.full(readings, read)]))
    return np.stack(found, axis=1) if found else np.empty((at.size + readings, 0))
