"""A dialogue on an open serial port: short questions, whole answers, bounded waits."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import serial

from bufferstand.drivers.serial_line.port_errors import cannot_be_opened
from bufferstand.foundation import Clock, DeviceFault

READ_S = 0.05
"""Longest wait of one read [s]."""
QUIET_S = 0.5
"""Longest wait for an answer, or for quiet [s of the wall]."""


class Port(Protocol):
    """What is needed of a serial port (``serial.Serial``)."""

    @property
    def in_waiting(self) -> int:
        """Bytes that have come in."""
        ...

    def read(self, size: int = 1, /) -> bytes:
        """Get up to ``size`` bytes; waits for the first no longer than its timeout."""
        ...

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class SerialLine:
    """A serial port with somebody at the other end.

    Parameters
    ----------
    port : Port
        Open, with a short timeout.
    clock : Clock
        Its wall time bounds the waits.
    name : str
        What messages call the device.
    """

    def __init__(self, port: Port, clock: Clock, name: str) -> None:
        self.port = port
        self.name = name
        self._clock = clock

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self.port.write(data)

    def read(self, count: int, wait_s: float = QUIET_S) -> bytes:
        """Get ``count`` bytes, or what came within ``wait_s``."""
        answer = b""
        deadline_s = self._clock.wall_s() + wait_s
        while len(answer) < count and self._clock.wall_s() < deadline_s:
            answer += self.port.read(count - len(answer))
        return answer

    def read_line(self, wait_s: float = QUIET_S, end: bytes = b"\n") -> bytes:
        """Get bytes up to and with the end of a line, or what came within ``wait_s``."""
        answer = b""
        deadline_s = self._clock.wall_s() + wait_s
        while not answer.endswith(end) and self._clock.wall_s() < deadline_s:
            answer += self.port.read(1)
        return answer

    def ask(self, question: bytes, count: int) -> bytes:
        """Send a question; get its answer of ``count`` bytes, or what came of it."""
        self.port.write(question)
        return self.read(count)

    def quieten(self) -> bool:
        """Read away what was under way; return whether it became quiet."""
        deadline_s = self._clock.wall_s() + QUIET_S
        while self.port.read(4096):
            if self._clock.wall_s() >= deadline_s:
                return False
        return True


def open_port(path: Path, baud: int, name: str) -> serial.Serial:
    """Open a serial port for a dialogue, for this program alone.

    Parameters
    ----------
    path : Path
        Serial device.
    baud : int
    name : str
        What messages call the device.

    Raises
    ------
    DeviceFault
        If it cannot be opened, with what to do.
    """
    try:
        return serial.Serial(str(path), baud, timeout=READ_S, write_timeout=QUIET_S, exclusive=True)
    except (OSError, ValueError) as error:
        reason = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        raise DeviceFault(cannot_be_opened(name, reason)) from None


def parity_of(port: Path, even: bool) -> str:
    """Return the parity to set, as pyserial names it: a pseudo-terminal (a simulated device) knows none."""
    simulated = str(port.resolve()).startswith("/dev/pts/")
    return "E" if even and not simulated else "N"
