"""DS18B20 sensors through the kernel's 1-Wire folder, in one of three ways.

``w1_slave``: the nine bytes of each sensor, one conversion after the other. ``temperature``: the kernel's
number, where that file is all there is; what it cannot tell is looked up in ``w1_slave``. ``bulk``: one
conversion for all (``therm_bulk_read``), then the nine bytes of each.
Source: Linux, drivers/w1/slaves/w1_therm.c and its ABI documentation.
"""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Literal

from bufferstand.drivers.thermometers.bus import BusSensor as W1Sensor
from bufferstand.drivers.thermometers.bus import TemperatureBus
from bufferstand.drivers.thermometers.ds18b20 import (
    ReadingFault,
    TemperatureReading,
    decode_temperature,
    decode_w1_slave,
)
from bufferstand.drivers.thermometers.ds18b20_sensor import DS18B20
from bufferstand.drivers.thermometers.ds18b20_settings import OneWireSettings
from bufferstand.foundation import Clock, DeviceFault

__all__ = ["FolderReader", "W1Bus", "W1Sensor", "read_sensor", "read_temperature", "roms_on_bus"]

Access = Literal["w1_slave", "temperature", "bulk"]

TRIGGER = b"trigger\n"
"""What starts a bulk conversion: exactly these eight bytes, anything else is silently ignored."""
CONVERSION_MOST_S = 2.0
"""Longest wait for a bulk conversion [s of the wall]; the slowest clones take 0.75 s."""
_POLL_S = 0.02


def read_sensor(root: Path, rom: str) -> TemperatureReading | ReadingFault:
    """Read one sensor's nine bytes once; blocks for its conversion (up to 0.8 s).

    Parameters
    ----------
    root : Path
        Folder of the 1-Wire devices.
    rom : str
        The sensor's name in it.
    """
    text = _text(root / rom / "w1_slave")
    return text if isinstance(text, ReadingFault) else decode_w1_slave(text)


def read_temperature(root: Path, rom: str) -> TemperatureReading | ReadingFault:
    """Read one sensor through its ``temperature`` file.

    85.0 °C and 0.0 °C are ambiguous there (power-on value; all bytes zero), so they are looked up in the
    nine bytes.
    """
    text = _text(root / rom / "temperature")
    if isinstance(text, ReadingFault):
        return text
    found = decode_temperature(text)
    return read_sensor(root, rom) if found is None else found


def roms_on_bus(root: Path) -> tuple[str, ...]:
    """Return every DS18B20 that the kernel sees, in order; none where the folder cannot be listed."""
    try:
        return tuple(sorted(path.name for path in root.iterdir() if path.name.startswith("28-")))
    except OSError:
        return ()


class FolderReader:
    """The kernel's folder as a bus.

    Parameters
    ----------
    root : Path
        Folder of the 1-Wire devices.
    access : str
        ``w1_slave``, ``temperature`` or ``bulk``.
    master : str
        Folder of the bus master whose ``therm_bulk_read`` is used.
    wall_s : callable
        Monotonic time [s].
    sleep : callable
        Waits for a time [s].
    """

    def __init__(
        self,
        root: Path,
        access: Access = "w1_slave",
        master: str = "w1_bus_master1",
        *,
        wall_s: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._root = root
        self._access = access
        self._bulk = root / master / "therm_bulk_read"
        self._wall_s = wall_s
        self._sleep = sleep
        self._notes: list[str] = []
        self._bulk_problem = ""

    def check(self) -> None:
        """See that the folder is there.

        Raises
        ------
        DeviceFault
            If it is not.
        """
        if not self._root.is_dir():
            raise DeviceFault(
                f"1-Wire: there is no folder {self._root}; look whether the kernel's w1 driver is loaded "
                "and temperature.root of the stand file is right"
            )

    def read(self, roms: Sequence[str]) -> Iterator[tuple[str, TemperatureReading | ReadingFault]]:
        """Yield the reading of each sensor, or why there is none."""
        if self._access == "bulk":
            self._note_bulk(self._trigger())
        one = read_temperature if self._access == "temperature" else read_sensor
        for rom in roms:
            yield rom, one(self._root, rom)

    def notes(self) -> list[str]:
        """Get (and forget) what is remarkable about the bus since the last call."""
        notes, self._notes = self._notes, []
        return notes

    def close(self) -> None:
        """Let go: nothing is held."""

    def _note_bulk(self, problem: str) -> None:
        """Say a problem with the common conversion when it is new: the sensors are read one by one then."""
        if problem and problem != self._bulk_problem:
            self._notes.append(f"{problem}; the sensors are converted one by one, which takes longer")
        self._bulk_problem = problem

    def _trigger(self) -> str:
        """Let all sensors convert at once; return what went wrong.

        The kernel's answer to the write says nothing: it takes any bytes. So the state is read afterwards:
        −1 a conversion runs, 1 values wait to be read, 0 nothing was triggered.
        """
        try:
            descriptor = os.open(self._bulk, os.O_WRONLY)
            try:
                os.write(descriptor, TRIGGER)  # one write; it may block for the conversion
            finally:
                os.close(descriptor)
        except FileNotFoundError:
            return (
                f"there is no {self._bulk}; the kernel is too old for it, or this is not the first bus "
                "master (only that has it: temperature.bulk_master)"
            )
        except PermissionError:
            return f"{self._bulk} may not be written; bulk reading needs root, or a udev rule"
        except OSError as error:
            return f"{self._bulk} cannot be written ({error.strerror})"
        deadline_s = self._wall_s() + CONVERSION_MOST_S
        while True:
            state = _text(self._bulk)
            if isinstance(state, str) and state.strip() == "1":
                return ""
            if state == "0\n" or isinstance(state, ReadingFault):
                return f"{self._bulk} did not take the trigger (it shows {_shown(state)})"
            if self._wall_s() >= deadline_s:
                return f"the common conversion did not end within {CONVERSION_MOST_S:g} s"
            self._sleep(_POLL_S)


class W1Bus(TemperatureBus):
    """The kernel's 1-Wire folder and the one thread that reads it.

    Parameters
    ----------
    root : Path
        Folder of the 1-Wire devices.
    settings : OneWireSettings
        Sensors, period, way of reading.
    clock : Clock
        Stand time for period and stamps, wall time for the judgement of a stall.
    """

    def __init__(self, root: Path, settings: OneWireSettings, clock: Clock) -> None:
        reader = FolderReader(root, settings.access, settings.bulk_master)
        super().__init__(reader, settings, clock, DS18B20)


def _text(path: Path) -> str | ReadingFault:
    try:
        return path.read_text(encoding="ascii")
    except FileNotFoundError:
        return ReadingFault.ABSENT
    except UnicodeDecodeError:
        return ReadingFault.GARBLED
    except PermissionError:
        return ReadingFault.UNREADABLE
    except OSError as error:
        gone = error.errno in {errno.ENODEV, errno.ENXIO}
        return ReadingFault.ABSENT if gone else ReadingFault.EMPTY


def _shown(state: str | ReadingFault) -> str:
    return (
        f"“{state.strip()}”" if isinstance(state, str) and not isinstance(state, ReadingFault) else "nothing"
    )
