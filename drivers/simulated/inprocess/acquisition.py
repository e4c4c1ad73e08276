"""A simulated acquisition device without wires, behind the interface that the acquisition loop sees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.drivers.interfaces import ClockReading, SampleBlock, SensorFault, StreamFacts
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.machine import Scans, SimulatedAcquisition, SimulatedDevice

PACKET_S = 0.02
"""So much time a packet holds [s]."""
CLOCK_EVERY_S = 1.0
"""Between two readings of its clock [s]."""


class InProcessAcquisition:
    """:class:`bufferstand.drivers.acquisition.AcquisitionDevice` in virtual time.

    Parameters
    ----------
    device : SimulatedDevice
    simulated : SimulatedAcquisition
        Of that device.
    clock : VirtualClock
    trip_s, jitter_s : float
        Least round trip of a reading of its clock, and the mean of what comes on top on each way [s].
    seed : int
        Of that jitter.
    """

    def __init__(
        self,
        device: SimulatedDevice,
        simulated: SimulatedAcquisition,
        clock: VirtualClock,
        *,
        trip_s: float,
        jitter_s: float,
        seed: int,
    ) -> None:
        self._device, self._simulated, self._clock = device, simulated, clock
        self._trip_s, self._jitter_s = trip_s, jitter_s
        self._random = np.random.default_rng(seed)
        self._lost = self._taken = 0
        self._silent = False
        self._due_s = 0.0
        entry = simulated.entry
        what = f"simulated {entry.kind}, in process"
        self.facts = StreamFacts(
            simulated.stream,
            "device",
            entry.channels,
            entry.rate_Hz,
            what,
            simulated=True,
            raw_units=entry.raw_units,
        )

    @property
    def identity(self) -> str:
        """Who answered."""
        return self.facts.device

    @property
    def can_ask_for_stop(self) -> bool:
        """Whether it has an output: none."""
        return False

    def ask_for_stop(self, reason: str) -> None:
        """Do nothing: it has no output."""
        del reason

    @property
    def stop_asked(self) -> bool:
        """Whether it was asked: never."""
        return False

    def start(self) -> None:
        """Begin to read: older scans are forgotten, their numbers are not used again."""
        self._taken += sum(len(one.time_s) for one in self._simulated.scans)
        self._simulated.scans.clear()
        self._lost = 0

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call."""
        simulated = self._simulated
        came: list[Scans] = []
        said: list[SampleBlock | SensorFault] = []
        first = self._taken + self._lost
        while simulated.scans and simulated.scans[0].time_s[-1] <= self._clock.now_s() - PACKET_S:
            one = simulated.scans.popleft()
            if self._is_silent(float(one.time_s[-1])):
                if not came:
                    self._lost += len(one.time_s)
                    first += len(one.time_s)
                    continue
                simulated.scans.appendleft(one)
                break
            came.append(one)
        silent = self._is_silent(self._clock.now_s())
        if silent and not self._silent and not came:  # behind the last that was under way
            text = f"{self.facts.name} (simulated): silent; look at cable, power and network"
            said.append(SensorFault(self.facts.name, self._clock.now_s(), text))
        self._silent = silent and not came
        if not came:
            return said
        time_us = np.rint(simulated.shown_s(np.concatenate([one.time_s for one in came])) * 1e6)
        counts = np.concatenate([one.counts for one in came])
        columns = {
            channel.name: np.ascontiguousarray(counts[:, place])
            for place, channel in enumerate(self.facts.channels)
        }
        block = SampleBlock(
            self.facts.name, first, time_us.astype(np.int64), columns, self._lost, self._clock.now_s()
        )
        self._taken, self._lost = first + len(time_us), 0
        return [block]

    def clock_readings(self) -> Sequence[ClockReading]:
        """Get (and forget) the reading that is due, if one is and the device answers."""
        now_s = self._clock.now_s()
        if now_s < self._due_s or self._is_silent(now_s):
            return []
        self._due_s = now_s + CLOCK_EVERY_S
        there_s, back_s = 0.5 * self._trip_s + self._random.exponential(self._jitter_s, 2)
        # Virtual time has not passed meanwhile: the reading is as if it had been asked for that much before.
        shown_s = float(self._simulated.shown_s(np.array([now_s - back_s]))[0])
        half_s = 0.5 * (there_s + back_s)
        return [ClockReading(round(shown_s * 1e6), now_s - half_s, half_s)]

    def close(self) -> None:
        """Let go: nothing to do."""

    def _is_silent(self, at_s: float) -> bool:
        return self._device.faults.find(self.facts.name, "silent", at_s) is not None
