"""Files that a user names for results: never in place of a recording, and never half a one."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from bufferstand.foundation.errors import BadInput

_RECORDING_SUFFIXES = (".h5", ".hdf5", ".journal", ".tmp")
_HDF5 = b"\x89HDF\r\n\x1a\n"
_LOOKED_AT = 4096
"""HDF5's signature may stand behind a user block of 512, 1024, 2048 … bytes."""


def check_outputs(paths: Iterable[Path]) -> None:
    """Refuse names under which results cannot be written, or must not be; before anything is computed.

    Raises
    ------
    BadInput
        If one is a folder, lies in none that can be written to, holds a recording, or is named twice.
    """
    seen: set[Path] = set()
    for path in paths:
        if path.resolve() in seen:
            raise BadInput("two results would be written into one file", file=path, remedy="name two files")
        seen.add(path.resolve())
        check_output(path)


def check_output(path: Path) -> None:
    """Refuse a name under which results cannot be written, or must not be.

    Raises
    ------
    BadInput
        If it is a folder, lies in none that can be written to, or holds a recording.
    """
    problem = ""
    if path.is_dir():
        problem = "is a folder"
    elif not path.parent.is_dir():
        problem = "cannot be written: no such folder"
    elif not os.access(path if path.exists() else path.parent, os.W_OK):
        problem = "cannot be written: Permission denied"
    if problem:
        raise BadInput(problem, file=path, remedy="name a file in an existing folder")
    if path.suffix.lower() in _RECORDING_SUFFIXES or _holds_recording(path):
        raise BadInput(
            "is or would be a recording: results are not written in its place",
            file=path,
            remedy="name another file for them",
        )


def _holds_recording(path: Path) -> bool:
    if not path.is_file():
        return False
    try:
        with path.open("rb") as stream:
            head = stream.read(_LOOKED_AT + len(_HDF5))
    except OSError:
        return False
    return any(head[at : at + len(_HDF5)] == _HDF5 for at in (0, 512, 1024, 2048, 4096))


@contextmanager
def replaced_whole(path: Path) -> Iterator[Path]:
    """Give a name to write results under; they take the place of ``path`` when all of them are written.

    What is no regular file (a pipe, a terminal) is written directly.

    Raises
    ------
    BadInput
        As :func:`check_output`, and if the file cannot be written; what was there before is left as it is.
    """
    check_output(path)
    if path.exists() and not path.is_file():
        with _refusing(path):
            yield path
        return
    final = path.resolve()
    with _refusing(path):
        handle, name = tempfile.mkstemp(suffix=final.suffix, prefix=".writing-", dir=final.parent)
        os.close(handle)
        temporary = Path(name)
        try:
            yield temporary
            if final.exists():
                shutil.copymode(final, temporary)
            else:
                temporary.chmod(0o666 & ~_umask())
            temporary.replace(final)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def _refusing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise BadInput(
            f"cannot be written: {error.strerror or error}",
            file=path,
            remedy="make room, or name a file in another folder",
        ) from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
