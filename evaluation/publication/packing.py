"""A crate as a folder or as one ZIP file: whole under its name, or not there; the same bytes each time."""

from __future__ import annotations

import os
import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import check_outputs, replaced_whole

_ZIP = ".zip"
_EARLIEST = (1980, 1, 1, 0, 0, 0)
"""No ZIP file can state an earlier time: the time of its making would make other bytes each time."""
_FILE_MODE = 0o100644 << 16
_FOLDER_MODE = 0o755


def check_crate_output(out: Path, campaign: Path) -> None:
    """Refuse a name under which no crate can be written, before anything is computed.

    Parameters
    ----------
    out : Path
        A name with ``.zip``, or a folder that is not there or is empty.
    campaign : Path
        The campaign's folder. A folder in it would be taken for a part of it.

    Raises
    ------
    BadInput
        If it cannot be written, would replace something else, or lies in the campaign's folder.
    """
    if out.suffix.lower() == _ZIP:
        check_outputs([out])
        return
    remedy = "name a new folder, or a .zip file"
    if out.resolve().is_relative_to(campaign.resolve()):
        problem = "lies in the campaign’s own folder: its runs would be there twice"
    elif out.exists() and not out.is_dir():
        problem = "is a file, and no .zip"
    elif out.is_dir() and any(out.iterdir()):
        problem = "is a folder that is not empty"
    elif not out.resolve().parent.is_dir():
        problem = "cannot be written: no such folder"
    elif not os.access(out.resolve().parent, os.W_OK):
        problem = "cannot be written: Permission denied"
    else:
        return
    raise BadInput(problem, file=out, remedy=remedy)


@contextmanager
def staged(out: Path, name: str) -> Iterator[Path]:
    """Give a folder to put a crate together in; it takes its place under ``out`` when all of it is there.

    Parameters
    ----------
    out : Path
        As :func:`check_crate_output` accepts it.
    name : str
        What the folder is called meanwhile.

    Raises
    ------
    BadInput
        If it cannot be written; nothing is left then.
    """
    final = out.resolve()
    try:
        with tempfile.TemporaryDirectory(prefix=".publishing-", dir=final.parent) as holder:
            folder = Path(holder) / name
            folder.mkdir()
            yield folder
            if out.suffix.lower() == _ZIP:
                with replaced_whole(out) as place:
                    _zip(folder, place)
            else:
                _release(folder)
                if final.exists():
                    final.rmdir()
                folder.rename(final)
    except OSError as error:
        problem = f"cannot be written: {error.strerror or error}"
        raise BadInput(problem, file=out, remedy="make room, or name another place") from None


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def _zip(folder: Path, place: Path) -> None:
    """Write a ZIP file without compression: bytes of zlib differ with its version, and runs are packed."""
    with zipfile.ZipFile(place, "w") as archive:
        for path in _files(folder):
            entry = zipfile.ZipInfo(path.relative_to(folder).as_posix(), _EARLIEST)
            entry.external_attr = _FILE_MODE
            entry.create_system = 3  # Unix, whose modes these are
            entry.file_size = path.stat().st_size
            with path.open("rb") as source, archive.open(entry, "w") as target:
                shutil.copyfileobj(source, target, 1 << 20)


def _release(folder: Path) -> None:
    """Let a folder be read as any other: temporary ones are their owner's only."""
    for path in (folder, *folder.rglob("*")):
        path.chmod(_FOLDER_MODE if path.is_dir() else 0o644)
