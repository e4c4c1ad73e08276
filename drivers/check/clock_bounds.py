"""Bounds for the rate of a device's clock, from the times of requests and replies.

A reading is true somewhere between request and reply. Where is not known: on a busy computer the way there
may take longer than the way back, for seconds on end, and the middles of the round trips then drift though no
clock does. But no line of device time over host time passes above a reading at its request, nor below it at
its reply. The rates of all lines that keep to this are an interval, and the true one is in it, whatever the
delays do.

That is the linear program of S. B. Moon, P. Skelly and D. Towsley, Estimation and removal of clock skew from
network delay measurements (IEEE INFOCOM 1999), with request and reply as two one-way delays: the line lies
below the lower hull of the one and above the upper hull of the other. Only corners of the hulls bound it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_STEPS = 200
"""Of the search for the least slack: the interval is two thirds as long after each."""


class ClockBounds:
    """Lines of device time less host time, ``offset + ppm x`` [µs] at host time x [s], that readings allow.

    Parameters
    ----------
    asked_s, answered_s : arrays, shape (N,)
        Host time of request and reply, rising.
    device_us : array, shape (N,)
        What the device's clock showed.
    resolution_us : float
        The reading itself is true to this.
    """

    def __init__(
        self, asked_s: Floats, answered_s: Floats, device_us: Floats, resolution_us: float = 0.0
    ) -> None:
        # The line is not above these at the requests …
        self._above = _lower_hull(asked_s, device_us - asked_s * 1e6 + resolution_us)
        # … and not below these at the replies.
        self._below = _lower_hull(answered_s, answered_s * 1e6 - device_us + resolution_us)
        self._below[1] *= -1.0

    def interval(self, slack_us: float = 0.0) -> tuple[float, float] | None:
        """Return the least and the greatest rate [ppm] of lines that miss no reading by more than a slack.

        None where there are no such lines.
        """
        apart_s = self._above[0][:, None] - self._below[0]
        room_us = self._above[1][:, None] - self._below[1] + 2.0 * slack_us
        ppm = room_us / np.where(apart_s == 0.0, np.inf, apart_s)
        most = float(np.min(ppm, where=apart_s > 0.0, initial=np.inf))
        least = float(np.max(ppm, where=apart_s < 0.0, initial=-np.inf))
        if least > most or np.any((apart_s == 0.0) & (room_us < 0.0)):
            return None
        return least, most

    def least_slack_us(self) -> float:
        """Return by how much the line that suits the readings best misses some of them; 0 where it does not.

        How much a line of some rate misses at best is convex over the rate: its least is found by thirds.
        """
        times, values = np.concatenate((self._above, self._below), axis=1)
        steepest = (float(np.ptp(values)) + 1.0) / max(float(np.ptp(times)), 1e-9)
        low, high = -2.0 * steepest, 2.0 * steepest
        for _ in range(_STEPS):
            third = (high - low) / 3.0
            if self._missed_us(low + third) <= self._missed_us(high - third):
                high -= third
            else:
                low += third
        return max(0.0, self._missed_us(0.5 * (low + high)))

    def _missed_us(self, ppm: float) -> float:
        lowest = float(np.min(self._above[1] - ppm * self._above[0]))
        highest = float(np.max(self._below[1] - ppm * self._below[0]))
        return 0.5 * (highest - lowest)


def _lower_hull(x: Floats, y: Floats) -> Floats:
    """Return the corners of the lower hull of points whose x do not fall (Andrew's chain), shape (2, H)."""
    corners: list[tuple[float, float]] = []
    for point in zip(x.tolist(), y.tolist(), strict=True):
        while len(corners) > 1 and _turns_right(corners[-2], corners[-1], point):
            corners.pop()
        if corners and corners[-1][0] == point[0]:
            if corners[-1][1] <= point[1]:
                continue
            corners.pop()
            while len(corners) > 1 and _turns_right(corners[-2], corners[-1], point):
                corners.pop()
        corners.append(point)
    return np.array(corners).T


def _turns_right(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    """Say whether the way from a over b to c does not turn left: then b is no corner of a lower hull."""
    return (b[0] - a[0]) * (c[1] - a[1]) <= (b[1] - a[1]) * (c[0] - a[0])
