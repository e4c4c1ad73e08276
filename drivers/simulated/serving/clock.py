"""The time of a served stand, shown in a file for the program that runs a campaign on it.

Two processes that share a busy computer are starved at different times. A stand that waits for its reader
falls behind ``speed`` times the wall, and a program that counted by the wall would take it for late and
silent. So the stand shows its time, and the program goes by it.
"""

from __future__ import annotations

import mmap
import struct
import threading
import time
from pathlib import Path

from bufferstand.drivers.simulated.wires import CREDIT_S
from bufferstand.foundation import DeviceFault

SHOWN = "time"
"""Name of the file, in the folder of the wires, in which a stand shows its time."""
DEAD_S = 30.0
"""A stand that has shown no time for so long [s of the wall] has ended: time then goes on without it."""
LEAST = 0.05
"""While the stand's time stands still, though the stand is alive, this share of the wall's is counted: who
waits for something by the wall's time does not wait for ever."""

_FORM = struct.Struct("ddd")


class ShownTime:
    """The stand's side: a file of its time, the monotonic wall time of the last look [s], and its speed.

    Parameters
    ----------
    path : Path
        Made anew.
    speed : float
        Stand seconds in one second of the wall.

    Raises
    ------
    OSError
        If it cannot be made.
    """

    def __init__(self, path: Path, speed: float) -> None:
        self._path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh = path.with_name(f".{path.name}.new")
        fresh.write_bytes(_FORM.pack(0.0, time.monotonic(), speed))
        with fresh.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), _FORM.size)
        fresh.replace(path)
        self._numbers = memoryview(self._map).cast("d")  # stored whole, unlike what struct writes

    def show(self, stand_s: float) -> None:
        """Show the stand's time [s]: that of its newest sample."""
        self._numbers[0] = stand_s
        self._numbers[1] = time.monotonic()

    def close(self) -> None:
        """Take the file away."""
        self._numbers.release()
        self._map.close()
        self._path.unlink(missing_ok=True)


class StandClock:
    """The clock of a program whose stand shows its time; threads may share it.

    ``now_s`` is the stand's. ``wall_s``, by which silence is judged, leaves out what this process or the
    stand was starved: it counts while both were seen alive, ``CREDIT_S`` beyond at most, and no faster than
    the stand's own time goes at its speed. A stand that gets a tenth of a computer makes a tenth of its
    samples, and its sensors convert ten times as long; they are not silent for that.

    Parameters
    ----------
    path : Path
        The stand's file.

    Raises
    ------
    DeviceFault
        If the stand shows no time there.
    """

    def __init__(self, path: Path) -> None:
        try:
            with path.open("rb") as file:
                self._map = mmap.mmap(file.fileno(), _FORM.size, access=mmap.ACCESS_READ)
        except (OSError, ValueError) as error:
            raise DeviceFault(f"the simulated stand shows no time at {path}: {error}") from None
        self._numbers = memoryview(self._map).cast("d")
        self._speed = self._numbers[2]
        self._lock = threading.Lock()
        self._looked_s = time.monotonic()
        self._now_s = self._wall_s = 0.0
        self._lived_s = CREDIT_S

    @property
    def speed(self) -> float:
        """Return how many of its seconds pass in one of the wall where nothing is starved."""
        return self._speed

    def now_s(self) -> float:
        """Get the stand's time [s]; it never steps back."""
        return self._look()[0]

    def wall_s(self) -> float:
        """Get the time [s] of the wall that program and stand both lived."""
        return self._look()[1]

    def sleep(self, duration_s: float) -> None:
        """Wait as long as ``duration_s`` of stand time takes where nothing is starved."""
        end_s = time.monotonic() + max(0.0, duration_s) / self._speed
        while True:
            time.sleep(max(0.0, min(end_s - time.monotonic(), 0.5 * CREDIT_S)))
            self._look()  # a long wait is no starvation
            if time.monotonic() >= end_s:
                return

    def _look(self) -> tuple[float, float]:
        with self._lock:
            real_s = time.monotonic()
            stand_s, shown_s = self._numbers[0], self._numbers[1]
            passed_s = real_s - self._looked_s
            if real_s - shown_s > DEAD_S:
                self._now_s += passed_s * self._speed
                self._wall_s += passed_s
            else:
                self._lived_s += max(0.0, stand_s - self._now_s) / self._speed
                self._lived_s = min(self._lived_s, CREDIT_S)
                self._now_s = max(self._now_s, stand_s)
                alive_s = max(0.0, min(CREDIT_S, min(real_s, shown_s + CREDIT_S) - self._looked_s))
                counted_s = min(alive_s, max(self._lived_s, LEAST * alive_s))
                self._lived_s = max(0.0, self._lived_s - counted_s)
                self._wall_s += counted_s
            self._looked_s = real_s
            return self._now_s, self._wall_s
