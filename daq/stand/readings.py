"""Live readings of a stand: every channel in counts and in its unit, nothing moved or set."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers import RecordingDevices, SampleBlock, Sensor, SensorFault, Stand, StreamFacts
from bufferstand.drivers.controllers import is_read_by_one, who_uses
from bufferstand.foundation import Clock, DeviceFault
from bufferstand.foundation.channels import Channel, Zero

PASS_S = 0.02
"""From one look at the devices to the next [s]."""
LOOK_S = 0.5
"""So often it is seen whether another program has begun to command the stand [s]."""


@dataclass(frozen=True)
class ChannelReading:
    """What a channel showed over a stretch of time.

    Parameters
    ----------
    stream, name, unit, place : str
    samples : int
        How many there were; without any, the numbers are None.
    counts, value : float or None
        Means: as delivered, and by the calibration of the stand file.
    noise : float or None
        Standard deviation, in the unit.
    noise_counts : float or None
        The same in counts.
    from_zero : float or None
        The value from the stored zero, where there is one.
    age_s : float or None
        How long ago the last sample was received [s].
    raw_unit : str
        What ``counts`` and ``noise_counts`` are: ``counts``, or ``V`` of a device that delivers volts.
    """

    stream: str
    name: str
    unit: str
    place: str
    samples: int
    counts: float | None
    value: float | None
    noise: float | None
    noise_counts: float | None
    from_zero: float | None
    age_s: float | None
    raw_unit: str = "counts"

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data."""
        return asdict(self)


@dataclass
class _Heard:
    facts: StreamFacts
    counts: dict[str, list[NDArray[np.generic]]] = field(default_factory=dict)
    received_s: float | None = None

    def take(self, block: SampleBlock) -> None:
        for name, values in block.counts.items():
            self.counts.setdefault(name, []).append(values)
        if len(block.time_us):
            self.received_s = block.received_s


class StandReader:
    """Reads a stand for a while; may be asked again and again.

    Parameters
    ----------
    stand : Stand or RecordingDevices
        Connected, its sensors started: by the caller, or by :meth:`begin`. Of a stand that another controller
        moves there are only its devices.
    clock : Clock
    """

    def __init__(self, stand: Stand | RecordingDevices, clock: Clock) -> None:
        self._controller = stand.controller if isinstance(stand, Stand) else None
        self._sensors: Sequence[Sensor] = stand.sensors if isinstance(stand, Stand) else stand.all
        self._clock = clock
        self._heard_s: dict[str, float] = {}
        self.faults: list[str] = []
        """What sensors said of themselves while they were read last."""

    def begin(self) -> list[str]:
        """Connect to the controller, and begin to read every sensor that can be opened.

        A sensor is one program's at a time: while the stand is moved by another terminal, that one holds the
        serial ports, and what is left is worth reading all the same.

        Returns
        -------
        list of str
            Why a sensor could not be opened, one line each.

        Raises
        ------
        DeviceFault
            If the controller does not answer.
        """
        if self._controller is not None:
            self._controller.connect()
        unopened: list[str] = []
        for sensor in self._sensors:
            try:
                sensor.start()
            except DeviceFault as fault:
                unopened.append(str(fault))
        return list(dict.fromkeys(unopened))

    def read(self, duration_s: float, zero: Zero | None = None) -> list[ChannelReading]:
        """Return every channel over the next ``duration_s`` of stand time, controller first.

        Raises
        ------
        DeviceFault
            If the controller's wire fails.
        """
        heard = self.collect(duration_s)
        return [
            self._reading(one.facts, channel, one.counts.get(channel.name, []), zero)
            for one in heard.values()
            for channel in one.facts.channels
        ]

    def collect(self, duration_s: float) -> Mapping[str, _Heard]:
        """Return what every stream delivers in the next ``duration_s``, by stream."""
        controller, clock = self._controller, self._clock
        heard = {} if controller is None else {controller.facts.name: _Heard(controller.facts)}
        heard |= {sensor.facts.name: _Heard(sensor.facts) for sensor in self._sensors}
        self.faults = []
        began_s = looked_s = clock.now_s()
        if alone := controller if self._is_alone() else None:
            alone.skip_backlog()
        until_s = began_s + duration_s
        while clock.now_s() < until_s:
            if alone and clock.now_s() - looked_s >= LOOK_S:
                alone, looked_s = controller if self._is_alone() else None, clock.now_s()
            while alone and (block := alone.read_block()) is not None and clock.now_s() < until_s:
                heard[block.stream].take(block)
            for sensor in self._sensors:
                for item in sensor.drain():
                    if isinstance(item, SensorFault):
                        self.faults.append(f"{item.stream}: {item.what}")
                    else:
                        heard[item.stream].take(item)
            if controller is not None:
                self.faults += controller.events()
            clock.sleep(PASS_S)
        for name, one in heard.items():
            if one.received_s is not None:
                self._heard_s[name] = one.received_s
        return heard

    def _is_alone(self) -> bool:
        """Return whether there are samples of a controller that are nobody else's; say it where they are."""
        controller = self._controller
        if controller is None:
            return False
        if not is_read_by_one(controller) or not (who := who_uses(controller)):
            return True
        self.faults.append(
            f"controller: {who}; its ring is not read, since that would acknowledge samples that the other "
            "program still wants: look at the readings that one shows"
        )
        return False

    def _reading(
        self,
        facts: StreamFacts,
        channel: Channel,
        parts: Sequence[NDArray[np.generic]],
        zero: Zero | None,
    ) -> ChannelReading:
        last_s = self._heard_s.get(facts.name)
        age_s = None if last_s is None else max(0.0, self._clock.now_s() - last_s)
        raw = np.concatenate(parts).astype(np.float64) if parts else np.zeros(0)
        if not raw.size:
            return ChannelReading(
                facts.name,
                channel.name,
                channel.unit,
                channel.place,
                0,
                *(None,) * 5,
                age_s,
                facts.raw_unit(channel.name),
            )
        value = channel.calibration.apply(raw)
        mean = float(np.mean(value))
        found = None if zero is None else zero.of(channel.name)
        return ChannelReading(
            facts.name,
            channel.name,
            channel.unit,
            channel.place,
            int(raw.size),
            float(np.mean(raw)),
            mean if math.isfinite(mean) else None,
            float(np.std(value)),
            float(np.std(raw)),
            None if found is None else mean - found.value,
            age_s,
            facts.raw_unit(channel.name),
        )
