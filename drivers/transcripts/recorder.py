"""Records a live session: drivers talk to a tap on this computer, and the tap to the device.

The tap stands between, on loopback sockets and pseudo-terminals, so that every driver can be recorded as it
is. It costs a fraction of a millisecond a round trip; a break on a serial line does not pass it.
"""

from __future__ import annotations

import os
import select
import socket
import tempfile
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Protocol

import serial

from bufferstand.drivers.instruments import FolderAddress, Place, TcpAddress
from bufferstand.drivers.stand_file import Endpoints, StandFile, with_endpoints
from bufferstand.drivers.transcripts.transcript import HEAD, Sign, TranscriptPiece
from bufferstand.foundation import BadInput

_PARITIES = {"none": "N", "even": "E", "odd": "O"}
_POLL_S = 0.05
_CONNECT_S = 5.0


class TranscriptRecorder:
    """Writes the pieces of all wires into one file, as they come; safe from several threads.

    Parameters
    ----------
    path : Path

    Raises
    ------
    BadInput
        If the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        self._start_s = time.monotonic()
        try:
            self._file = path.open("w", encoding="utf-8", newline="\n")
            self._file.write(f"{HEAD}\n")
        except OSError as error:
            raise BadInput(f"cannot be written: {error.strerror}", file=path) from None

    def comment(self, text: str) -> None:
        """Write a line for people."""
        with self._lock:
            self._file.write(f"# {text}\n")

    def put(self, wire: str, sign: Sign, data: bytes = b"") -> None:
        """Write a piece."""
        with self._lock:
            self._file.write(f"{TranscriptPiece(time.monotonic() - self._start_s, wire, sign, data)}\n")

    def close(self) -> None:
        """End the file."""
        with self._lock:
            self._file.close()


class _Tap(Protocol):
    def close(self) -> None:
        """Take it away."""
        ...


class TcpTap:
    """Passes the bytes of TCP connections on, one connection after the other, and records them.

    Parameters
    ----------
    wire : str
        Name in the transcript.
    host, port
        Of the device.
    recorder : Recorder
    """

    def __init__(self, wire: str, host: str, port: int, recorder: TranscriptRecorder) -> None:
        self._wire = wire
        self._target = (host, port)
        self._recorder = recorder
        self._end = threading.Event()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(_POLL_S)
        self.port: int = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._run, name=f"tap {wire}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Take it away."""
        self._end.set()
        self._thread.join()
        self._listener.close()

    def _run(self) -> None:
        while not self._end.is_set():
            try:
                near, _ = self._listener.accept()
            except TimeoutError:
                continue
            with near:
                try:
                    far = socket.create_connection(self._target, timeout=_CONNECT_S)
                except OSError as error:
                    self._recorder.comment(f"{self._wire}: cannot connect: {error}")
                    continue  # whoever connected finds the connection closed
                with far:
                    self._recorder.put(self._wire, "+")
                    self._carry(near, far)
                    self._recorder.put(self._wire, "-")

    def _carry(self, near: socket.socket, far: socket.socket) -> None:
        for one in (near, far):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with suppress(OSError):
            while not self._end.is_set():
                for one in select.select([near, far], [], [], _POLL_S)[0]:
                    data = one.recv(65536)
                    if not data:
                        return
                    self._recorder.put(self._wire, ">" if one is near else "<", data)
                    (far if one is near else near).sendall(data)


class SerialTap:
    """Passes the bytes of a serial line on, through a pseudo-terminal, and records them.

    Parameters
    ----------
    wire : str
        Name in the transcript.
    port : Path
        The device's serial port.
    link : Path
        Where the drivers shall find it.
    recorder : Recorder
    baud, parity, stop_bits
        Of the line.

    Raises
    ------
    BadInput
        If the port cannot be opened.
    """

    def __init__(
        self,
        wire: str,
        port: Path,
        link: Path,
        recorder: TranscriptRecorder,
        *,
        baud: int,
        parity: str = "none",
        stop_bits: int = 1,
    ) -> None:
        self._wire = wire
        self._recorder = recorder
        simulated = str(port.resolve()).startswith("/dev/pts/")  # a pseudo-terminal has no parity
        try:
            self._far = serial.Serial(
                str(port),
                baud,
                parity="N" if simulated else _PARITIES[parity],
                stopbits=stop_bits,
                timeout=0,
                exclusive=True,
            )
        except (OSError, ValueError) as error:
            raise BadInput(
                f"not recorded, its port cannot be opened: {error}",
                file=port,
            ) from None
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        link.symlink_to(os.ttyname(self._slave))
        self._end = threading.Event()
        recorder.put(wire, "+")
        self._thread = threading.Thread(target=self._run, name=f"tap {wire}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Take it away."""
        self._end.set()
        self._thread.join()
        self._recorder.put(self._wire, "-")
        self._far.close()
        os.close(self._master)
        os.close(self._slave)

    def _run(self) -> None:
        with suppress(OSError):
            while not self._end.is_set():
                for one in select.select([self._master, self._far.fileno()], [], [], _POLL_S)[0]:
                    data = os.read(one, 4096)
                    to_device = one == self._master
                    self._recorder.put(self._wire, ">" if to_device else "<", data)
                    os.write(self._far.fileno() if to_device else self._master, data)


@contextmanager
def record_wires(stand_file: StandFile, path: Path) -> Iterator[StandFile]:
    """Give the same stand on taps that record every byte of its TCP and serial wires.

    Parameters
    ----------
    stand_file : StandFile
    path : Path
        The transcript.

    Raises
    ------
    BadInput
        If the transcript cannot be written.
    """
    recorder = TranscriptRecorder(path)
    taps: list[_Tap] = []
    try:
        recorder.comment(f"stand {stand_file.stand.id}")
        with tempfile.TemporaryDirectory(prefix="bufferstand-tap-") as folder:
            try:
                yield with_endpoints(stand_file, _tapped(stand_file, Path(folder), recorder, taps))
            finally:
                for tap in taps:
                    tap.close()
    finally:
        recorder.close()


def _tapped(stand_file: StandFile, folder: Path, recorder: TranscriptRecorder, taps: list[_Tap]) -> Endpoints:
    """Put a tap on every wire of bytes; return where they are."""

    def tap(wire: str, port: Path, *, baud: int, parity: str = "none", stop_bits: int = 1) -> Path | None:
        link = folder / wire
        try:
            one = SerialTap(wire, port, link, recorder, baud=baud, parity=parity, stop_bits=stop_bits)
        except BadInput as error:
            recorder.comment(f"{wire}: {error.problem}")
            return None  # the drivers try the port itself, and say what is wrong with it
        taps.append(one)
        return link

    def tap_tcp(wire: str, to: TcpAddress) -> TcpAddress:
        one = TcpTap(wire, to.host, to.port, recorder)
        taps.append(one)
        return TcpAddress("127.0.0.1", one.port)

    controller, line = stand_file.controller, stand_file.controller_serial()
    profile = f"profile {controller.profile}, unit {controller.device_id}"
    host, port, controller_line = None, None, None
    if line is None:
        recorder.comment(f"controller: TCP, {profile}")
        near = tap_tcp("controller", TcpAddress(controller.host, controller.port))
        host, port = near.host, near.port
    else:
        recorder.comment(f"controller: RTU, {controller.baud} baud, {profile}")
        controller_line = tap(
            "controller",
            line,
            baud=controller.baud,
            parity=controller.parity,
            stop_bits=controller.stop_bits,
        )
    places: dict[str, Place] = {}
    for one in (*stand_file.instruments, *stand_file.thermometers):
        to = one.wire()
        if isinstance(to, FolderAddress):
            continue  # the kernel's: no bytes to record
        if isinstance(to, TcpAddress):
            recorder.comment(f"{one.stream}: {one.kind.name}, TCP")
            places[one.stream] = tap_tcp(one.stream, to)
            continue
        recorder.comment(f"{one.stream}: {one.kind.name}, {to.baud} baud")
        link = tap(one.stream, to.path, baud=to.baud, parity=to.parity, stop_bits=to.stop_bits)
        if link is not None:
            places[one.stream] = link
    return Endpoints(
        host=host,
        port=port,
        instruments=places,
        controller_serial=controller_line,
    )
