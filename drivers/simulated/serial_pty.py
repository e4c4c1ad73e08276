"""The simulated amplifier on a real wire: GSV-2 frames on a pseudo-terminal, and the commands it obeys.

A frame is ``,`` (0x2C), a status byte and 24 bits, big-endian, offset binary about 0x800000.
Source: ME-Messysteme, GSV-2 manual, binary format.
"""

from __future__ import annotations

import fcntl
import os
import struct
import termios
import tty
from collections import deque
from contextlib import suppress
from pathlib import Path

import numpy as np

from drivers.simulated.device import FULL_SCALE, Frames
from foundation.errors import BadInput

STOP, START, SET_ZERO, READ_FREQUENCY = 0x23, 0x24, 0x0C, 0x16
"""Commands of one byte."""
SYNC = 0x2C
ZERO = 0x800000
BUFFER = 4000
"""Bytes that wait for the reader; a serial port's driver has as many."""


class AmplifierPty:
    """A serial port at a path of one's choice, behind which the amplifier streams.

    Parameters
    ----------
    link : Path
        Where the serial device shall appear, as a symbolic link.
    frames : deque of Frames
        The amplifier's values; taken from here as they are sent.
    rate_Hz : float
        Frames a second that it says it is set to.

    Raises
    ------
    BadInput
        If something that is no link lies there, or the link cannot be made.
    """

    def __init__(self, link: Path, frames: deque[Frames], rate_Hz: float) -> None:
        self._frames = frames
        self._frequency = ((1 << 24) - round(5e6 / rate_Hz)).to_bytes(3, "big")
        self._streaming = True
        self._offset = 0
        self._last_count = 0
        self.overruns = 0
        """How often the reader came too late and what waited was lost."""
        self.link = link
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        try:
            if link.exists() and not link.is_symlink():
                raise BadInput(
                    "a device or file lies where the simulated amplifier shall appear",
                    file=link,
                    place="amplifier.port",
                    remedy="choose another path: a real device is never replaced",
                )
            link.parent.mkdir(parents=True, exist_ok=True)
            link.unlink(missing_ok=True)
            link.symlink_to(os.ttyname(self._slave))
        except OSError as error:
            self._close_ends()
            raise BadInput(f"cannot be made: {error.strerror}", file=link, place="amplifier.port") from None
        except BadInput:
            self._close_ends()
            raise

    def pump(self, *, silent: bool = False) -> None:
        """Obey what has been written to the port, and send what has become due."""
        self._obey()
        counts = [frames.counts for frames in self._frames]
        self._frames.clear()
        if not counts:
            return
        values = np.concatenate(counts)
        self._last_count = int(values[-1])
        if self._streaming and not silent:
            self._send(encode_frames(values - self._offset))

    def close(self) -> None:
        """Take the port away."""
        with suppress(OSError):
            if self.link.is_symlink() and os.readlink(self.link) == os.ttyname(self._slave):  # noqa: PTH115
                self.link.unlink()
        self._close_ends()

    def _close_ends(self) -> None:
        os.close(self._master)
        os.close(self._slave)

    def _obey(self) -> None:
        with suppress(BlockingIOError):
            for byte in os.read(self._master, 256):
                if byte == STOP:
                    self._streaming = False
                elif byte == START:
                    self._streaming = True
                elif byte == SET_ZERO:
                    self._offset = self._last_count
                elif byte == READ_FREQUENCY:
                    self._send(self._frequency)

    def _send(self, data: bytes) -> None:
        waiting = struct.unpack("i", fcntl.ioctl(self._slave, termios.FIONREAD, b"\0\0\0\0"))[0]
        if waiting + len(data) > BUFFER:
            self.overruns += 1
            termios.tcflush(self._slave, termios.TCIFLUSH)
        with suppress(BlockingIOError):
            os.write(self._master, data[-BUFFER + BUFFER % 5 :])


def encode_frames(counts: np.ndarray[tuple[int], np.dtype[np.int64]]) -> bytes:
    """Return the frames of counts about zero, shape (n,); beyond full scale they are saturated."""
    raw = np.clip(counts, -FULL_SCALE, FULL_SCALE) + ZERO
    table = np.empty((raw.size, 5), dtype=np.uint8)
    table[:, 0] = SYNC
    table[:, 1] = 0
    table[:, 2] = raw >> 16
    table[:, 3] = raw >> 8 & 0xFF
    table[:, 4] = raw & 0xFF
    return table.tobytes()
