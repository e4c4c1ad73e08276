"""Sensors on one bus: one thread reads them in turn, one stream for each.

A read may block (that of a DS18B20 for its conversion, up to 0.8 s); so it never happens in the acquisition
loop. How the bus is reached (kernel folder, serial adapter) is a reader's business.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from bufferstand.drivers.instruments import SensorEntry, SensorType, TemperatureEntry
from bufferstand.drivers.interfaces import SampleBlock, SensorFault
from bufferstand.drivers.mailbox import Mailbox
from bufferstand.drivers.thermometers.ds18b20 import (
    FAULT_TEXTS,
    ReadingFault,
    TemperatureReading,
)
from bufferstand.foundation import Clock, DeviceFault

_POLL_S = 0.01
_READ_WORST_S = 1.0
_LEAST_STALL_S = 5.0
_RETRY_S = 1.0


class BusReader(Protocol):
    """A way to the sensors of one bus."""

    def check(self) -> None:
        """See that the bus is there; may be called again.

        Raises
        ------
        DeviceFault
            If it is not.
        """
        ...

    def read(self, addresses: Sequence[str]) -> Iterator[tuple[str, TemperatureReading | str]]:
        """Yield the reading of each sensor, or why there is none, as soon as it is known.

        That is a :class:`ReadingFault`, or a sentence that says what is wrong and where to look.

        Raises
        ------
        DeviceFault, OSError
            If the bus as a whole failed; it is closed, and tried again with the next round.
        """
        ...

    def notes(self) -> Sequence[str]:
        """Get (and forget) what is remarkable about the bus since the last call."""
        ...

    def close(self) -> None:
        """Let go of the bus; never raises."""
        ...


class BusSensor:
    """Sensor of :mod:`bufferstand.drivers.interfaces`: one thermometer, read by its bus.

    Parameters
    ----------
    bus : TemperatureBus
        Who reads it.
    settings : SensorEntry
        Address, name and place.
    period_s : float
        Stand time between two readings [s].
    sensor_type : SensorType
        What it is.
    """

    def __init__(
        self, bus: TemperatureBus, settings: SensorEntry, period_s: float, sensor_type: SensorType
    ) -> None:
        self.facts = sensor_type.stream_facts(settings, period_s)
        self.address = settings.address
        self._dtype = sensor_type.form.dtype
        self._place = settings.place
        self._bus = bus
        self._mailbox = Mailbox()
        self._sequence = 0
        self._is_open = False
        self._stalled = False

    def start(self) -> None:
        """Begin to read (the first sensor of a bus starts its thread).

        Raises
        ------
        DeviceFault
            If the bus is not there.
        """
        if not self._is_open:
            self._bus.enter()
            self._is_open = True

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call; never blocks."""
        stall = self._bus.stall() if self._is_open else ""
        if stall and not self._stalled:
            self.refuse(stall)
        self._stalled = bool(stall)
        return self._mailbox.take()

    def close(self) -> None:
        """Stop reading (the last sensor of a bus ends its thread); never raises."""
        if self._is_open:
            self._is_open = False
            self._bus.leave()

    def post(self, reading: TemperatureReading, at_s: float) -> None:
        """Leave a reading, true at stand time ``at_s``."""
        self._mailbox.put(
            SampleBlock(
                stream=self.facts.name,
                first_sequence=self._sequence,
                time_us=np.array([round(at_s * 1e6)], dtype=np.int64),
                counts={self.facts.name: np.array([reading.count], dtype=self._dtype)},
                lost=0,
                received_s=at_s,
            )
        )
        self._sequence += 1

    def refuse(self, what: str) -> None:
        """Leave a fault, with the sensor's name, place and address."""
        text = f"{self.facts.name} ({self._place}, {self.address}): {what}"
        self._mailbox.put(SensorFault(self.facts.name, self._bus.now_s(), text))


class TemperatureBus:
    """A bus of thermometers and the one thread that reads it.

    Parameters
    ----------
    reader : BusReader
        The way to it; read and closed by the thread.
    settings : TemperatureEntry
        Sensors and period.
    clock : Clock
        Stand time for period and stamps, wall time for the judgement of a stall.
    sensor_type : SensorType
        What its sensors are.
    name : str
        What it is called in messages.
    """

    def __init__(
        self,
        reader: BusReader,
        settings: TemperatureEntry,
        clock: Clock,
        sensor_type: SensorType,
        name: str = "1-Wire bus",
    ) -> None:
        self._name = name
        self._reader = reader
        self._period_s = settings.period_s
        self._clock = clock
        self._users = 0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._alive_s = 0.0
        self.sensors = tuple(
            BusSensor(self, sensor, settings.period_s, sensor_type) for sensor in settings.sensor
        )
        self._stall_s = max(_LEAST_STALL_S, 3 * settings.period_s + _READ_WORST_S * len(self.sensors))

    def now_s(self) -> float:
        """Get the stand time [s]."""
        return self._clock.now_s()

    def enter(self) -> None:
        """Count one more sensor in use; the first starts the thread.

        Raises
        ------
        DeviceFault
            If the bus is not there.
        """
        if self._thread is None:
            self._reader.check()
        self._users += 1
        if self._thread is None:
            self._stop = threading.Event()  # a new one: a thread that still hangs in a read keeps the old
            self._alive_s = self._clock.wall_s()
            self._thread = threading.Thread(target=self._run, args=(self._stop,), name="1-wire", daemon=True)
            self._thread.start()

    def leave(self) -> None:
        """Count one sensor less; the last ends the thread (a read under way may outlive it, harmlessly)."""
        self._users -= 1
        if self._users == 0 and self._thread is not None:
            self._stop.set()
            self._thread.join(timeout=2.0)
            self._thread = None

    def stall(self) -> str:
        """Return what is wrong if the thread hangs in a read; empty if it lives."""
        silent_s = self._clock.wall_s() - self._alive_s
        if silent_s < self._stall_s:
            return ""
        return f"a read of the {self._name} hangs for {silent_s:.0f} s; look at the bus and the kernel's log"

    def _run(self, stop: threading.Event) -> None:
        due_s = self._clock.now_s()
        try:
            while not stop.is_set():
                self._alive_s = self._clock.wall_s()
                if self._clock.now_s() < due_s:
                    stop.wait(_POLL_S)
                    continue
                due_s = max(due_s + self._period_s, self._clock.now_s())
                self._round(stop)
        finally:
            self._reader.close()

    def _round(self, stop: threading.Event) -> None:
        """Read every sensor once."""
        by_address = {sensor.address: sensor for sensor in self.sensors}
        try:
            for address, got in self._reader.read(tuple(by_address)):
                self._alive_s = self._clock.wall_s()
                sensor = by_address[address]
                if isinstance(got, TemperatureReading):
                    sensor.post(got, self._clock.now_s())
                else:
                    sensor.refuse(FAULT_TEXTS[got] if isinstance(got, ReadingFault) else got)
                if stop.is_set():
                    return
        except (DeviceFault, OSError) as fault:
            self._reader.close()
            what = str(fault)
            if isinstance(fault, OSError):
                what = f"the {self._name} failed ({fault.strerror or fault}); look at plug and power"
            for sensor in self.sensors:
                sensor.refuse(what)
            stop.wait(_RETRY_S)
        for note in self._reader.notes():
            self.sensors[0].refuse(note)
