"""The model stepped along the strokes as they come, and how its force changes with what may have moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from bufferstand.model.spring import SpringModel
from bufferstand.model.stepper import SpringStepper
from bufferstand.model.twin.fault_kinds import FAULT_KINDS

Floats = NDArray[np.float64]
Places = NDArray[np.intp]

_SHIFT_MM = 0.2
_GAIN = 0.005
_DELAY_S = 0.002
_WARMER_K = 1.0
_FINER = 4
"""Parts of a step between two nodes, where fast viscous branches need the stroke between them."""


@dataclass(frozen=True, eq=False)
class Followed:
    """What the model says at nodes that follow each other.

    Attributes
    ----------
    force_kN, temperature_C : arrays, shape (n,)
        Of the spring.
    sensitivity : array, shape (n, 6)
        Change of the measured force by each of :data:`FAULT_KINDS` [kN per its unit].
    per_K : array, shape (n,)
        Change of the force by the spring's temperature [kN/K].
    """

    force_kN: Floats
    temperature_C: Floats
    sensitivity: Floats
    per_K: Floats


class SteppedTwin:
    """A spring and three neighbours of it, stepped along one history of strokes.

    The neighbours see the stroke with another zero, with another gain, and are one kelvin warmer: persistent
    faults have been there for the whole history, so their traces contain what the spring remembers.

    Parameters
    ----------
    model : SpringModel
        Begins unloaded.
    start_C, ambient_C : float
        Temperature of spring and sensor at the beginning, and of the air.
    """

    def __init__(self, model: SpringModel, start_C: float, ambient_C: float) -> None:
        self.model = model
        self._springs = [
            SpringStepper(model, start_C + warmer, ambient_C) for warmer in (0.0, 0.0, 0.0, _WARMER_K)
        ]
        self._last: tuple[float, float, float] | None = None
        """Time [s], stroke [mm] and force [kN] at the last node."""

    def follow(self, time_s: Floats, stroke_mm: Floats, half: Places) -> Followed:
        """Step to nodes in a row, shape (n,) each; they go on where the last ones ended.

        ``half`` is the number of the half stroke of each node.
        """
        if self._last is None:
            self._last = (float(time_s[0]), 0.0, 0.0)
        begin_s, begin_mm, begin_kN = self._last
        strokes = np.append(begin_mm, stroke_mm)
        times = np.append(begin_s, time_s)
        columns = [
            self._walk(spring, times, way, half)
            for spring, way in zip(
                self._springs,
                (strokes, strokes - _SHIFT_MM, strokes / (1.0 + _GAIN), strokes),
                strict=True,
            )
        ]
        force, temperature = columns[0]
        late = np.interp(time_s - _DELAY_S, times, np.append(begin_kN, force))
        traces = np.stack(
            [
                force,
                force - self._elastic(stroke_mm, temperature),
                np.ones_like(force),
                (columns[1][0] - force) / _SHIFT_MM,
                (columns[2][0] - force) / _GAIN,
                (late - force) / _DELAY_S,
            ],
            axis=1,
        )
        assert traces.shape[1] == len(FAULT_KINDS)
        self._last = (float(time_s[-1]), float(stroke_mm[-1]), float(force[-1]))
        warm = columns[3]
        warmer = np.maximum(warm[1] - temperature, 0.05)
        return Followed(force, temperature, traces, (warm[0] - force) / warmer)

    def _walk(
        self, spring: SpringStepper, times: Floats, strokes: Floats, half: Places
    ) -> tuple[Floats, Floats]:
        """Step one spring; return force and temperature at the nodes behind the first."""
        count = times.size - 1
        found = np.empty((2, count))
        finer = _FINER if self.model.viscous.spectrum_per_decade > 0.0 else 1
        fine_s, fine_mm = _between(times, strokes, half, finer)
        dt = np.maximum(np.diff(fine_s), 0.0).tolist()
        way = fine_mm.tolist()
        for node in range(count):
            for part in range(node * finer, (node + 1) * finer):
                spring.step(way[part + 1], dt[part])
            found[:, node] = spring.force_kN, spring.temperature_C
        return found[0], found[1]

    def _elastic(self, stroke_mm: Floats, temperature_C: Floats) -> Floats:
        """Return the force of F* at the present temperature [kN]: what is above or below it is lost."""
        tables, law = self.model.tables, self.model.temperature
        x = np.clip(stroke_mm, 0.0, tables.end_mm)
        cells = tables.cells_of(x)
        s = 1.0 - law.softening(temperature_C) * tables.at(tables.depth, cells)
        width = tables.at(tables.width, cells) * self.model.width_scale(temperature_C)
        inside = np.asarray(
            s * (tables.at(tables.loading, cells) - (1.0 - tables.at(tables.centre, cells)) * width)
        )
        return np.where(stroke_mm > 0.0, inside, 0.0)


def _between(times: Floats, strokes: Floats, half: Places, finer: int) -> tuple[Floats, Floats]:
    """Return times and strokes with points between the nodes, on a monotone cubic within a half stroke."""
    if finer == 1 or times.size < 4:
        if finer == 1:
            return times, strokes
        inside = np.arange(times.size * finer - finer + 1) / finer
        at = np.arange(times.size, dtype=np.float64)
        return np.interp(inside, at, times), np.interp(inside, at, strokes)
    inside = np.arange((times.size - 1) * finer + 1) / finer
    at = np.arange(times.size, dtype=np.float64)
    fine_s, fine_mm = np.interp(inside, at, times), np.interp(inside, at, strokes)
    halves = np.append(half[:1], half)
    starts = np.flatnonzero(np.diff(halves, prepend=halves[0] - 1))
    for first, last in zip(starts.tolist(), [*starts[1:].tolist(), times.size - 1], strict=True):
        nodes = slice(first, last + 1)
        if last - first >= 2 and np.all(np.diff(times[nodes]) > 0.0):
            part = slice(first * finer, last * finer + 1)
            fine_mm[part] = PchipInterpolator(times[nodes], strokes[nodes])(fine_s[part])
    return fine_s, fine_mm
