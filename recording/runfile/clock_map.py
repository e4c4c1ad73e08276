"""Maps the host's clock to the device's by anchors, with their uncertainty.

An anchor pairs the device's time of a sample with the host's time at which it arrived. The host's time is
later by the clocks' offset and by a latency that is never negative. So the anchor with the smallest
difference is the best estimate of the offset (too large by the smallest latency, on loopback and Ethernet
well under a millisecond), and a mean would be worse. As the two clocks drift apart by some 10 ppm, the
smallest difference is taken in each minute of the run, and in between the offset is interpolated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bufferstand.recording.content import MICROSECOND_S

WINDOW_S = 60.0


class ClockMap:
    """Maps host stand time [s] to device time [s].

    Parameters
    ----------
    device_us : array of int, shape (n,)
        Device's time of each anchor [µs]; at least one.
    host_s : array, shape (n,)
        Host's time of each [s].

    Raises
    ------
    ValueError
        If there is no anchor.
    """

    def __init__(self, device_us: NDArray[np.int64], host_s: NDArray[np.float64]) -> None:
        if not host_s.size:
            raise ValueError("no clock anchors")
        difference_s = host_s - device_us * MICROSECOND_S
        window = np.floor((host_s - host_s.min()) / WINDOW_S).astype(int)
        best = [
            int(rows[np.argmin(difference_s[rows])])
            for rows in (np.flatnonzero(window == number) for number in np.unique(window))
        ]
        self._at_host_s = host_s[best]
        self._offset_s = difference_s[best]

    def offset_s(self, host_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return host minus device time [s] at host times of shape (n,)."""
        return np.interp(host_s, self._at_host_s, self._offset_s)

    def to_device_s(self, host_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return device times [s] of host times of shape (n,)."""
        return host_s - self.offset_s(host_s)
