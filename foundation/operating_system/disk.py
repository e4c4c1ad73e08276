"""Writing to the disk: places in a file, space ahead, and what survives a power cut."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import tempfile
from pathlib import Path

BINARY: int = getattr(os, "O_BINARY", 0)
"""For ``os.open``: bytes as they are. Windows would write another line end for each one."""


def read_at(handle: int, size: int, offset: int) -> bytes:
    """Return at most ``size`` bytes of a file from ``offset`` on; one thread at a time.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    if hasattr(os, "pread"):
        return os.pread(handle, size, offset)
    os.lseek(handle, offset, os.SEEK_SET)
    return os.read(handle, size)


def write_at(handle: int, data: bytes | memoryview, offset: int) -> int:
    """Write at ``offset`` of a file and return how many bytes it took; one thread at a time.

    Raises
    ------
    OSError
        If it takes none.
    """
    if hasattr(os, "pwrite"):
        return os.pwrite(handle, data, offset)
    os.lseek(handle, offset, os.SEEK_SET)
    return os.write(handle, data)


def reserve_space(handle: int, offset: int, size: int) -> None:
    """Make sure that ``size`` bytes can be written from ``offset`` on.

    Where the system cannot reserve space in a file (macOS, Windows) it is looked up whether there is as much.

    Raises
    ------
    OSError
        If there is not.
    """
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(handle, offset, size)
    elif shutil.disk_usage(handle if os.name == "posix" else _path_of(handle)).free < size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def sync_data(handle: int) -> None:
    """Bring what was written to a file to the disk.

    Raises
    ------
    OSError
        If it did not get there.
    """
    getattr(os, "fdatasync", os.fsync)(handle)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder survive a power cut; Windows does so by itself (NTFS keeps a journal).

    Raises
    ------
    OSError
        If the folder cannot be opened or synchronised.
    """
    if not hasattr(os, "O_DIRECTORY"):
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def make_read_only(handle: int, path: Path) -> None:
    """Take the right to write a file from everybody.

    Parameters
    ----------
    handle : int
        The open file.
    path : Path
        Its name.

    Raises
    ------
    OSError
        If that cannot be done.
    """
    if hasattr(os, "fchmod"):
        os.fchmod(handle, 0o444)
    else:
        path.chmod(stat.S_IREAD)


def nameless_file() -> int:
    """Return the descriptor of a new, empty file that goes when it is closed."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("nameless")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


def _path_of(handle: int) -> str:
    """Return the path of an open file (Windows)."""
    import ctypes  # noqa: PLC0415 - no other system needs it
    import msvcrt  # noqa: PLC0415

    text = ctypes.create_unicode_buffer(32768)
    found = ctypes.windll.kernel32.GetFinalPathNameByHandleW(  # type: ignore[attr-defined]
        ctypes.c_void_p(msvcrt.get_osfhandle(handle)),  # type: ignore[attr-defined]
        text,
        len(text),
        0,
    )
    if not 0 < found < len(text):
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))
    return str(Path(text.value).parent)
