"""Files that are either whole and on the disk under their name, or not there at all."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

Pwrite = Callable[[int, bytes | memoryview, int], int]


def sync_directory(directory: Path) -> None:
    """Make the names in a directory survive a power cut.

    Raises
    ------
    OSError
        If the directory cannot be opened or synchronised.
    """
    handle = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_all(handle: int, data: bytes | memoryview, offset: int, pwrite: Pwrite = os.pwrite) -> None:
    """Write every byte of ``data`` at ``offset``: a write may be short without being an error.

    Raises
    ------
    OSError
        If the file takes no more (disk full, size limit).
    """
    rest = memoryview(data)
    while rest:
        taken = pwrite(handle, rest, offset)
        if taken <= 0:
            raise OSError(f"a write of {len(rest)} bytes took none")
        rest = rest[taken:]
        offset += taken


def give_final_name(temporary: Path, final: Path) -> None:
    """Rename a synchronised file and make the new name survive a power cut.

    Raises
    ------
    OSError
        If the name cannot be given.
    """
    temporary.replace(final)
    sync_directory(final.parent)
