"""Files that are either whole and on the disk under their name, or not there at all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from bufferstand.foundation.operating_system import sync_folder, write_at

Pwrite = Callable[[int, bytes | memoryview, int], int]


def write_all(handle: int, data: bytes | memoryview, offset: int, pwrite: Pwrite = write_at) -> None:
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
    sync_folder(final.parent)
