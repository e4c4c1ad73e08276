"""Devices beside the controller that have a clock of their own: their place on the run's time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.recording.content import MAIN_STREAM
from bufferstand.recording.runfile.device_clocks import ClockLine, ClockReadings


@dataclass(frozen=True)
class Alignment:
    """How a device's samples lie to the run's time, as the samples themselves show it.

    Parameters
    ----------
    late_s : float
        By how much their times are too late at ``at_s`` [s].
    drift : float
        By how much more in each second.
    at_s : float
        On the run's time [s].
    u_s : float
        Standard uncertainty of what is left [s].
    by : str
        The channels that show it.
    """

    late_s: float
    drift: float
    at_s: float
    u_s: float
    by: str

    def applied(self, time_s: NDArray[np.float64], origin_s: float) -> NDArray[np.float64]:
        """Return times on the run's clock [s], shape (n,); ``origin_s`` is where the run's time begins."""
        return np.asarray(time_s - self.late_s - self.drift * (time_s - origin_s - self.at_s))


class OtherClocks:
    """Places samples of such devices by readings of their clocks, and by their alignment once there is one.

    Parameters
    ----------
    readings : mapping of str to ClockReadings
        By stream, of the controller too where it has a clock of its own.
    streams : iterable of str
        Of the run.
    """

    def __init__(self, readings: Mapping[str, ClockReadings], streams: Iterable[str]) -> None:
        there = set(streams) - {MAIN_STREAM}
        self.lines: Mapping[str, ClockLine] = {
            name: ClockLine(own) for name, own in readings.items() if name in there
        }
        """Each device's clock against the host's."""
        main = readings.get(MAIN_STREAM)
        self.main: ClockLine | None = None if main is None else ClockLine(main)
        """The controller's; None where it has none, and the run's time is the host's."""
        self.alignments: dict[str, Alignment] = {}

    def bound_s(self, stream: str) -> float:
        """Return by how much readings alone may place a stream wrongly [s]: by both clocks' bounds."""
        return self.lines[stream].bound_s + (0.0 if self.main is None else self.main.bound_s)

    def u_s(self, stream: str) -> float:
        """Return the standard uncertainty of a device's instants on the run's time [s]."""
        if stream in self.alignments:
            return self.alignments[stream].u_s
        main_s = 0.0 if self.main is None else self.main.standard_uncertainty_s
        return float(np.hypot(self.lines[stream].standard_uncertainty_s, main_s))

    def offset_s(self, stream: str) -> float:
        """Return the run's clock minus the device's, at the middle of the readings [s]."""
        line = self.lines[stream]
        return line.offset_s - (0.0 if self.main is None else self.main.offset_s)

    def drift(self, stream: str) -> float:
        """Return by how much the device's clock is faster than the run's."""
        return self.lines[stream].drift - (0.0 if self.main is None else self.main.drift)

    def placed_s(
        self,
        stream: str,
        time_s: NDArray[np.float64],
        origin_s: float,
        to_device_s: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None,
    ) -> NDArray[np.float64]:
        """Return times of a device's own clock [s] on the clock of the run, shape (n,).

        Parameters
        ----------
        stream : str
        time_s : NDArray, shape (n,)
            As the device stamps them [s].
        origin_s : float
            Where the run's time begins, on the run's clock [s]; it is not taken off.
        to_device_s : callable or None
            From the host's clock to the controller's where the latter was not read; None where there is
            none.
        """
        time_s = self.lines[stream].to_host_s(time_s)
        if self.main is not None:
            time_s = self.main.to_device_s(time_s)
        elif to_device_s is not None:
            time_s = to_device_s(time_s)
        found = self.alignments.get(stream)
        return time_s if found is None else found.applied(time_s, origin_s)
