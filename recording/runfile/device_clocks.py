"""Clocks of several devices in one run: readings by request and reply, and the line between two clocks.

A reading lies between request and reply: midway it is at most half the round trip off, in either direction.
Events of the kind :data:`CLOCK_EVENT` hold them for each device, so that a run tells how its clocks lay to
the host's clock, and so to each other, whatever ended it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.recording.content import MICROSECOND_S, Event

CLOCK_EVENT = "clock"
"""An event with readings of a device's clock: ``stream``, ``device_us``, ``host_s``, ``half_trip_s``."""
WINDOWS = 12
"""Of so many equal parts of a run the reading with the shortest round trip counts."""
DRIFT_LIMIT = 1e-4
"""Limit of the drift of two crystals where too few readings show it: 100 ppm, twice a plain crystal's."""
LEAST_SPAN_S = 20.0
"""Readings over less time than this show no drift [s]: a round trip of a millisecond is 50 ppm of it."""
_SQRT3 = float(np.sqrt(3.0))


@dataclass(frozen=True)
class ClockReadings:
    """Readings of a device's clock [µs], the host's time midway and half the round trip [s], shape (n,)."""

    device_us: NDArray[np.int64]
    host_s: NDArray[np.float64]
    half_trip_s: NDArray[np.float64]


def readings_in(events: Iterable[Event]) -> Mapping[str, ClockReadings]:
    """Return the readings of every device that events hold, by stream.

    Parameters
    ----------
    events : iterable of Event
        Of a run; those of other kinds are passed over, and what is damaged in one.
    """
    found: dict[str, list[tuple[int, float, float]]] = {}
    for event in events:
        if event.kind != CLOCK_EVENT:
            continue
        columns = [event.data.get(key) or [] for key in ("device_us", "host_s", "half_trip_s")]
        found.setdefault(str(event.data.get("stream")), []).extend(zip(*columns, strict=False))
    return {
        stream: ClockReadings(
            np.array([row[0] for row in rows], dtype=np.int64),
            np.array([row[1] for row in rows], dtype=np.float64),
            np.array([row[2] for row in rows], dtype=np.float64),
        )
        for stream, rows in found.items()
        if rows
    }


class ClockLine:
    """A device's clock as a straight line of the host's.

    Parameters
    ----------
    readings : ClockReadings
        At least one.

    Attributes
    ----------
    offset_s : float
        Host minus device time at the middle of the readings [s].
    drift : float
        By how much the device's clock is faster than the host's; 0 where too few readings show it.
    bound_s : float
        By so much at most the line is off within the span of the readings [s].

    Raises
    ------
    ValueError
        If there is no reading.
    """

    def __init__(self, readings: ClockReadings) -> None:
        if not readings.host_s.size:
            raise ValueError("no reading of a clock")
        best = _shortest(readings)
        host_s, half_s = readings.host_s[best], readings.half_trip_s[best]
        difference_s = host_s - readings.device_us[best] * MICROSECOND_S
        span_s = float(np.ptp(readings.host_s))
        self._middle_s = float(np.mean(host_s))
        weight = 1.0 / np.maximum(half_s, MICROSECOND_S)
        since_s = host_s - self._middle_s
        if span_s >= LEAST_SPAN_S and host_s.size > 2:
            slope, self.offset_s = (float(one) for one in np.polyfit(since_s, difference_s, 1, w=weight))
            unseen_s = 0.0
        else:
            slope, unseen_s = 0.0, 0.5 * DRIFT_LIMIT * span_s
            self.offset_s = float(np.average(difference_s, weights=weight**2))
        self.drift = -slope
        left_s = np.abs(difference_s - self.offset_s - slope * since_s) + half_s
        self.bound_s = float(np.max(left_s)) + unseen_s

    @property
    def standard_uncertainty_s(self) -> float:
        """What the bound is as a standard uncertainty [s]: rectangular."""
        return self.bound_s / _SQRT3

    def to_host_s(self, device_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the host's time of times of the device [s], shape (n,)."""
        # host - device = offset - drift (host - middle), solved for the host
        return np.asarray((device_s + self.offset_s + self.drift * self._middle_s) / (1.0 + self.drift))

    def to_device_s(self, host_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the device's time of times of the host [s], shape (n,)."""
        return np.asarray(host_s - self.offset_s + self.drift * (host_s - self._middle_s))


def _shortest(readings: ClockReadings) -> list[int]:
    """Return which readings have the shortest round trip of each window."""
    begin, end = float(readings.host_s.min()), float(readings.host_s.max())
    edges = np.linspace(begin, end, WINDOWS + 1)
    window = np.clip(np.searchsorted(edges, readings.host_s, side="right") - 1, 0, WINDOWS - 1)
    rows = (np.flatnonzero(window == number) for number in np.unique(window))
    return [int(own[np.argmin(readings.half_trip_s[own])]) for own in rows]
