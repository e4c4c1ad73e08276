"""Time stamps for a device without a clock: from its even rate and from when its bytes came in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

RATE_TOLERANCE = 0.002
"""How much slower than stated the device may sample; larger differences show as jumps."""
JUMP_S = 1.0
"""A reception this much later than expected means that time passed without samples [s of stand time]."""


class HostStamps:
    """Even time stamps that hug the earliest receptions.

    A byte can come in late (buffers, scheduler) but never early. So the next stamp is one period on; an
    earlier reception pulls the time base back at once, a later one pushes it on by no more than the
    device's rate may be wrong.

    Parameters
    ----------
    rate_Hz : float
        The device's nominal rate.
    """

    def __init__(self, rate_Hz: float) -> None:
        self._period_s = 1.0 / rate_Hz
        self._last_s: float | None = None
        self._last_us = 0

    def stamp(self, samples: int, received_s: float, lost: int = 0) -> NDArray[np.int64]:
        """Return the stand times of the newest ``samples``, strictly rising.

        Parameters
        ----------
        samples : int
            How many, at least one; the last of them had come in by ``received_s``.
        received_s : float
            Stand time of reception [s].
        lost : int
            Samples missing before them.

        Returns
        -------
        NDArray[int64]
            Times [µs], shape (samples,).
        """
        if self._last_s is None:
            newest_s = received_s
        else:
            step_s = (samples + lost) * self._period_s
            newest_s = self._last_s + step_s
            late_s = received_s - newest_s
            if late_s < 0.0 or late_s > JUMP_S:
                newest_s = received_s
            else:
                newest_s += min(late_s, RATE_TOLERANCE * step_s)
        index = np.arange(samples - 1, -1, -1)
        time_us: NDArray[np.int64] = np.rint((newest_s - index * self._period_s) * 1e6).astype(np.int64)
        if self._last_s is not None and time_us[0] <= self._last_us:
            floor_us = self._last_us + 1 + np.arange(samples)
            time_us = np.maximum(time_us, floor_us)
        self._last_s = newest_s
        self._last_us = int(time_us[-1])
        return time_us
