"""DS18B20 sensors on one 1-Wire bus: one thread reads them in turn, one stream for each.

A read blocks for the conversion, up to 0.8 s; so it never happens in the acquisition loop. How the bus is
reached (kernel folder, serial adapter) is a reader's business.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from bufferstand.drivers.interfaces import SampleBlock, SensorFault, StreamFacts
from bufferstand.drivers.mailbox import Mailbox
from bufferstand.drivers.stand_file import OneWireSettings, SensorSettings
from bufferstand.drivers.thermometers.ds18b20 import (
    FAULT_TEXTS,
    ReadingFault,
    TemperatureReading,
    looks_genuine,
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

    def read(self, roms: Sequence[str]) -> Iterator[tuple[str, TemperatureReading | ReadingFault]]:
        """Yield the reading of each sensor, or why there is none, as soon as it is known.

        Raises
        ------
        DeviceFault
            If the bus as a whole failed; it is tried again with the next round.
        """
        ...

    def notes(self) -> Sequence[str]:
        """Get (and forget) what is remarkable about the bus since the last call."""
        ...

    def close(self) -> None:
        """Let go of the bus; never raises."""
        ...


class BusSensor:
    """Sensor of :mod:`bufferstand.drivers.interfaces`: one DS18B20, read by its bus.

    Parameters
    ----------
    bus : TemperatureBus
        Who reads it.
    settings : SensorSettings
        ROM, name and place.
    period_s : float
        Stand time between two readings [s].
    """

    facts: StreamFacts

    def __init__(self, bus: TemperatureBus, settings: SensorSettings, period_s: float) -> None:
        kind = "DS18B20" if looks_genuine(settings.rom) else "DS18B20 (clone)"
        self.facts = StreamFacts(
            settings.name, "host", (settings.channel(),), 1.0 / period_s, f"{kind} {settings.rom}"
        )
        self.rom = settings.rom
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
                counts={self.facts.name: np.array([reading.count], dtype=np.int16)},
                lost=0,
                received_s=at_s,
            )
        )
        self._sequence += 1

    def refuse(self, what: str) -> None:
        """Leave a fault, with the sensor's name, place and ROM."""
        text = f"{self.facts.name} ({self._place}, {self.rom}): {what}"
        self._mailbox.put(SensorFault(self.facts.name, self._bus.now_s(), text))


class TemperatureBus:
    """A 1-Wire bus and the one thread that reads it.

    Parameters
    ----------
    reader : BusReader
        The way to it; read and closed by the thread.
    settings : TemperatureSettings
        Sensors and period.
    clock : Clock
        Stand time for period and stamps, wall time for the judgement of a stall.
    """

    def __init__(self, reader: BusReader, settings: OneWireSettings, clock: Clock) -> None:
        self._reader = reader
        self._period_s = settings.period_s
        self._clock = clock
        self._users = 0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._alive_s = 0.0
        self.sensors = tuple(BusSensor(self, sensor, settings.period_s) for sensor in settings.sensor)
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
        return f"a read of the 1-Wire bus hangs for {silent_s:.0f} s; look at the bus and the kernel's log"

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
        by_rom = {sensor.rom: sensor for sensor in self.sensors}
        try:
            for rom, got in self._reader.read(tuple(by_rom)):
                self._alive_s = self._clock.wall_s()
                sensor = by_rom[rom]
                if isinstance(got, TemperatureReading):
                    sensor.post(got, self._clock.now_s())
                else:
                    sensor.refuse(FAULT_TEXTS[got])
                if stop.is_set():
                    return
        except DeviceFault as fault:
            for sensor in self.sensors:
                sensor.refuse(str(fault))
            stop.wait(_RETRY_S)
        for note in self._reader.notes():
            self.sensors[0].refuse(note)
