"""Run files as another process reads them, which is ended if it does not return.

Whatever is in a file, this process goes on, and an interrupt ends its waiting at once. The other process is
started for the first file and serves all others.
"""

from __future__ import annotations

import atexit
import json
import os
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput, with_same_imports
from bufferstand.foundation.operating_system import ReaderBounds, nameless_file, read_at

RESTORE = "restore the file from a copy"
MEMORY_BYTES = 1 << 30
"""So much memory reading may take beyond what the other process has when it begins."""
LEAST_S = 5.0
"""So much processor time a request has in any case: a thousand times of what a small file takes …"""
BYTES_PER_S = 5_000_000
"""… and a second more for so many bytes: a tenth of the pace of a slow machine."""
WALL_RATIO = 10
"""Waiting for a disk or for busy cores is no fault of the file; waiting for ever helps nobody."""
_HEAD = struct.Struct("<cQ")
_MODULE = "bufferstand.recording.runfile.reader_process"
_FROM_OUTSIDE = tuple(-getattr(signal, name) for name in ("SIGKILL", "SIGTERM") if hasattr(signal, name))
"""Somebody, or the system for want of memory, ended the process: that may be no fault of the file."""
_ALL = slice(None)
Answer = TypeVar("Answer")


class _Ended(Exception):  # noqa: N818 - it names the fact
    """The process is gone."""


class ReaderProcess:
    """The process that reads; threads take turns."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0
        self._told = -1
        self._bounds = ReaderBounds(MEMORY_BYTES)
        self._patience_s = 0.0

    def ask(self, path: Path, receive: Callable[[ReaderProcess], Answer], **request: Any) -> Answer:
        """Return what is made of the reply to a request about a file.

        Parameters
        ----------
        path : Path
        receive : callable
            Takes the reply in by :meth:`said`, :meth:`content` and :meth:`numbers`.
        **request
            What :mod:`bufferstand.recording.runfile.reader_process` understands.

        Raises
        ------
        BadInput
            If it is refused, or HDF5 crashes on the file or does not come to an end with it.
        """
        with self._lock:
            again = True
            while True:
                try:
                    self._send(path, request)
                    return receive(self)
                except BadInput:
                    raise
                except _Ended as ended:
                    status, last = self._dismissed()
                    if again and status in _FROM_OUTSIDE:
                        again = False
                        continue
                    raise _damaged(str(ended) or _why(status, last), path) from None
                except BaseException:  # an interrupt: what still comes would be taken for the next reply
                    self.close()
                    raise

    def said(self, path: Path) -> dict[str, Any]:
        """Return the next word of the reply.

        Raises
        ------
        BadInput
            If it is a refusal.
        """
        _, size = self._head()
        return self._word(path, size)

    def content(self) -> bytes:
        """Return the bytes that come next in the reply."""
        _, size = self._head()
        content = bytearray(size)
        self._fill(memoryview(content))
        return bytes(content)

    def numbers(self, path: Path, values: NDArray[Any]) -> None:
        """Take numbers in until an array is full.

        Raises
        ------
        BadInput
            If they cannot be read to the end.
        """
        left = values.reshape(-1).view(np.uint8).data
        while left:
            kind, size = self._head()
            if kind == b"D":
                self._fill(left[:size])
                left = left[size:]
            else:
                self._word(path, size)

    def close(self) -> None:
        """End the process; the next request starts another one."""
        self._dismissed()

    def _send(self, path: Path, request: Mapping[str, Any]) -> None:
        seconds = LEAST_S + _size_of(path) / BYTES_PER_S
        self._patience_s = WALL_RATIO * seconds
        # As this process sees it: it may be /proc/self/cwd/…, or below a link that is turned meanwhile.
        line = json.dumps({**request, "path": os.path.realpath(path), "seconds": seconds})
        stdin = self._running().stdin
        assert stdin is not None
        try:
            stdin.write(line.encode() + b"\n")
            stdin.flush()
        except BrokenPipeError:
            raise _Ended from None

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is not None and (self._owner != os.getpid() or self._process.poll() is not None):
            self._dismissed()
        if self._process is None:
            self._start()
        assert self._process is not None
        return self._process

    def _start(self) -> None:
        environment = {
            **with_same_imports(),
            "HDF5_PLUGIN_PRELOAD": "::",  # no code from elsewhere for what a file says it is packed with
        }
        self._told = nameless_file()
        self._process = self._bounds.start(
            [sys.executable, "-P", "-m", _MODULE, str(MEMORY_BYTES)], environment, self._told
        )
        self._owner = os.getpid()

    def _dismissed(self) -> tuple[int, str]:
        """End the process if it still runs; return its status, and the last line that it said."""
        process, self._process = self._process, None
        if process is None:
            return 0, ""
        for stream in (process.stdin, process.stdout):
            with suppress(OSError):  # what could not be sent any more
                if stream is not None:
                    stream.close()
        status = 0
        if self._owner == os.getpid():  # else it is another one's
            process.kill()
            status = process.wait()
        size = os.fstat(self._told).st_size
        last = read_at(self._told, 4096, max(0, size - 4096)).decode(errors="replace").strip()
        os.close(self._told)
        self._bounds.close()
        return status, last.rpartition("\n")[2]

    def _head(self) -> tuple[bytes, int]:
        head = bytearray(_HEAD.size)
        self._fill(memoryview(head))
        kind, size = _HEAD.unpack(head)
        return kind, size

    def _word(self, path: Path, size: int) -> dict[str, Any]:
        content = bytearray(size)
        self._fill(memoryview(content))
        said: dict[str, Any] = json.loads(content)
        if "refused" in said:
            raise BadInput(file=path, **said["refused"])
        return said

    def _fill(self, view: memoryview) -> None:
        assert self._process is not None
        try:
            self._bounds.fill(self._process, view, self._patience_s)
        except TimeoutError:
            raise _Ended("it cannot be read in reasonable time") from None
        except EOFError:
            raise _Ended from None


READER = ReaderProcess()
"""That of this process."""
atexit.register(READER.close)


@dataclass(frozen=True)
class LookedInto:
    """A run file that was read to the end.

    Parameters
    ----------
    text : bytes
        The metadata document as it is stored.
    faults : list of (str, str)
        Place and what is wrong; none of its numbers can be had then.
    reader : DatasetReader
        Its numbers.
    """

    text: bytes
    faults: list[tuple[str, str]]
    reader: DatasetReader


def stored_document(path: Path) -> bytes:
    """Return the metadata document of a run file as it is stored; quick, as the data are not looked at.

    Raises
    ------
    BadInput
        If it is no readable HDF5, or has none.
    """

    def received(reply: ReaderProcess) -> bytes:
        reply.said(path)
        return reply.content()

    return READER.ask(path, received, do="document")


def looked_into(path: Path, *, numbers: bool = True) -> LookedInto:
    """Read a run file to the end: its structure, its document, and every dataset with its hash.

    Parameters
    ----------
    path : Path
    numbers : bool
        Whether its numbers will be wanted.

    Raises
    ------
    BadInput
        If it cannot be read, is no run file, of a newer format, or holds what no run file does.
    """

    def received(reply: ReaderProcess) -> LookedInto:
        head = reply.said(path)
        text = reply.content()
        columns = {place: (dtype, tuple(shape)) for place, dtype, shape in head["columns"]}
        kept: dict[str, NDArray[Any]] = {}
        if head["inline"]:
            kept = {place: np.empty(shape, dtype) for place, (dtype, shape) in columns.items()}
            for values in kept.values():
                reply.numbers(path, values)
        faults = [(place, what) for place, what in head["faults"]]
        return LookedInto(text, faults, DatasetReader(path, head["stamp"], columns, kept))

    return READER.ask(path, received, do="open", numbers=numbers)


class DatasetReader:
    """The numbers of one run file that was looked into; of a small one they are here already.

    Parameters
    ----------
    path : Path
    stamp : list of int
        What tells that it is the same file.
    columns : mapping of str to (str, tuple of int)
        Type and shape of each dataset by its place.
    kept : mapping of str to array
        Those datasets that are here.
    """

    def __init__(
        self,
        path: Path,
        stamp: list[int],
        columns: Mapping[str, tuple[str, tuple[int, ...]]],
        kept: Mapping[str, NDArray[Any]],
    ) -> None:
        self.path = path
        self._stamp, self._columns, self._kept = stamp, columns, kept

    def form(self, place: str) -> tuple[str, tuple[int, ...]] | None:
        """Return type and shape of a dataset; None if there is none."""
        return self._columns.get(place)

    def column(self, place: str, rows: slice = _ALL) -> NDArray[Any]:
        """Return a dataset, or some rows of it that follow each other.

        Raises
        ------
        BadInput
            If there is none, or the file is another one by now.
        """
        if place not in self._columns:
            raise BadInput("the dataset is missing", file=self.path, place=place, remedy=RESTORE)
        if place in self._kept:
            return self._kept[place][rows]
        dtype, shape = self._columns[place]
        first, end, _ = rows.indices(shape[0])
        values: NDArray[Any] = np.empty((max(0, end - first), *shape[1:]), dtype)

        def received(reply: ReaderProcess) -> None:
            reply.said(self.path)
            reply.numbers(self.path, values)

        READER.ask(self.path, received, do="column", place=place, rows=[first, end], stamp=self._stamp)
        return values


def _size_of(path: Path) -> int:
    """Return the bytes of a file that this process may read, whatever the other one may."""
    if not path.is_file():
        raise BadInput("no such file", file=path, remedy="check the path")
    try:
        with path.open("rb") as stream:
            return stream.seek(0, os.SEEK_END)
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path, remedy="check the path") from None


def _why(status: int, last: str) -> str:
    if sys.platform != "win32" and status == -signal.SIGPROF:
        return "HDF5 does not come to an end with it"
    if status < 0:
        return f"HDF5 crashes on it ({signal.Signals(-status).name})"
    return f"it cannot be looked into ({last or f'status {status}'})"


def _damaged(what: str, path: Path) -> BadInput:
    return BadInput(f"damaged: {what}", file=path, remedy=RESTORE)
