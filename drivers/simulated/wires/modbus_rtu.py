"""A simulated device on a serial line: Modbus RTU on a pseudo-terminal.

A real line tells frames apart by 3.5 characters of silence. A pseudo-terminal has no character times, so here
a frame's length follows from its function code, and what makes no frame is forgotten after a pause.
Source: Modbus over serial line 1.02, 2.5.1 (frames, CRC-16).
"""

from __future__ import annotations

import asyncio
import os
import tty
from contextlib import suppress
from functools import partial
from pathlib import Path

from pymodbus.framer.rtu import FramerRTU

from bufferstand.drivers.simulated.imperfections import DelayedConnection
from bufferstand.drivers.simulated.wires.modbus_requests import EXCHANGE, WRITE_SEVERAL, Responder
from bufferstand.foundation import BadInput

SILENCE_S = 0.05
"""A pause after which what came before is no part of what comes [s of the wall]."""
SHORTEST = 4
"""Bytes of the shortest frame: unit, function, CRC."""
_BYTE_COUNT_AT = {WRITE_SEVERAL: 6, EXCHANGE: 10}
_FIXED = 8
_BROADCAST = 0


class RtuStandServer:
    """Serves a device's registers on a pseudo-terminal at a path of one's choice.

    Parameters
    ----------
    responder : Responder
    device_id : int
        Unit identifier that it answers to; a request to another unit is not answered, since on a line
        somebody else will.
    """

    def __init__(self, responder: Responder, device_id: int) -> None:
        self._responder = responder
        self._device_id = device_id
        self._received = b""
        self._coming, self._going = DelayedConnection(responder.way_s), DelayedConnection(responder.way_s)
        self._heard_s = 0.0
        self._link: Path | None = None
        self._ends: tuple[int, int] | None = None

    @property
    def is_open(self) -> bool:
        """Always: on a line nobody can be seen to leave."""
        return True

    def start(self, link: Path, place: str = "controller.serial") -> None:
        """Make the line and listen on it.

        Parameters
        ----------
        link : Path
            Where the serial device shall appear, as a symbolic link.
        place : str
            What of the stand file says so, for messages.

        Raises
        ------
        BadInput
            If something that is no link lies there, or the link cannot be made.
        """
        if link.exists() and not link.is_symlink():
            raise BadInput(
                f"a device or file lies where the simulated {place.partition('.')[0]} shall appear",
                file=link,
                place=place,
                remedy="choose another path: a real device is never replaced",
            )
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        self._ends = (master, slave)
        try:
            link.parent.mkdir(parents=True, exist_ok=True)
            link.unlink(missing_ok=True)
            link.symlink_to(os.ttyname(slave))
        except OSError as error:
            self.stop()
            raise BadInput(f"cannot be made: {error.strerror}", file=link, place=place) from None
        self._link = link
        asyncio.get_running_loop().add_reader(master, self._hear)

    def stop(self) -> None:
        """Take the line away."""
        ends, self._ends = self._ends, None
        if ends is None:
            return
        master, slave = ends
        asyncio.get_running_loop().remove_reader(master)
        with suppress(OSError):
            if self._link is not None and os.readlink(self._link) == os.ttyname(slave):  # noqa: PTH115
                self._link.unlink()
        os.close(master)
        os.close(slave)

    def _hear(self) -> None:
        """Take what has come, and answer it when it is a whole frame for this unit."""
        if self._ends is None:
            return
        with suppress(BlockingIOError):
            self._received = self._fresh() + os.read(self._ends[0], 4096)
        if self._responder.cut():
            self._received = b""
            return
        length = _frame_length(self._received)
        if length is None or len(self._received) < length:
            return
        # Whoever asks twice without waiting is not heard.
        frame, self._received = self._responder.hear(self._received[:length]), b""
        if frame is None:
            return
        if FramerRTU.compute_CRC(frame[:-2]) != int.from_bytes(frame[-2:], "big"):
            return
        if frame[0] not in (self._device_id, _BROADCAST):
            return
        self._coming.send(partial(self._answer, frame))

    def _answer(self, frame: bytes) -> None:
        """Do a request that has arrived, and send the reply."""
        reply = self._responder.answer(frame[1:-2])
        self._responder.asker = self
        if reply is not None and frame[0] != _BROADCAST:
            answer = frame[:1] + reply
            self._responder.deliver(answer + FramerRTU.compute_CRC(answer).to_bytes(2, "big"), self._send)

    def _send(self, data: bytes) -> None:
        self._going.send(partial(self._write, data))

    def _write(self, data: bytes) -> None:
        if self._ends is not None:
            with suppress(BlockingIOError):  # nobody reads: lost, as on a line
                os.write(self._ends[0], data)

    def _fresh(self) -> bytes:
        """Return what was received just now and is not answered yet."""
        now_s = asyncio.get_running_loop().time()
        before, self._heard_s = self._heard_s, now_s
        return self._received if now_s - before <= SILENCE_S else b""


def _frame_length(received: bytes) -> int | None:
    """Return how long the frame that has begun will be, None while that cannot be told."""
    if len(received) < SHORTEST:
        return None
    at = _BYTE_COUNT_AT.get(received[1])
    if at is not None:
        return None if len(received) <= at else at + 1 + received[at] + 2
    # Others that are served have eight bytes; of what is not, all that came at once is taken for the frame.
    return _FIXED if received[1] in (3, 4, 6) else len(received)
