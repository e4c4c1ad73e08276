"""DS18B20 sensors through the kernel's 1-Wire folder: one thread reads them in turn, one stream for each.

A read blocks for the conversion, up to 0.8 s; so it never happens in the acquisition loop.
"""

from __future__ import annotations

import errno
import threading
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drivers.ds18b20 import FAULT_TEXTS, Reading, ReadingFault, decode_w1_slave
from drivers.interfaces import DeviceFault, SampleBlock, SensorFault, StreamFacts
from drivers.mailbox import Mailbox
from drivers.stand_file import SensorSettings, TemperatureSettings
from foundation.clock import Clock

_POLL_S = 0.01
_READ_WORST_S = 1.0
_LEAST_STALL_S = 5.0


def read_sensor(root: Path, rom: str) -> Reading | ReadingFault:
    """Read one sensor once; blocks for its conversion (up to 0.8 s).

    Parameters
    ----------
    root : Path
        Folder of the 1-Wire devices.
    rom : str
        The sensor's name in it.
    """
    path = root / rom / "w1_slave"
    try:
        text = path.read_text(encoding="ascii")
    except FileNotFoundError:
        return ReadingFault.ABSENT
    except UnicodeDecodeError:
        return ReadingFault.GARBLED
    except PermissionError:
        return ReadingFault.UNREADABLE
    except OSError as error:
        gone = error.errno in {errno.ENODEV, errno.ENXIO}
        return ReadingFault.ABSENT if gone else ReadingFault.EMPTY
    return decode_w1_slave(text)


def roms_on_bus(root: Path) -> tuple[str, ...]:
    """Return every DS18B20 that the kernel sees, in order; none where the folder cannot be listed."""
    try:
        return tuple(sorted(path.name for path in root.iterdir() if path.name.startswith("28-")))
    except OSError:
        return ()


class W1Sensor:
    """Sensor of :mod:`drivers.interfaces`: one DS18B20, read by its bus.

    Parameters
    ----------
    bus : W1Bus
        Who reads it.
    settings : SensorSettings
        ROM, name and place.
    period_s : float
        Stand time between two readings [s].
    """

    facts: StreamFacts

    def __init__(self, bus: W1Bus, settings: SensorSettings, period_s: float) -> None:
        self.facts = StreamFacts(
            settings.name, "host", (settings.channel(),), 1.0 / period_s, f"DS18B20 {settings.rom}"
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
            If the folder of 1-Wire devices is not there.
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

    def post(self, reading: Reading, at_s: float) -> None:
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


class W1Bus:
    """The 1-Wire folder and the one thread that reads it.

    Parameters
    ----------
    root : Path
        Folder of the 1-Wire devices.
    settings : TemperatureSettings
        Sensors and period.
    clock : Clock
        Stand time for period and stamps, wall time for the judgement of a stall.
    """

    def __init__(self, root: Path, settings: TemperatureSettings, clock: Clock) -> None:
        self._root = root
        self._period_s = settings.period_s
        self._clock = clock
        self._users = 0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._alive_s = 0.0
        self.sensors = tuple(W1Sensor(self, sensor, settings.period_s) for sensor in settings.sensor)
        self._stall_s = max(_LEAST_STALL_S, 3 * settings.period_s + _READ_WORST_S * len(self.sensors))

    def now_s(self) -> float:
        """Get the stand time [s]."""
        return self._clock.now_s()

    def enter(self) -> None:
        """Count one more sensor in use; the first starts the thread.

        Raises
        ------
        DeviceFault
            If the folder is not there.
        """
        if not self._root.is_dir():
            raise DeviceFault(
                f"1-Wire: there is no folder {self._root}; look whether the kernel's w1 driver is loaded "
                "and temperature.root of the stand file is right"
            )
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
        while not stop.is_set():
            self._alive_s = self._clock.wall_s()
            if self._clock.now_s() < due_s:
                stop.wait(_POLL_S)
                continue
            due_s = max(due_s + self._period_s, self._clock.now_s())
            for sensor in self.sensors:
                if stop.is_set():
                    return
                self._read(sensor)

    def _read(self, sensor: W1Sensor) -> None:
        got = read_sensor(self._root, sensor.rom)
        self._alive_s = self._clock.wall_s()
        if isinstance(got, Reading):
            sensor.post(got, self._clock.now_s())
        else:
            sensor.refuse(FAULT_TEXTS[got])
