"""Maps the host's clock to a device's where the two drift apart, from many anchors; and how sure that is.

An anchor pairs the device's time of a sample with the host's time at which it arrived: later by the offset of
the clocks and by a latency that is never negative. In each stretch of the run the offset is a straight line,
whose slope is the drift, that no anchor lies below and that lies nearest to them: of all lines below the
points that with the least mean distance, which is the edge of their lower convex hull at their middle. The
least latency stays in it, the same for all times: it is measured with the delay of the channel.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bufferstand.recording.content import MICROSECOND_S

STRETCH_S = 600.0
"""A crystal's drift changes with its temperature, and that slowly [s]."""
_PARTS = 10


class DriftingClockMap:
    """Maps host stand time [s] to device time [s], drift and all.

    Parameters
    ----------
    device_us : array of int, shape (n,)
        Device's time of each anchor [µs]; at least one.
    host_s : array, shape (n,)
        Host's time of each [s].

    Attributes
    ----------
    spread_s : float
        How far the nearest anchors of a tenth of a stretch lie above its line, in the median [s]: by so much
        the line may be too low or too high there.
    drift : float
        By how much the device's clock is faster than the host's, over the whole run.

    Raises
    ------
    ValueError
        If there is no anchor.
    """

    def __init__(self, device_us: NDArray[np.int64], host_s: NDArray[np.float64]) -> None:
        if not host_s.size:
            raise ValueError("no clock anchors")
        difference_s = host_s - device_us * MICROSECOND_S
        begin, end = float(host_s.min()), float(host_s.max())
        count = max(1, round((end - begin) / STRETCH_S))
        edges = np.linspace(begin, end, count + 1)
        values = np.zeros((count, 2))
        nearest: list[float] = []
        for number in range(count):
            own = (host_s >= edges[number]) & (host_s <= edges[number + 1])
            own = own if np.any(own) else np.ones(host_s.size, dtype=np.bool_)
            offset_s, slope = _line_below(host_s[own], difference_s[own])
            values[number] = offset_s + slope * edges[number : number + 2]
            nearest += _nearest(host_s[own], difference_s[own] - offset_s - slope * host_s[own])
        # Where two stretches meet, their lines differ by little: the mean keeps time from jumping.
        inner = 0.5 * (values[:-1, 1] + values[1:, 0])
        nodes = np.concatenate((values[:1, 0], inner, values[-1:, 1]))
        self._at_host_s, self._offset_s = edges, nodes
        self._slopes = (
            float((values[0, 1] - values[0, 0]) / max(edges[1] - edges[0], 1e-9)),
            float((values[-1, 1] - values[-1, 0]) / max(edges[-1] - edges[-2], 1e-9)),
        )
        self.spread_s = float(np.median(nearest))
        self.drift = -float((nodes[-1] - nodes[0]) / max(end - begin, 1e-9))

    def offset_s(self, host_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return host minus device time [s] at host times of shape (n,); beyond the anchors it drifts on."""
        inside = np.interp(host_s, self._at_host_s, self._offset_s)
        before = np.minimum(host_s - self._at_host_s[0], 0.0) * self._slopes[0]
        behind = np.maximum(host_s - self._at_host_s[-1], 0.0) * self._slopes[1]
        return np.asarray(inside + before + behind)

    def to_device_s(self, host_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return device times [s] of host times of shape (n,)."""
        return np.asarray(host_s - self.offset_s(host_s))


def _line_below(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float]:
    """Return offset and slope of the line below all points with the least mean distance from them."""
    order = np.argsort(x, kind="stable")
    hull: list[tuple[float, float]] = []
    for one in zip(x[order].tolist(), y[order].tolist(), strict=True):
        while len(hull) > 1 and _turns_up(hull[-2], hull[-1], one):
            hull.pop()
        if hull and hull[-1][0] == one[0]:
            hull[-1] = min(hull[-1], one, key=lambda point: point[1])
        else:
            hull.append(one)
    middle = float(np.mean(x))
    if len(hull) == 1:
        return hull[0][1], 0.0
    at = next((i for i in range(1, len(hull) - 1) if hull[i][0] >= middle), len(hull) - 1)
    (x1, y1), (x2, y2) = hull[at - 1], hull[at]
    slope = (y2 - y1) / (x2 - x1)
    return y1 - slope * x1, slope


def _turns_up(one: tuple[float, float], two: tuple[float, float], three: tuple[float, float]) -> bool:
    """Say whether the middle one of three points lies on or above the line between the others."""
    return (two[0] - one[0]) * (three[1] - one[1]) <= (three[0] - one[0]) * (two[1] - one[1])


def _nearest(x: NDArray[np.float64], above_s: NDArray[np.float64]) -> list[float]:
    """Return how near the nearest point of each tenth comes to the line."""
    parts = np.array_split(np.argsort(x, kind="stable"), _PARTS)
    return [float(np.min(above_s[part])) for part in parts if part.size]
