"""Estimates the temperature of the spring from sensors that lag behind it.

A sensor follows the spring with first-order lag τ: τ dθ/dt = T − θ. So the spring's own temperature is

    T = θ + τ dθ/dt,

and at rest, where the spring cools at an even rate c, the readings obey θ = const − τ dθ/dt − c t: from the
readings after the last motion τ and c are found by least squares, together with what was believed before.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.scaling import ScaledBlock

Floats = NDArray[np.float64]

WINDOW_S = 15.0
"""A slope is that of a straight line through the readings of so long [s]; through at least …"""
WINDOW_READINGS = 6
"""… so many: a DS18B20 shows steps of 0.06 K."""
SLOPE_NOISE_K_PER_S = 0.004
"""Twice the standard uncertainty of a slope [K/s]: 1/16 K of resolution and 0.03 K of noise over a window."""
LINE_K = 0.04
"""Standard uncertainty of a line's middle, as windows overlap [K]; that of its slope, times the lag, comes on
top."""
COOLING_K_PER_S = 0.02
"""Standard uncertainty of the cooling before anything is measured [K/s]: 50 K above the air, and 2500 s."""
LAGS_S = (1.0, 600.0)
"""A lag is believed between these [s]."""
LEAST_DOUBT = 0.1
"""A lag is never known better than to this share."""
KEPT_S = 900.0
"""So long readings are kept [s]."""


@dataclass(frozen=True)
class SensorTrend:
    """One sensor: its level [°C] at ``at_s`` [s] and how fast it moves [K/s], by a line through its readings.

    ``middle_C`` and ``middle_s`` are where the line is known best.
    """

    at_s: float
    level_C: float
    slope_K_per_s: float
    middle_s: float
    middle_C: float

    def spring_C(self, lag_s: float) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the temperature of the spring behind a sensor with this lag [°C]."""
        return self.level_C + lag_s * self.slope_K_per_s


@dataclass(frozen=True)
class SensorLag:
    """How far sensors lag behind the spring, with standard uncertainty [s], and how fast it cools [K/s]."""

    lag_s: float
    doubt_s: float
    cooling_K_per_s: float = 0.0

    @property
    def most_s(self) -> float:
        """The lag with which nothing is taken for even too early [s]."""
        return self.lag_s + self.doubt_s


class SensorTrends:
    """Watches the sensors that touch the specimen.

    Parameters
    ----------
    readings : callable
        The last true reading of each sensor by its stream [°C].
    streams : frozenset of str
        Of the sensors that touch the specimen.
    """

    def __init__(self, readings: Callable[[], Mapping[str, float]], streams: frozenset[str]) -> None:
        self._readings = readings
        self._kept: dict[str, deque[tuple[float, float]]] = {name: deque() for name in streams}
        self._rest: dict[str, list[SensorTrend]] = {}
        self._rests_since_s: float | None = None
        self.now_s = 0.0
        """Time of the newest reading [s]."""
        self.highest_C = -np.inf
        """The highest reading so far [°C]."""
        self.seen = 0
        """How many readings have come."""
        self._found: tuple[int, float, tuple[SensorTrend | None, ...]] = (-1, -np.inf, ())

    def take(self, block: ScaledBlock) -> None:
        """Take a sensor's readings; blocks of anything else are not looked at."""
        kept = self._kept.get(block.stream)
        value_C = self._readings().get(block.stream)
        if kept is None or value_C is None or not len(block):
            return
        self.now_s = float(block.time_us[-1]) / 1e6
        self.highest_C = max(self.highest_C, value_C)
        kept.append((self.now_s, value_C))
        while self.now_s - kept[0][0] > KEPT_S:
            kept.popleft()
        self.seen += 1
        if self._rests_since_s is not None and (drift := self._line(block.stream, self._rests_since_s)):
            self._rest.setdefault(block.stream, []).append(drift)

    def begin_rest(self) -> None:
        """Begin to learn lag and cooling: nothing moves from now on."""
        self._rests_since_s = self.now_s
        self._rest.clear()

    def end_rest(self) -> None:
        """Something moves."""
        self._rests_since_s = None

    def drifts(self, since_s: float = -np.inf) -> tuple[SensorTrend, ...] | None:
        """Return how each sensor moves, by readings after ``since_s``; None as long as one has too few."""
        if self._found[:2] != (self.seen, since_s):  # it is asked after every pass, and readings are rare
            lines = tuple(self._line(name, since_s) for name in self._kept)
            self._found = (self.seen, since_s, lines)
        found = self._found[2]
        known = tuple(drift for drift in found if drift is not None)
        return known if len(known) == len(found) and known else None

    def learn(self, before: SensorLag) -> SensorLag:
        """Return what the rest under way says of lag and cooling, with what was believed before it."""
        found = [_relaxation(drifts, before) for drifts in self._rest.values() if len(drifts) > 1]
        if not found:
            return before
        mean = np.mean(np.array([(one.lag_s, one.doubt_s, one.cooling_K_per_s) for one in found]), axis=0)
        return SensorLag(*(float(value) for value in mean))

    def _line(self, name: str, since_s: float) -> SensorTrend | None:
        """Return the line through a sensor's last readings; None where they are too few."""
        kept = self._kept[name]
        recent = [one for one in kept if one[0] > since_s]
        enough = [one for one in recent if self.now_s - one[0] <= WINDOW_S]
        if len(enough) < WINDOW_READINGS:
            enough = recent[-WINDOW_READINGS:]
        if len(enough) < WINDOW_READINGS or enough[-1][0] - enough[0][0] < 0.8 * WINDOW_S:
            return None
        time_s, value_C = np.array(enough).T
        middle_s, middle_C = float(time_s.mean()), float(value_C.mean())
        apart = time_s - middle_s
        slope = float(apart @ (value_C - middle_C) / (apart @ apart))
        at_s = float(time_s[-1])
        return SensorTrend(at_s, middle_C + slope * (at_s - middle_s), slope, middle_s, middle_C)


def _relaxation(drifts: list[SensorTrend], before: SensorLag) -> SensorLag:
    """Return lag and cooling by the lines through a sensor's readings at rest and by what was believed."""
    time_s = np.array([drift.middle_s - drifts[0].middle_s for drift in drifts])
    slope = np.array([drift.slope_K_per_s for drift in drifts])
    value_K = np.array([drift.middle_C - drifts[0].middle_C for drift in drifts])
    line_K = LINE_K + 2.0 * SLOPE_NOISE_K_PER_S * before.lag_s
    terms = np.column_stack((np.ones_like(slope), -slope, -time_s)) / line_K
    lag_s, doubt_s, cooling_K_per_s = _solved(terms, value_K / line_K, before)
    if cooling_K_per_s < 0.0:  # nothing heats it at rest: a rise is the lag
        lag_s, doubt_s, cooling_K_per_s = *_solved(terms[:, :2], value_K / line_K, before)[:2], 0.0
    lag_s = float(np.clip(lag_s, *LAGS_S))
    return SensorLag(lag_s, max(doubt_s, LEAST_DOUBT * lag_s), cooling_K_per_s)


def _solved(terms: Floats, right: Floats, before: SensorLag) -> tuple[float, float, float]:
    """Return lag, its uncertainty and the cooling by least squares with what was believed as observations."""
    believed = np.array([[0.0, 1.0 / before.doubt_s, 0.0], [0.0, 0.0, 1.0 / COOLING_K_PER_S]])
    rows = np.vstack((terms, believed[: terms.shape[1] - 1, : terms.shape[1]]))
    values = np.concatenate((right, [before.lag_s / before.doubt_s, 0.0][: terms.shape[1] - 1]))
    covariance = np.linalg.inv(rows.T @ rows)
    found = covariance @ (rows.T @ values)
    return float(found[1]), float(np.sqrt(covariance[1, 1])), float(found[-1])
