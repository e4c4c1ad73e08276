"""One way to the force as it came in: its samples, points of them on a grid, and how long it stands still."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from daq.scaling import ScaledBlock
from foundation.holes import hole_from_s

Floats = NDArray[np.float64]

GRID_S = 0.02
"""Forces are compared on points of so long a time [s]."""
KEPT_S = 5.5
"""So long samples are kept [s]."""
SET_BACK_S = 1.0
"""A clock that goes back by more was set [s]."""


class Track:
    """Samples of one force on the host's clock.

    Parameters
    ----------
    name : str
        Its channel.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._samples: deque[Floats] = deque()
        self._points: deque[Floats] = deque()
        self._stands_from_s = 0.0
        self._count = 0
        self._least_step_kN = float("inf")

    def __bool__(self) -> bool:
        """Return whether anything has come."""
        return bool(self._points)

    @property
    def newest_s(self) -> float:
        """Return the time of its newest sample [s]."""
        return float(self._points[-1][0, -1])

    def take(self, block: ScaledBlock, moved_s: float) -> None:
        """Take a block, its time stamps moved by so much [s]."""
        time_s = np.asarray(block.time_us * 1e-6 + moved_s, dtype=np.float64)
        value = block.values[self._name]
        if self._points and float(time_s[0]) <= self.newest_s - SET_BACK_S:
            self._points.clear()
            self._samples.clear()
        self._look_whether_it_stands(time_s, value)
        self._samples.append(np.stack([time_s, value]))
        parts = int(np.ceil(float(time_s[-1] - time_s[0]) / GRID_S))
        if 0 < parts < len(time_s):
            starts = np.linspace(0, len(time_s), parts, endpoint=False).astype(int)
            counts = np.diff(np.append(starts, len(time_s)))
            time_s = np.add.reduceat(time_s, starts) / counts
            value = np.add.reduceat(value, starts) / counts
        self._points.append(np.stack([time_s, value]))
        oldest_s = float(time_s[-1]) - KEPT_S
        for track in (self._samples, self._points):
            while float(track[0][0, -1]) < oldest_s:
                track.popleft()

    def _look_whether_it_stands(self, time_s: Floats, value: Floats) -> None:
        steps = np.abs(np.diff(value, prepend=self._samples[-1][1, -1] if self._samples else value[0]))
        moved = np.flatnonzero(steps > 0.0)
        if len(moved):
            self._least_step_kN = min(self._least_step_kN, float(steps[moved].min()))
            self._stands_from_s, self._count = float(time_s[moved[-1]]), len(value) - int(moved[-1])
        else:
            self._stands_from_s = self._stands_from_s if self._samples else float(time_s[0])
            self._count += len(value)

    @property
    def stands(self) -> tuple[float, int]:
        """Return since when it shows one and the same value to the last digit [s], and so many samples."""
        return self._stands_from_s, self._count

    @property
    def least_step_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the smallest change that it has ever shown: its count [kN]."""
        return self._least_step_kN

    def series(self) -> Floats:
        """Return time and value of its points, shape (2, n); time does not fall."""
        return _joined(self._points)

    def samples(self) -> Floats:
        """Return time and value of its samples, shape (2, n); time does not fall."""
        return _joined(self._samples)


def has_hole(series: Floats, time: Floats) -> bool:
    """Return whether a track lacks samples within the times that are looked at [s]."""
    inside = series[0][(series[0] >= time[0]) & (series[0] <= time[-1])]
    if len(inside) < 3:
        return True
    steps = np.diff(np.concatenate(([time[0]], inside, [time[-1]])))
    return float(np.max(steps)) > hole_from_s(inside)


def _joined(track: deque[Floats]) -> Floats:
    whole = np.concatenate(track, axis=1)
    whole[0] = np.maximum.accumulate(whole[0])  # the clocks' offset may have become less
    return whole
