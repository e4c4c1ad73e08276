"""When a step may begin, and when it has done what it is for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Steadiness:
    """When a harmonic step has settled: damping and stiffness of its last cycles hardly differ.

    Parameters
    ----------
    damping_percent, stiffness_percent : float
        Greatest spread (largest less smallest, relative to their mean) over the window [%].
    window : int
        Over how many cycles, at least 2.
    min_cycles, max_cycles : int
        Not before the first; at the second it ends in any case.
    """

    damping_percent: float
    stiffness_percent: float
    window: int
    min_cycles: int
    max_cycles: int

    def reached(self, damping: Sequence[float], stiffness: Sequence[float]) -> bool:
        """Return whether the cycles so far have settled.

        Parameters
        ----------
        damping, stiffness : sequence of float
            Of every full-amplitude cycle so far, in order; a value that is not finite is not steady.

        Raises
        ------
        ValueError
            If they are not equally many.
        """
        if len(damping) != len(stiffness):
            raise ValueError(f"{len(damping)} values of damping for {len(stiffness)} of stiffness")
        if len(damping) < self.min_cycles:
            return False
        return (
            _spread(damping[-self.window :]) * 100.0 <= self.damping_percent
            and _spread(stiffness[-self.window :]) * 100.0 <= self.stiffness_percent
        )


def _spread(values: Sequence[float]) -> float:
    """Return largest less smallest, relative to the mean's size; infinite where that says nothing."""
    mean = abs(sum(values)) / len(values)
    spread = max(values) - min(values)
    if not math.isfinite(mean) or not math.isfinite(spread):
        return math.inf
    if spread == 0.0:
        return 0.0
    return spread / mean if mean > 0.0 else math.inf


@dataclass(frozen=True)
class Warmth:
    """When a step that warms the specimen up has done so.

    Parameters
    ----------
    temperature_C, band_K : float
        Within ± ``band_K`` of this [°C] …
    every : bool
        … is every specimen sensor; else one of them is enough.
    timeout_s : float
        Longest time, cycles and rests together [s].
    """

    temperature_C: float
    band_K: float
    every: bool
    timeout_s: float

    @property
    def low_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Lower end of the band [°C]."""
        return self.temperature_C - self.band_K

    @property
    def high_C(self) -> float:  # noqa: N802
        """Upper end of the band [°C]."""
        return self.temperature_C + self.band_K

    def too_cold(self, readings_C: Sequence[float]) -> bool:
        """Return whether the specimen needs more cycles: a sensor (or, for one of them, each) is below."""
        return (any if self.every else all)(value < self.low_C for value in readings_C)

    def within(self, readings_C: Sequence[float]) -> bool:
        """Return whether the specimen is as warm as it is to be."""
        return (all if self.every else any)(self.low_C <= value <= self.high_C for value in readings_C)


@dataclass(frozen=True)
class Heating:
    """What is expected of a specimen that is warmed up, before anything is measured.

    Parameters
    ----------
    rise_K : float or None
        By how much one cycle heats the spring, as it begins [K].
    rate_K_per_s : float or None
        By how much cycles heat it in a second [K/s].
    least_K : float or None
        By how much the shortest go of cycles heats it, with the way there and back [K].
    lag_s : float or None
        By how much the sensors lag behind the spring [s].
    """

    rise_K: float | None
    rate_K_per_s: float | None
    least_K: float | None
    lag_s: float | None


@dataclass(frozen=True)
class StartBand:
    """How warm the specimen is when a step begins.

    Parameters
    ----------
    low_C, high_C : float
        Every specimen sensor is within them [°C]; a warmer one is waited for.
    timeout_s : float
        So long at most [s].
    refuses_cold : bool
        Whether it does not begin with a specimen that is too cold; else that is said, and it begins.
    """

    low_C: float
    high_C: float
    timeout_s: float
    refuses_cold: bool = True

    def text(self) -> str:
        """Return it as the campaign file has it."""
        return f"start_temperature_C = [{self.low_C:g}, {self.high_C:g}]"
