"""Clocks of devices beside the controller's: compared with the host's while the stand runs, and recorded.

Guards look at what such a device delivers as at an amplifier: stamped by the host's clock. The run file keeps
the device's own stamps, and readings of every clock by which the evaluation places them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bufferstand.daq.acquisition.run_log import RunLog
from bufferstand.daq.scaling import DERIVED, ScaledBlock
from bufferstand.drivers import ClockReading, OwnClock, Sensor, StreamFacts
from bufferstand.recording.runfile import CLOCK_EVENT, ClockLine, ClockReadings

LIVE_S = 20.0
"""Of the readings of so long the one with the shortest round trip places samples for the guards [s]."""
KEPT_S = 120.0
"""Readings of so long before a run belong to it [s]: they show the drift of a short one."""
RECORDED_S = 10.0
"""So often readings go into the run file [s]; …"""
BEST_OF_S = 1.0
"""… of each such time the one with the shortest round trip."""


class _Clock:
    """Readings of one device's clock."""

    def __init__(self) -> None:
        self.kept: deque[ClockReading] = deque()
        self.written_s = -np.inf
        """Up to which stand time they are in the run [s]."""

    def take(self, reading: ClockReading) -> None:
        """Keep a reading; of two within :data:`BEST_OF_S` that with the shorter round trip."""
        newest = self.kept[-1] if self.kept else None
        slot = int(reading.host_s / BEST_OF_S)
        if newest is not None and int(newest.host_s / BEST_OF_S) == slot:
            if newest.host_s > self.written_s and reading.half_trip_s < newest.half_trip_s:
                self.kept[-1] = reading
            return
        self.kept.append(reading)
        while self.kept[0].host_s < reading.host_s - KEPT_S:
            self.kept.popleft()

    def best(self) -> ClockReading | None:
        """Return the reading of late with the shortest round trip."""
        since_s = self.kept[-1].host_s - LIVE_S if self.kept else 0.0
        late = (one for one in self.kept if one.host_s >= since_s)
        return min(late, key=lambda one: one.half_trip_s, default=None)

    def due(self) -> list[ClockReading]:
        """Return (once) those that are not in the run yet."""
        found = [one for one in self.kept if one.host_s > self.written_s]
        if found:
            self.written_s = found[-1].host_s
        return found


class OwnClocks:
    """Every clock of a stand that has a device with a clock of its own beside the controller.

    Parameters
    ----------
    sensors : iterable of Sensor
        Of the stand.
    log : RunLog
        Where readings go.
    main : StreamFacts
        Of the controller.
    """

    def __init__(self, sensors: Iterable[Sensor], log: RunLog, main: StreamFacts) -> None:
        self._devices = {one.facts.name: one for one in sensors if isinstance(one, OwnClock)}
        self._clocks = {name: _Clock() for name in (main.name, *self._devices)}
        self._log, self._main, self._doubt_s = log, main.name, main.clock_doubt_s
        self._due_s = -np.inf

    @property
    def there(self) -> bool:
        """Whether there is such a device: else nothing is read, and nothing recorded."""
        return bool(self._devices)

    def owns(self, stream: str) -> bool:
        """Return whether a stream's stamps are of a clock of its own."""
        return stream in self._devices

    def take_controller(self, device_us: int | None, asked_s: float, told_s: float) -> None:
        """Take a look at the controller's clock [µs] between two stand times [s]; None where it has none."""
        if self.there and device_us is not None:
            half_s = 0.5 * (told_s - asked_s)
            reading = ClockReading(device_us, asked_s + half_s, half_s + self._doubt_s)
            self._clocks[self._main].take(reading)

    def take_all(self) -> None:
        """Take what the devices' clocks have shown since the last pass."""
        for name, device in self._devices.items():
            for reading in device.clock_readings():
                self._clocks[name].take(reading)

    def on_host(self, block: ScaledBlock) -> ScaledBlock:
        """Return a block of such a device as guards look at it: its channels, stamped by the host's clock.

        Before its clock was read the newest sample counts as of the moment at which it came.
        """
        best = self._clocks[block.stream].best()
        if best is None:
            offset_us = round(block.received_s * 1e6) - (int(block.time_us[-1]) if len(block) else 0)
        else:
            offset_us = round(best.host_s * 1e6) - best.device_us
        own = {name: value for name, value in block.values.items() if name not in DERIVED}
        return replace(block, time_us=block.time_us + offset_us, values=own)

    def begin_run(self) -> None:
        """Have what was read before written into the run that begins."""
        for clock in self._clocks.values():
            clock.written_s = -np.inf
        self._due_s = -np.inf

    def record(self, now_s: float, *, last: bool = False) -> None:
        """Write what is due into the run under way; all of it where it ends.

        Parameters
        ----------
        now_s : float
            Stand time [s].
        last : bool
            Whether nothing more will be recorded.
        """
        if not self.there or self._log.recorder is None or (now_s < self._due_s and not last):
            return
        self._due_s = now_s + RECORDED_S
        for name, clock in self._clocks.items():
            if found := clock.due():
                self._log.say(CLOCK_EVENT, _said(name, clock, last=last), **_columns(name, found))


def _columns(stream: str, readings: list[ClockReading]) -> dict[str, object]:
    return {
        "stream": stream,
        "device_us": [one.device_us for one in readings],
        "host_s": [round(one.host_s, 7) for one in readings],
        "half_trip_s": [round(one.half_trip_s, 7) for one in readings],
    }


def _said(name: str, clock: _Clock, *, last: bool) -> str:
    readings = list(clock.kept)
    line = ClockLine(
        ClockReadings(
            np.array([one.device_us for one in readings], dtype=np.int64),
            np.array([one.host_s for one in readings]),
            np.array([one.half_trip_s for one in readings]),
        )
    )
    when = "at the end" if last else "so far"
    return (
        f"clock of {name} {when}: {line.offset_s:.6f} s behind the computer's, drift {1e6 * line.drift:+.1f} "
        f"ppm, known to {1e3 * line.bound_s:.2f} ms"
    )
