"""How far slow strokes to a limit compressed the specimen, and what they show of machine and actuator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.foundation import StaticCycles

Floats = NDArray[np.float64]

AVERAGED = 5
"""Samples around the top that are averaged, so that noise does not overreach it."""
SHORT_OF_FORCE = 0.99
"""A stroke that comes so near to its force limit has turned there."""
POINT_S = 0.02
"""Samples of so long a time are averaged to a point [s]."""
MOST_POINTS = 20_000
"""Of more points, each two become one."""
LEAST_KN = 5.0
"""Below this force piston and specimen may be apart [kN]."""
STEADY_SHARE = 0.05
"""The command moves evenly where its speed is that of the stroke within this share …"""
SETTLE_S = 0.3
"""… and was for so long [s]."""
FEWEST_POINTS = 20
BEYOND_FROM = 0.67
"""What lies beyond the end of a loading branch is told by the part of it from this share of its stroke on."""
_CHANNELS = ("stroke", "position", "command", "force")


@dataclass(frozen=True)
class SlowStroke:
    """What slow strokes showed, as points along them.

    Parameters
    ----------
    force_kN, taken_mm : NDArray, shape (n,)
        While the specimen was compressed: the force, and position − stroke, what the machine took.
    loading_mm, loading_kN : NDArray, shape (m,)
        Stroke and force of the loading branches, by rising stroke.
    lag_s : float
        How late the piston followed its command; 0 where that was not to be seen.
    """

    force_kN: Floats
    taken_mm: Floats
    loading_mm: Floats
    loading_kN: Floats
    lag_s: float

    def loading_force_kN(self, stroke_mm: float) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the force of the loading branch at a stroke; beyond its end as its last third goes on.

        A buffer becomes stiffer all the way, so that it goes on as a parabola: a straight line is 1 % short
        where the stroke is 5 % beyond the end.
        """
        end_mm = float(self.loading_mm[-1])
        if stroke_mm <= end_mm:
            return float(np.interp(stroke_mm, self.loading_mm, self.loading_kN))
        near = self.loading_mm >= BEYOND_FROM * end_mm
        past_mm = self.loading_mm[near] - end_mm
        bend, slope, end_kN = np.polyfit(past_mm, self.loading_kN[near], 2)
        beyond_mm = stroke_mm - end_mm
        return float(end_kN + max(0.0, slope) * beyond_mm + max(0.0, bend) * beyond_mm**2)


class StaticWatch:
    """Keeps greatest stroke and force of static cycles, and points along them; a listener of the acquisition.

    Parameters
    ----------
    motion : StaticCycles
        As it was asked for.
    commanded_mm : float
        Where the piston turns, from first contact [mm].
    delays_s : mapping of str to float
        Delay of each channel of the controller.
    """

    def __init__(self, motion: StaticCycles, commanded_mm: float, delays_s: Mapping[str, float]) -> None:
        self.motion = motion
        self.commanded_mm = commanded_mm
        self.reached_mm: float | None = None
        """Greatest stroke [mm]; None before the first sample."""
        self._delays_s = delays_s
        self._force_kN = 0.0
        self._position_mm = commanded_mm
        self._points: list[Floats] = []
        self._kept = 0
        """How many points there are; counted here, since a block comes every few milliseconds."""

    def take(self, block: ScaledBlock) -> None:
        """Look at a block of the controller's samples."""
        stroke, force = block.values.get("stroke"), block.values.get("force")
        if stroke is None or force is None or not len(block):
            return
        some = min(AVERAGED, len(stroke))
        smooth = np.convolve(stroke, np.full(some, 1.0 / some), mode="valid")
        self.reached_mm = max(float(smooth.max()), self.reached_mm or 0.0)
        self._force_kN = max(self._force_kN, float(force.max()))
        if (position := block.values.get("position")) is not None:
            self._position_mm = max(self._position_mm, float(position.max()))
        if all(name in block.values for name in _CHANNELS):
            self._keep(block)

    def _keep(self, block: ScaledBlock) -> None:
        """Add a block's points."""
        self._points.append(_points(block, _CHANNELS))
        self._kept += self._points[-1].shape[1]
        if self._kept > MOST_POINTS:
            every = np.concatenate(self._points, axis=1)
            even = every[:, : every.shape[1] // 2 * 2]
            self._points = [0.5 * (even[:, ::2] + even[:, 1::2])]
            self._kept = self._points[0].shape[1]

    @property
    def turn_s(self) -> float:
        """By how much the piston went beyond its turn, as the time at its speed [s]."""
        return (self._position_mm - self.commanded_mm) / self.motion.speed_mm_per_s

    @property
    def by_force(self) -> bool:
        """Whether the force limit came before that of the stroke."""
        return self._force_kN >= SHORT_OF_FORCE * self.motion.force_limit_kN

    def seen(self) -> SlowStroke | None:
        """Return what the strokes showed; None where the samples do not tell."""
        if not self._points:
            return None
        time, *channels = np.concatenate(self._points, axis=1)
        if len(time) < FEWEST_POINTS or not (np.diff(time) > 0.0).all():
            return None
        stroke, position, command, force = (
            np.interp(time, time - self._delays_s.get(name, 0.0), values)
            for name, values in zip(_CHANNELS, channels, strict=True)
        )
        rate = np.gradient(command, time)
        pressed = force > LEAST_KN
        loading = pressed & (rate > 0.5 * self.motion.speed_mm_per_s)
        if np.count_nonzero(pressed) < FEWEST_POINTS or np.count_nonzero(loading) < FEWEST_POINTS:
            return None
        order = np.argsort(stroke[loading], kind="stable")
        return SlowStroke(
            force[pressed],
            (position - stroke)[pressed],
            stroke[loading][order],
            force[loading][order],
            lag_behind(time, command - position, rate, self.motion.speed_mm_per_s),
        )


class RampWatch:
    """Sees how late the piston follows a ramp; a listener of the acquisition.

    Parameters
    ----------
    speed_mm_per_s : float
        Of the ramp.
    """

    def __init__(self, speed_mm_per_s: float) -> None:
        self._speed = speed_mm_per_s
        self._points: list[Floats] = []

    def take(self, block: ScaledBlock) -> None:
        """Look at a block of the controller's samples."""
        if len(block) and all(name in block.values for name in ("command", "position")):
            self._points.append(_points(block, ("command", "position")))

    @property
    def lag_s(self) -> float:
        """How late the piston is [s]; 0 where the samples do not tell."""
        if not self._points:
            return 0.0
        time, command, position = np.concatenate(self._points, axis=1)
        if len(time) < FEWEST_POINTS or not (np.diff(time) > 0.0).all():
            return 0.0
        return lag_behind(time, command - position, np.gradient(command, time), self._speed)


def _points(block: ScaledBlock, channels: Sequence[str]) -> Floats:
    """Return a block's points: time and channels, each the mean over some samples."""
    time_s = block.time_us * 1e-6
    table = np.stack([time_s, *(block.values[name] for name in channels)])
    parts = max(1, round(float(time_s[-1] - time_s[0]) / POINT_S))
    starts = np.linspace(0, len(time_s), min(parts, len(time_s)), endpoint=False).astype(int)
    return np.asarray(np.add.reduceat(table, starts, axis=1) / np.diff(np.append(starts, len(time_s))))


def lag_behind(time: Floats, behind: Floats, rate: Floats, speed: float) -> float:
    """Return how late the piston is [s], from how far it is behind on the way up and on the way down.

    What is the same on both ways is no lag, but an offset; of one way alone it is taken for none.

    Parameters
    ----------
    time, behind, rate : NDArray, shape (n,)
        Instants [s], command − position [mm], and the command's speed [mm/s].
    speed : float
        That of an even motion [mm/s].
    """
    even = np.abs(np.abs(rate) - speed) <= STEADY_SHARE * speed
    changed = time[np.flatnonzero(~even)]
    before = np.searchsorted(changed, time)
    since = time - np.append(-np.inf, changed)[before]
    ways = [even & (since > SETTLE_S) & (np.sign(rate) == sign) for sign in (1.0, -1.0)]
    late = [
        sign * float(behind[way].mean()) for sign, way in zip((1.0, -1.0), ways, strict=True) if way.any()
    ]
    return max(0.0, sum(late) / len(late) / speed) if late else 0.0
