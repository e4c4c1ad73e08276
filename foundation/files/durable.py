"""Files and folders that survive a loss of power: what a function here has returned from is on the disk.

A new name is on the disk only when its folder has been brought there, too; so every one of these ends with
that. It is done anew each time: a program that was killed in between has not done it.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from bufferstand.foundation.operating_system import BINARY, sync_folder


def make_folder(path: Path) -> None:
    """Make a folder and those above it that are not there, and bring their names to the disk.

    Raises
    ------
    OSError
        If it cannot be made, or its name does not come to the disk.
    """
    new = [path, *path.parents]
    new = new[: next((at for at, one in enumerate(new) if one.is_dir()), len(new))]
    path.mkdir(parents=True, exist_ok=True)
    for one in reversed(new):
        sync_folder(one.parent)
    if not new:
        with suppress(PermissionError):  # of a folder that others made, and that may not be read
            sync_folder(path.parent)


def write_whole(path: Path, content: bytes) -> None:
    """Write beside, bring to the disk, rename: a reader sees the old or the new, never half.

    Raises
    ------
    OSError
        If the disk does not take it; the old one stays.
    """
    beside = path.with_name(f".{path.name}.new")
    with beside.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    beside.replace(path)
    sync_folder(path.parent)


def append_line(path: Path, line: str) -> None:
    """Add a line to a file, which is made if it is not there, and bring it to the disk.

    What a loss of power has left of a line before is ended first, so that no two become one.

    Parameters
    ----------
    path : Path
        The file; its folder is there.
    line : str
        Without its end.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | BINARY, 0o644)
    try:
        data = f"{line}\n".encode()
        size = os.fstat(handle).st_size
        if size:
            os.lseek(handle, size - 1, os.SEEK_SET)
            if os.read(handle, 1) != b"\n":
                data = b"\n" + data
        while data:  # mostly one write, so that two who write at once do not mix their lines
            data = data[os.write(handle, data) :]
        os.fsync(handle)
    finally:
        os.close(handle)
    sync_folder(path.parent)
