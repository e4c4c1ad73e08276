"""The heat of a step: the specimen's temperature before and after, and the absorbed work."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from bufferstand.daq.guards import GuardPanel
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.warm_up.outcome import WarmUpOutcome

LATE_S = 3.0
"""A sensor that gives its first reading within this time gives the temperature at the beginning [s]."""


@dataclass(frozen=True)
class StepHeat:
    """What was measured from the beginning of a step to its end.

    Parameters
    ----------
    duration_s : float
        Of stand time [s].
    start_C, end_C : float or None
        Of the warmest specimen sensor [°C]; None where none gave a reading.
    ambient_C : float or None
        Of the air, by the sensor that has this role [°C].
    heat_J : float
        ∮ F ds over all samples: what was done to the specimen and did not come back [J].
    warmed : Warmed or None
        How a warm-up went; None for any other step.
    """

    duration_s: float
    start_C: float | None
    end_C: float | None
    ambient_C: float | None
    heat_J: float
    warmed: WarmUpOutcome | None = None


class HeatLog:
    """Watches one step, or one wait.

    Parameters
    ----------
    panel : GuardPanel
        Knows the last true reading of every sensor.
    ambient : collection of str
        Streams of the sensors that do not touch the specimen.
    now_s : float
        Stand time of the beginning [s].
    """

    def __init__(self, panel: GuardPanel, ambient: Collection[str], now_s: float) -> None:
        self._panel = panel
        self._ambient = ambient
        self._began_s = now_s
        self._start_C = self._warmest_C()
        self._last: tuple[float, float] | None = None
        self._work_J = 0.0

    def take(self, block: ScaledBlock) -> None:
        """Add the work of a block of the controller's samples; nothing is integrated across a gap."""
        if self._start_C is None and block.received_s - self._began_s < LATE_S:
            self._start_C = self._warmest_C()
        force, stroke = block.values.get("force"), block.values.get("stroke")
        if force is None or stroke is None or not len(block):
            return
        if self._last is not None and not block.lost:
            before_kN, before_mm = self._last
            self._work_J += 0.5 * (before_kN + float(force[0])) * (float(stroke[0]) - before_mm)
        self._work_J += 0.5 * float(np.dot(force[1:] + force[:-1], stroke[1:] - stroke[:-1]))
        self._last = float(force[-1]), float(stroke[-1])

    def seen(self, now_s: float) -> StepHeat:
        """Return what was measured until now (stand time, s)."""
        air = [value for name, value in self._readings().items() if name in self._ambient]
        return StepHeat(
            now_s - self._began_s,
            self._start_C,
            self._warmest_C(),
            sum(air) / len(air) if air else None,
            self._work_J,
        )

    def _warmest_C(self) -> float | None:  # noqa: N802 - the unit keeps its capital
        touching = [value for name, value in self._readings().items() if name not in self._ambient]
        return max(touching) if touching else None

    def _readings(self) -> Mapping[str, float]:
        return self._panel.latest_temperatures()
