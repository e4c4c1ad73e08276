"""The common input of the wiring checks: the last seconds of the controller, and the facts beside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards.wiring.sample_points import SamplePoints
from bufferstand.daq.guards.wiring.settings import WiringGuard

Floats = NDArray[np.float64]

SLOW_MM_PER_S = 60.0
"""A motion up to this speed is slow: piston and wires are within some millimetres of what is told."""


@dataclass(frozen=True)
class RecentState:
    """A moment of the stand.

    Parameters
    ----------
    points : Points
        Of the controller.
    guard : WiringGuard
        What is expected.
    counted : bool
        Whether strokes, positions and forces count from a zero that was found at first contact.
    specimen_C : float or None
        Of the warmest thermometer on the specimen [°C].
    force_2_kN : float or None
        Newest value of the second force.
    """

    points: SamplePoints
    guard: WiringGuard
    counted: bool
    specimen_C: float | None
    force_2_kN: float | None

    def now(self, name: str) -> float | None:
        """Return the mean of a channel over the newest points; None where there is none."""
        column = self.points.column(name)
        if column is None or not self.points.new:
            return None
        return float(np.mean(self.points.table[-self.points.new :, column]))

    @property
    def way(self) -> str | None:
        """Return the channel that says where the piston is: its own, else what it was told."""
        return next((name for name in ("position", "command") if name in self.points.names), None)

    def speed_mm_per_s(self, name: str, span_s: float = 0.1) -> float:
        """Return how fast a channel changed in the last ``span_s`` [mm/s]; 0 where that is not known."""
        rows, column = self.points.last(span_s), self.points.column(name)
        if column is None or len(rows) < 3:
            return 0.0
        return float((rows[-1, column] - rows[0, column]) / (rows[-1, 0] - rows[0, 0]))

    def exchanged(self, wire: str, at_mm: float) -> bool:
        """Return whether force and a draw wire have each other's values: the one goes the piston's way."""
        force, value, second = self.now("force"), self.now(wire), self.force_2_kN
        if force is None or value is None or abs(force - at_mm) > 0.6 + 0.1 * at_mm:
            return False
        return value > 3.0 * at_mm if second is None else abs(value - second) < 2.0 + 0.15 * abs(second)

    def stroke_mm(self) -> float | None:
        """Return the mean of the draw wires now; the piston's way where there are none [mm]."""
        wires = [value for name in self.points.wires if (value := self.now(name)) is not None]
        if wires:
            return sum(wires) / len(wires)
        return None if self.way is None else self.now(self.way)


class RepeatedFinding:
    """Something that has been so for some looks in a row.

    Parameters
    ----------
    looks : int
        So many.
    """

    def __init__(self, looks: int) -> None:
        self._looks = looks
        self._seen: dict[str, int] = {}

    def forget(self) -> None:
        """Count anew."""
        self._seen.clear()

    @property
    def begun(self) -> bool:
        """Whether something is so that has not been for long enough."""
        return any(0 < seen < self._looks for seen in self._seen.values())

    def sure(self, key: str, so: bool) -> bool:
        """Count a look; return whether it has been so for long enough."""
        self._seen[key] = self._seen.get(key, 0) + 1 if so else 0
        return self._seen[key] >= self._looks


def slope_of(rows: Floats, of: int, against: int) -> float:
    """Return the slope of a column against another by least squares; not a number where that stands still."""
    x, y = rows[:, against] - rows[:, against].mean(), rows[:, of] - rows[:, of].mean()
    square = float(np.dot(x, x))
    return float(np.dot(x, y)) / square if square > 0.0 else float("nan")
