"""Simulated devices on serial wires: a pseudo-terminal at a path of one's choice, and an instrument on it."""

from __future__ import annotations

import fcntl
import os
import struct
import termios
import time
import tty
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Protocol

import numpy as np

from bufferstand.drivers.instruments import WireDevice
from bufferstand.drivers.simulated.faults import FrameFaults
from bufferstand.drivers.simulated.machine import InstrumentValues
from bufferstand.foundation import BadInput

BUFFER = 4000
"""Bytes that wait for the reader; a serial port's driver has as many."""


class SerialPty:
    """A serial port at a path of one's choice, with a simulated device at its other end.

    Parameters
    ----------
    link : Path
        Where the serial device shall appear, as a symbolic link.
    place : str
        Key of the stand file that names it, for messages.

    Raises
    ------
    BadInput
        If something that is no link lies there, or the link cannot be made.
    """

    def __init__(self, link: Path, place: str) -> None:
        self.overruns = 0
        """How often the reader came too late and what waited was lost."""
        self.link = link
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        try:
            if link.exists() and not link.is_symlink():
                raise BadInput(
                    f"a device or file lies where the simulated {place.partition('.')[0]} shall appear",
                    file=link,
                    place=place,
                    remedy="choose another path: a real device is never replaced",
                )
            link.parent.mkdir(parents=True, exist_ok=True)
            link.unlink(missing_ok=True)
            link.symlink_to(os.ttyname(self._slave))
        except OSError as error:
            self._close_ends()
            raise BadInput(f"cannot be made: {error.strerror}", file=link, place=place) from None
        except BadInput:
            self._close_ends()
            raise

    def fileno(self) -> int:
        """Get the descriptor of the device's end, to wait for."""
        return self._master

    def receive(self) -> bytes:
        """Get what has been written to the port, without waiting."""
        with suppress(BlockingIOError):
            return os.read(self._master, 4096)
        return b""

    def send(self, data: bytes, size: int = 1) -> None:
        """Let bytes come in at the port; what nobody reads is lost beyond a buffer, in pieces of ``size``."""
        if not data:
            return
        waiting = struct.unpack("i", fcntl.ioctl(self._slave, termios.FIONREAD, b"\0\0\0\0"))[0]
        if waiting + len(data) > BUFFER:
            self.overruns += 1
            termios.tcflush(self._slave, termios.TCIFLUSH)
        with suppress(BlockingIOError):
            os.write(self._master, data[-(BUFFER - BUFFER % size) :])

    def close(self) -> None:
        """Take the port away."""
        with suppress(OSError):
            if self.link.is_symlink() and os.readlink(self.link) == os.ttyname(self._slave):  # noqa: PTH115
                self.link.unlink()
        self._close_ends()

    def _close_ends(self) -> None:
        os.close(self._master)
        os.close(self._slave)


class _Answers(Protocol):
    def obey(self, data: bytes) -> bytes: ...


class AnsweringPty(SerialPty):
    """A serial port behind which a device answers.

    Parameters
    ----------
    link : Path
        Where the serial device shall appear, as a symbolic link.
    device : object
        What answers: its method ``obey`` takes bytes and returns the answers.
    place : str
        Key of the stand file that names the port, for messages.

    Raises
    ------
    BadInput
        If something that is no link lies there, or the link cannot be made.
    """

    def __init__(self, link: Path, device: _Answers, place: str = "temperature.port") -> None:
        super().__init__(link, place)
        self.device = device

    def pump(self) -> None:
        """Obey what has been written to the port."""
        while data := self.receive():
            self.send(self.device.obey(data))


class InstrumentPty(SerialPty):
    """A serial port behind which an instrument streams.

    Parameters
    ----------
    link : Path
        Where the serial device shall appear, as a symbolic link.
    frames : deque of InstrumentValues
        Its values; taken from here as they are sent.
    device : WireDevice
        Which instrument it is.
    place : str
        Key of the stand file that names the port, for messages.
    trouble : FrameTrouble, optional
        What happens on its way to what is sent at once.

    Raises
    ------
    BadInput
        If something that is no link lies there, or the link cannot be made.
    """

    def __init__(
        self,
        link: Path,
        frames: deque[InstrumentValues],
        device: WireDevice,
        trouble: FrameFaults | None = None,
        place: str = "amplifier.port",
    ) -> None:
        super().__init__(link, place)
        self._frames = frames
        self._trouble = trouble
        self._late: list[tuple[float, bytes]] = []
        self.device = device

    def pump(self, *, silent: bool = False, overload: bool = False, drop: int = 0) -> None:
        """Obey what has been written to the port, and send what has become due.

        Parameters
        ----------
        silent : bool
            Send nothing: a cut wire.
        overload : bool
            Send what it sends when its input is overdriven.
        drop : int
            So many bytes of what is sent now are lost on the line.
        """
        self.send(self.device.obey(self.receive()))
        counts = [frames.counts for frames in self._frames]
        self._frames.clear()
        data = self.device.send(np.concatenate(counts), overload=overload) if counts else b""
        now_s = time.monotonic()
        if data and not silent:
            middle = len(data) // 2
            data = data[:middle] + data[middle + drop :]
            arrivals = [(0.0, data)] if self._trouble is None else self._trouble.arrivals(data)
            self._late += [(now_s + delay_s, piece) for delay_s, piece in arrivals]
        for due_s, piece in self._late:
            if due_s <= now_s:
                self.send(piece, size=5)
        self._late = [late for late in self._late if late[0] > now_s]
