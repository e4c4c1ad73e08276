"""Time stamps for a device without a clock: from its even rate and from when its bytes came in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

RATE_TOLERANCE = 0.002
"""How much slower than stated the device may sample; larger differences show as jumps."""
JUMP_S = 1.0
"""A reception this much later than expected means that time passed without samples [s of stand time]."""
RATE_WINDOW_S = 10.0
"""Time over which the values that come are counted [s of stand time, and half of it of the wall]."""
RATE_DOUBT = 0.05
"""Larger share by which the counted rate may differ from the stated one."""


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
        self._interrupted = False
        self.passed = 0
        """Periods that passed without a sample before the newest stamps: it was interrupted, or silent."""

    def interrupt(self) -> None:
        """The stream was stopped and started: the next samples follow the last ones at any distance."""
        self._interrupted = self._last_s is not None

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
        self.passed = 0
        if self._last_s is None:
            newest_s = received_s
        elif self._interrupted:
            newest_s = max(received_s, self._last_s + samples * self._period_s)
            between_s = newest_s - self._last_s - (samples + lost) * self._period_s
            self.passed = max(0, round(between_s / self._period_s))
            self._interrupted = False
        else:
            step_s = (samples + lost) * self._period_s
            newest_s = self._last_s + step_s
            late_s = received_s - newest_s
            if late_s > JUMP_S:
                self.passed = round(late_s / self._period_s)
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


class RateWatch:
    """Compares how many values come with how many should: the only check of a time base without a clock.

    Parameters
    ----------
    rate_Hz : float
        Values a second of stand time that should come.
    """

    def __init__(self, rate_Hz: float) -> None:
        self._rate_Hz = rate_Hz
        self._began: tuple[float, float] | None = None
        self._came = 0
        self._wrong = False

    def reset(self) -> None:
        """Begin to count anew: the stream was interrupted."""
        self._began = None

    def look(self, came: int, received_s: float, wall_s: float) -> str:
        """Count values; return what is wrong with their rate, once while it stays so.

        Parameters
        ----------
        came : int
            Values received now, with those known to be lost.
        received_s, wall_s : float
            Stand and wall time of reception [s]; both must have gone on far enough for a judgement.
        """
        if self._began is None:
            self._began, self._came = (received_s, wall_s), 0
            return ""
        self._came += came
        passed_s = received_s - self._began[0]
        if passed_s < RATE_WINDOW_S or wall_s - self._began[1] < RATE_WINDOW_S / 2:
            return ""
        measured_Hz = self._came / passed_s
        self._began, self._came = (received_s, wall_s), 0
        was_wrong = self._wrong
        self._wrong = abs(measured_Hz - self._rate_Hz) > RATE_DOUBT * self._rate_Hz
        if not self._wrong or was_wrong:
            return ""
        return (
            f"{measured_Hz:.4g} values a second come in instead of {self._rate_Hz:.4g}; look at its data "
            "rate and filter, and whether the line or this computer is overloaded"
        )
