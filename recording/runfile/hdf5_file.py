"""The file into which HDF5 writes a sealed run: space is reserved first, so that writes do not fail.

Where a write fails, HDF5 takes the whole process down when the file is closed (h5py issue 914). So room is
reserved on the disk before anything is handed to HDF5, and what fails nevertheless is kept from it and told
afterwards.
"""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from bufferstand.foundation.operating_system import (
    BINARY,
    make_read_only,
    read_at,
    reserve_space,
    write_at,
)
from bufferstand.recording.whole_files import Pwrite, write_all


class TreeFile(io.RawIOBase):
    """A new file, read-write, as h5py's ``fileobj`` driver wants it; gone again unless it was kept.

    Parameters
    ----------
    path : Path
        Its (temporary) name; a file of that name is replaced.
    pwrite, fallocate : callable, optional
        The system calls, to be replaced where a failing disk is tried.

    Raises
    ------
    OSError
        If it cannot be made.
    """

    def __init__(
        self,
        path: Path,
        *,
        pwrite: Pwrite = write_at,
        fallocate: Callable[[int, int, int], None] = reserve_space,
    ) -> None:
        super().__init__()
        self.path = path
        self._pwrite, self._fallocate = pwrite, fallocate
        self._position = self._end = self._reserved = 0
        self._failure: OSError | None = None
        self._kept = False
        path.unlink(missing_ok=True)
        self._handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | BINARY, 0o644)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._handle)
        if not self._kept:
            self.path.unlink(missing_ok=True)

    def reserve(self, coming: int) -> None:
        """Make sure that so many bytes can be written behind what was written so far.

        Raises
        ------
        OSError
            If the disk has no room for them, or a write failed before.
        """
        self.raise_failure()
        wanted = self._end + coming
        if wanted > self._reserved:
            self._fallocate(self._handle, self._reserved, wanted - self._reserved)
            self._reserved = wanted

    def raise_failure(self) -> None:
        """Tell what was kept from HDF5.

        Raises
        ------
        OSError
            The first failure of a write, a read or a truncation.
        """
        if self._failure is not None:
            raise self._failure

    def keep(self, head: bytes) -> None:
        """Put ``head`` at the beginning, make the file read-only and bring it to the disk.

        Raises
        ------
        OSError
            If it does not get there, or something failed before.
        """
        self.raise_failure()
        write_all(self._handle, head, 0, self._pwrite)
        make_read_only(self._handle, self.path)
        os.fsync(self._handle)
        self._kept = True

    # --- what h5py asks of a file ------------------------------------------------------------------

    def readable(self) -> bool:
        """Return that it can be read."""
        return True

    def writable(self) -> bool:
        """Return that it can be written."""
        return True

    def seekable(self) -> bool:
        """Return that it has a position."""
        return True

    def tell(self) -> int:
        """Return the position."""
        return self._position

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move the position; the end is that of what was written, not of what is reserved."""
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._end}[whence]
        self._position = start + offset
        return self._position

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer from the position on; where reading fails, with zeros."""
        view = memoryview(buffer).cast("B")
        try:
            found = read_at(self._handle, len(view), self._position)
        except OSError as error:
            self._fail(error)
            found = b""
        view[: len(found)] = found
        view[len(found) :] = bytes(len(view) - len(found))
        self._position += len(view)
        return len(view)

    def write(self, content: Any) -> int:
        """Write at the position; after a failure nothing more is written, and HDF5 is not told."""
        view = memoryview(content).cast("B")
        if self._failure is None:
            try:
                write_all(self._handle, view, self._position, self._pwrite)
            except OSError as error:
                self._fail(error)
        self._position += len(view)
        self._end = max(self._end, self._position)
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the size, which gives back what was reserved beyond it."""
        size = self._position if size is None else size
        try:
            os.ftruncate(self._handle, size)
        except OSError as error:
            self._fail(error)
        self._end = self._reserved = size
        return size

    def _fail(self, error: OSError) -> None:
        if self._failure is None:
            self._failure = OSError(error.errno or errno.EIO, error.strerror or str(error), str(self.path))
