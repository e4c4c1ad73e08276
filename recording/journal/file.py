"""The journal on disk: appears whole, takes short writes, reserves space ahead, is locked while it grows."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.foundation.operating_system import (
    BINARY,
    is_lock_taken,
    reserve_space,
    sync_data,
    sync_folder,
    write_at,
)
from bufferstand.recording.whole_files import Pwrite, give_final_name, write_all

JOURNAL_SUFFIX = ".journal"
_STARTING = ".tmp"
STARTING_PATTERN = f"*{JOURNAL_SUFFIX}*{_STARTING}"
"""Names of journals that never got so far as to record."""
RESERVE_BYTES = 4 << 20
"""Space that is reserved ahead of the last record."""


class JournalFile:
    """An append-only file under construction; used by one thread at a time, but for :meth:`sync`.

    Parameters
    ----------
    path : Path
        Final name. It appears only after ``header`` is on the disk.
    header : bytes
        First bytes of the file.
    pwrite, fdatasync, fallocate : callable, optional
        The system calls, to be replaced where a failing disk is tried.

    Raises
    ------
    BadInput
        If a file of that name is there, or the folder does not take one.
    """

    def __init__(
        self,
        path: Path,
        header: bytes,
        *,
        pwrite: Pwrite = write_at,
        fdatasync: Callable[[int], None] = sync_data,
        fallocate: Callable[[int, int, int], None] = reserve_space,
    ) -> None:
        self.path = path
        self.size = 0
        """Bytes of whole records."""
        self.disk_warning: str | None = None
        """Why no space could be reserved ahead (disk nearly full), once that happened."""
        self._reserved = 0
        self._pwrite, self._fdatasync, self._fallocate = pwrite, fdatasync, fallocate
        starting = path.with_name(path.name + _STARTING)
        try:
            self._handle = os.open(starting, os.O_RDWR | os.O_CREAT | BINARY, 0o644)
        except OSError as error:
            raise BadInput(f"cannot record here: {error.strerror}", file=path.parent) from None
        try:
            self._begin(starting, header)
        except BaseException:
            os.close(self._handle)
            raise

    def _begin(self, starting: Path, header: bytes) -> None:
        lock_or_refuse(self._handle, starting)
        if self.path.exists():
            starting.unlink()
            raise BadInput(
                "a journal of this run is there already", file=self.path, remedy="use another run id"
            )
        try:
            os.ftruncate(self._handle, 0)  # what an earlier attempt left never got so far as to record
            self.append(header)
            os.fsync(self._handle)
            give_final_name(starting, self.path)
        except OSError as error:
            starting.unlink(missing_ok=True)
            raise BadInput(f"cannot record here: {error.strerror}", file=self.path.parent) from None

    def append(self, frames: bytes) -> None:
        """Write whole frames behind those that are there.

        Raises
        ------
        OSError
            If they cannot be written; the part that was is cut off again.
        """
        self._reserve(len(frames))
        try:
            write_all(self._handle, frames, self.size, self._pwrite)
        except OSError:
            os.ftruncate(self._handle, self.size)
            self._reserved = self.size
            raise
        self.size += len(frames)

    def _reserve(self, coming: int) -> None:
        """Keep space reserved ahead: where that fails, there still is room to finish safely."""
        wanted = self.size + coming + RESERVE_BYTES
        if wanted <= self._reserved:
            return
        try:
            self._fallocate(self._handle, self._reserved, wanted + RESERVE_BYTES - self._reserved)
            self._reserved = wanted + RESERVE_BYTES
        except OSError as error:
            if self.disk_warning is None:
                what = f"no {RESERVE_BYTES >> 20} MiB could be reserved ahead of {self.path.name}"
                self.disk_warning = f"{what}: {error.strerror}"

    def sync(self) -> None:
        """Bring to the disk what was appended before the call; any thread may call it.

        Raises
        ------
        OSError
            If it did not get there. That is final for this file: the kernel may have dropped the data.
        """
        self._fdatasync(self._handle)

    def finish(self) -> None:
        """Cut off the reserved space and bring everything to the disk.

        Raises
        ------
        OSError
            If it did not get there.
        """
        os.ftruncate(self._handle, self.size)
        os.fsync(self._handle)

    def close(self) -> None:
        """Let go of the file and its lock."""
        os.close(self._handle)


def lock_or_refuse(handle: int, path: Path) -> None:
    """Take the lock that says who works on a journal; a process that dies lets go of it.

    Raises
    ------
    BadInput
        If another process records or seals it.
    """
    if not is_lock_taken(handle):
        raise BadInput(
            "in use: it is being recorded or sealed", file=path, remedy="wait until that has ended"
        )


def remove_journal(path: Path) -> None:
    """Drop a sealed journal, so that it stays dropped.

    Raises
    ------
    OSError
        If it cannot be removed.
    """
    path.unlink(missing_ok=True)
    sync_folder(path.parent)
