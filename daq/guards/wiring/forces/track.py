"""One force channel as it was received: its samples, means of them, and how long it stands still."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.foundation.numbers import hole_from_s

Floats = NDArray[np.float64]

GRID_S = 0.02
"""Forces are compared on points of so long a time [s]."""
KEPT_S = 5.5
"""So long samples are kept [s]."""
SET_BACK_S = 1.0
"""A clock that goes back by more was set [s]."""


class ForceTrack:
    """Samples of one force on the host's clock.

    Parameters
    ----------
    name : str
        Its channel.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._samples: deque[Floats] = deque()
        self._whole: Floats | None = None
        """All of them in one, once asked for since the last block: a look asks several times."""
        self._stands_from_s = 0.0
        self._count = 0
        self._least_step_kN = float("inf")

    def __bool__(self) -> bool:
        """Return whether anything has come."""
        return bool(self._samples)

    @property
    def newest_s(self) -> float:
        """Return the time of its newest sample [s]."""
        return float(self._samples[-1][0, -1])

    @property
    def newest_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Return its newest sample [kN]."""
        return float(self._samples[-1][1, -1])

    def take(self, block: ScaledBlock, moved_s: float) -> None:
        """Take a block, its time stamps moved by so much [s]."""
        time_s = np.asarray(block.time_us * 1e-6 + moved_s, dtype=np.float64)
        value = block.values[self._name]
        if self._samples and float(time_s[0]) <= self.newest_s - SET_BACK_S:
            self._samples.clear()
        self._look_whether_it_stands(time_s, value)
        self._samples.append(np.stack([time_s, value]))
        self._whole = None
        oldest_s = float(time_s[-1]) - KEPT_S
        while float(self._samples[0][0, -1]) < oldest_s:
            self._samples.popleft()

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

    def samples(self) -> Floats:
        """Return time and value of its samples, shape (2, n), not to be written to; time does not fall."""
        if self._whole is None:
            self._whole = np.concatenate(self._samples, axis=1)
            np.maximum.accumulate(self._whole[0], out=self._whole[0])  # the clocks' offset may become less
            self._whole.flags.writeable = False
        return self._whole


class ForceMeans:
    """Means of a track about instants: of an even width, or its value where that is 0.

    Parameters
    ----------
    samples : NDArray, shape (2, n)
        Time [s], which does not fall, and value.
    width_s : float
    """

    def __init__(self, samples: Floats, width_s: float) -> None:
        self._time_s, self._value = samples
        self._width_s = width_s
        steps = 0.5 * (self._value[1:] + self._value[:-1]) * np.diff(self._time_s)
        self._whole = np.concatenate(([0.0], np.cumsum(steps))) if width_s > 0.0 else self._value

    def at(self, time_s: Floats) -> Floats:
        """Return the means about some instants [s]."""
        if self._width_s <= 0.0:
            return np.asarray(np.interp(time_s, self._time_s, self._value))
        half_s = 0.5 * self._width_s
        later, before = (np.interp(time_s + by_s, self._time_s, self._whole) for by_s in (half_s, -half_s))
        return np.asarray((later - before) / self._width_s)


def common_instants(first: Floats, second: Floats, begin_s: float, end_s: float) -> tuple[Floats, float]:
    """Return instants at which both tracks have samples, and over which width they are compared there [s].

    They are a grid; where the second track is slower than that, they are its own samples.

    Parameters
    ----------
    first, second : NDArray, shape (2, n)
    begin_s, end_s : float
    """
    own = second[0][(second[0] >= begin_s) & (second[0] <= end_s)]
    if len(own) < 3:
        return own[:0], 0.0
    slow = float(np.median(np.diff(own))) > 0.75 * GRID_S
    time = own if slow else np.arange(begin_s + GRID_S, end_s - GRID_S, GRID_S)
    for track in (first,) if slow else (first, second):
        behind = np.clip(np.searchsorted(track[0], time), 1, track.shape[1] - 1)
        time = time[track[0][behind] - track[0][behind - 1] < 2.0 * GRID_S]
    return time, 0.0 if slow else GRID_S


def has_hole(samples: Floats, begin_s: float, end_s: float) -> bool:
    """Return whether a track lacks samples within two instants [s]."""
    inside = samples[0][(samples[0] >= begin_s) & (samples[0] <= end_s)]
    if len(inside) < 3:
        return True
    steps = np.diff(np.concatenate(([begin_s], inside, [end_s])))
    return float(np.max(steps)) > hole_from_s(inside)
