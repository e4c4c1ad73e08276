"""What a set of runs covers, and why a parameter cannot be had from it, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.identification.drive import Drive
from bufferstand.model.identification.problem import Problem
from bufferstand.model.identification.response import Answer

_INNER_SHARE = 0.5
_STANDING_SHARE = 0.02
"""Below this share of its half stroke's largest speed the spring stands."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CoverageFacts:
    """What the runs cover.

    Attributes
    ----------
    temperature_C : tuple of float
        Lowest and highest temperature of the spring (by the fitted model) while its force was measured.
    has_sensor : bool
        Whether the specimen's temperature was measured at all.
    warming_K, cooling_K : float
        Largest rise, and largest fall, of the temperature within one experiment.
    speed_mm_per_s : tuple of float
        Slowest and fastest half stroke, by mean speed; rests do not count.
    peak_speed_mm_per_s : float
        Largest speed between two nodes.
    frequency_Hz : tuple of float
        One over twice the time of the slowest and of the fastest half stroke.
    same_path_speeds : float
        Largest ratio of speeds between half strokes of about the same ends: what shows a rate effect.
    inner_loops : int
        Half strokes that stay within the inner part of the stroke.
    stroke_mm : float
        Largest stroke.
    force_kN : float
        Largest force.
    """

    temperature_C: tuple[float, float]
    has_sensor: bool
    warming_K: float
    cooling_K: float
    speed_mm_per_s: tuple[float, float]
    peak_speed_mm_per_s: float
    frequency_Hz: tuple[float, float]
    same_path_speeds: float
    inner_loops: int
    stroke_mm: float
    force_kN: float

    @property
    def span_K(self) -> float:  # noqa: N802 - the unit's own letter
        """Get how far the temperatures lie apart at which force was measured [K]."""
        return self.temperature_C[1] - self.temperature_C[0]


def facts_of(problem: Problem, answers: Sequence[Answer]) -> CoverageFacts:
    """Return what the experiments of a problem cover, temperatures by the fitted model."""
    temperatures, warming, cooling, halves, peak = [], 0.0, 0.0, [], 0.0
    top = max(float(np.max(e.drive.stroke_mm)) for e in problem.experiments)
    for experiment, given in zip(problem.experiments, answers, strict=True):
        drive, T = experiment.drive, given.temperature_C
        temperatures.append(T[drive.node[experiment.used]])
        warming = max(warming, float(np.max(T - np.minimum.accumulate(T))))
        cooling = max(cooling, float(np.max(np.maximum.accumulate(T) - T)))
        speeds, took = _motion(drive)
        peak = max(peak, float(np.max(speeds)))
        first = np.flatnonzero(np.diff(drive.half, prepend=-1))
        last = np.append(first[1:], drive.half.size - 1)
        way = np.abs(drive.stroke_mm[last] - drive.stroke_mm[first])
        low = np.minimum(drive.stroke_mm[last], drive.stroke_mm[first])
        moving = (way > 1.0) & (took > 0.0)
        halves.append(np.stack([low, way, way / np.maximum(took, 1e-9), took], axis=1)[moving])
    all_T, table = np.concatenate(temperatures), np.concatenate(halves)
    return CoverageFacts(
        temperature_C=(float(all_T.min()), float(all_T.max())),
        has_sensor=any(e.drive.sensor_C.size > 0 for e in problem.experiments),
        warming_K=warming,
        cooling_K=cooling,
        speed_mm_per_s=(float(table[:, 2].min()), float(table[:, 2].max())),
        peak_speed_mm_per_s=peak,
        frequency_Hz=(0.5 / float(table[:, 3].max()), 0.5 / float(table[:, 3].min())),
        same_path_speeds=_speed_ratio(table),
        inner_loops=int(np.count_nonzero((table[:, 0] > 0.1 * top) & (table[:, 1] < _INNER_SHARE * top))),
        stroke_mm=top,
        force_kN=max(float(np.max(e.drive.force_kN)) for e in problem.experiments),
    )


def _motion(drive: Drive) -> tuple[Floats, Floats]:
    """Return the speed from each node to the next, and how long each half stroke moves [s].

    A rest at either end of a half stroke is none of it.
    """
    dt, dx = np.diff(drive.time_s), np.abs(np.diff(drive.stroke_mm))
    speeds = np.divide(dx, dt, out=np.zeros_like(dx), where=dt > 0.0)
    half = drive.half[1:]
    fastest = np.zeros(int(drive.half.max()) + 1)
    np.maximum.at(fastest, half, speeds)
    moved = speeds > _STANDING_SHARE * fastest[half]
    durations = np.zeros_like(fastest)
    np.add.at(durations, half, np.where(moved, dt, 0.0))
    return speeds, durations[np.unique(drive.half)]


def _speed_ratio(halves: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> float:
    """Return the largest ratio of speeds among half strokes whose ends agree within a tenth of their way."""
    largest = 1.0
    for low, way, speed, _ in halves:
        alike = (np.abs(halves[:, 0] - low) < 0.1 * way) & (np.abs(halves[:, 1] - way) < 0.1 * way)
        largest = max(largest, float(np.max(halves[alike, 2])) / float(speed))
    return largest


LEAST_CONTRAST = {
    "transition_length_mm": ("inner_loops", 1.0),
    "sensitivity_per_K": ("span_K", 3.0),
    "depth_mm": ("span_K", 3.0),
    "loss_sensitivity_per_K": ("span_K", 3.0),
    "capacity_J_per_K": ("warming_K", 2.0),
    "sensor_lag_s": ("warming_K", 2.0),
    "loss_W_per_K": ("cooling_K", 0.5),
    "beta": ("same_path_speeds", 4.0),
    "tau_s": ("same_path_speeds", 4.0),
    "spectrum_per_decade": ("same_path_speeds", 8.0),
}
"""What runs must at least differ in to tell a parameter from another cause, by its name among the facts.

Less of it, and the figure would rest on the form of the model alone: a drift of 2 % passes for 2 K of warming
at c_ts = 0.01 per kelvin, and three equal strokes fit with any L.
"""


def without_contrast(facts: CoverageFacts) -> set[str]:
    """Return the parameters for which the runs do not differ enough."""
    return {name for name, (fact, least) in LEAST_CONTRAST.items() if getattr(facts, fact) < least}


def reason(name: str, facts: CoverageFacts) -> str:
    """Return why a parameter is not identified by runs that cover this much."""
    low, high = facts.temperature_C
    between = (
        f"all runs lie between {low:.0f} and {high:.0f} °C"
        if facts.has_sensor
        else "no temperature of the specimen was measured"
    )
    slow, fast = facts.speed_mm_per_s
    path = (
        f"the same stroke was driven at speeds that differ by a factor of {facts.same_path_speeds:.2g} only "
        f"({slow:.3g} to {fast:.3g} mm/s over all runs)"
        if facts.same_path_speeds < 8.0
        else "the forces show no effect of the rate that is larger than their noise"
    )
    heat = f"the spring warms by {facts.warming_K:.1f} K at most"
    cool = f"it cools by {facts.cooling_K:.1f} K at most while runs of one sitting show it"
    reasons = {
        "transition_length_mm": f"{facts.inner_loops} half strokes lie inside the curves: strokes to the end "
        "alone do not tell it from the loss",
        "sensitivity_per_K": between,
        "depth_mm": f"{between}, too little at small strokes, or c_ts is 0",
        "loss_sensitivity_per_K": between,
        "capacity_J_per_K": heat if facts.has_sensor else between,
        "loss_W_per_K": cool if facts.has_sensor else between,
        "sensor_lag_s": f"{heat}: its sensor has nothing to follow" if facts.has_sensor else between,
        "beta": path,
        "tau_s": path,
        "spectrum_per_decade": path,
    }
    return reasons[name]
