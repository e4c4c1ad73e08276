"""Plays the device's side of a transcript; strict on every byte that the driver sends."""

from __future__ import annotations

import os
import select
import socket
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from bufferstand.drivers.transcripts.transcript import TranscriptPiece, read_transcript

FOLDER = Path(__file__).parent / "transcripts"
PATIENCE_S = 30.0


class Replay:
    """The device's side of one wire.

    Parameters
    ----------
    pieces : list of Piece
        Of that wire, in order.
    """

    def __init__(self, pieces: list[TranscriptPiece]) -> None:
        self._pieces = merged(pieces)
        self.problem = ""
        self.done = threading.Event()
        self._end = threading.Event()

    def play(self, descriptor: int) -> None:
        """Send what the device sent, hear what the driver must say, piece by piece."""
        pending = b""
        for piece in self._pieces:
            if piece.sign == "<":
                os.write(descriptor, piece.data)
                continue
            end_s = time.monotonic() + PATIENCE_S
            while len(pending) < len(piece.data) and not self.problem:
                if self._end.is_set() or time.monotonic() > end_s:
                    self.problem = (
                        f"at {piece.time_s:.3f} s {pending.hex(' ')} instead of {piece.data.hex(' ')}"
                    )
                elif select.select([descriptor], [], [], 0.02)[0]:
                    with suppress(OSError):  # the driver has closed the line
                        pending += os.read(descriptor, 4096)
                        continue
                    self.problem = f"closed before {piece.data.hex(' ')} at {piece.time_s:.3f} s"
            got, pending = pending[: len(piece.data)], pending[len(piece.data) :]
            if got != piece.data and not self.problem:
                self.problem = f"at {piece.time_s:.3f} s {got.hex(' ')} was sent, not {piece.data.hex(' ')}"
            if self.problem:
                return
        if pending:
            self.problem = f"{pending.hex(' ')} was sent beyond the transcript"
        self.done.set()

    def stop(self) -> None:
        self._end.set()


def merged(pieces: list[TranscriptPiece]) -> list[TranscriptPiece]:
    """Return the pieces with those of one direction in a row made one."""
    found: list[TranscriptPiece] = []
    for piece in pieces:
        if piece.sign not in "<>":
            continue
        if found and found[-1].sign == piece.sign:
            last = found[-1]
            found[-1] = TranscriptPiece(last.time_s, last.wire, last.sign, last.data + piece.data)
        else:
            found.append(piece)
    return found


def pieces_of(name: str, wire: str) -> list[TranscriptPiece]:
    return [piece for piece in read_transcript(FOLDER / f"{name}.txt") if piece.wire == wire]


@contextmanager
def replayed_tcp(name: str, wire: str = "controller") -> Iterator[tuple[int, Replay]]:
    """Give a port at which the device of a transcript answers, and how it goes."""
    replay = Replay(pieces_of(name, wire))
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(PATIENCE_S)

        def run() -> None:
            near, _ = listener.accept()
            with near:
                near.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                replay.play(near.fileno())
                with suppress(OSError):
                    near.recv(1)  # until the driver lets go

        thread = threading.Thread(target=run)
        thread.start()
        yield listener.getsockname()[1], replay
        replay.stop()
        thread.join()


@contextmanager
def replayed_line(name: str, wire: str, folder: Path) -> Iterator[tuple[Path, Replay]]:
    """Give a serial device behind which the device of a kept transcript answers, and how it goes."""
    with replayed_pieces(pieces_of(name, wire), wire, folder) as one:
        yield one


@contextmanager
def replayed_pieces(pieces: list[TranscriptPiece], wire: str, folder: Path) -> Iterator[tuple[Path, Replay]]:
    """Give a serial device behind which the device of a session answers, and how it goes."""
    replay = Replay(pieces)
    master, slave = os.openpty()
    tty.setraw(slave)
    path = folder / f"replayed-{wire}"
    path.symlink_to(os.ttyname(slave))
    thread = threading.Thread(target=replay.play, args=(master,))
    thread.start()
    try:
        yield path, replay
    finally:
        replay.stop()
        thread.join()
        os.close(master)
        os.close(slave)
