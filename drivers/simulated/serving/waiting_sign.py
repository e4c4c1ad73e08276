"""How a program recognises that a served stand waits for its reader.

A served stand that waits holds a file in the folder of its wires locked, with its own address in it, for as
long as it lives. So no program can take a real controller for one that waits: a lock ends with its process,
an address of this machine has one server at a time, and nothing is asked of any controller.
"""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress
from pathlib import Path

from bufferstand.drivers.stand_file import StandFile

NAME = "waits"
"""Name of the file in the folder of the wires."""
WIRES = "wires"
"""That folder beside a stand file, where none is given."""
_LOOPBACK = {"localhost": "127.0.0.1", "127.0.0.1": "127.0.0.1", "::1": "::1"}


class WaitingSign:
    """The stand's side: the locked file.

    Where another stand has it already, or the folder cannot be written, there is no sign: readers then judge
    this stand as a real one.

    Parameters
    ----------
    path : Path
    address : str
        Where the stand's controller is: ``host:port``, or the absolute path of its line.
    """

    def __init__(self, path: Path, address: str) -> None:
        self._path = path
        self._file: int | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError:
            return
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.ftruncate(file, 0)
            os.write(file, address.encode())
        except OSError:
            os.close(file)
            return
        self._file = file

    def close(self) -> None:
        """Take the file away."""
        if self._file is not None:
            with suppress(OSError):
                self._path.unlink(missing_ok=True)
            os.close(self._file)
            self._file = None


def is_waiting(path: Path, stand_file: StandFile) -> bool:
    """Return whether a served stand that waits is alive where a stand file leads to.

    Parameters
    ----------
    path : Path
        The file that it would hold.
    stand_file : StandFile
        With the address that a program is about to use.
    """
    line = stand_file.controller_serial()
    if line is None:
        host = _LOOPBACK.get(stand_file.controller.host, "")
        address = f"{host}:{stand_file.controller.port}" if host else ""
    else:
        address = str(line.absolute())
    try:
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return bool(address) and os.read(file, 4096).decode(errors="replace") == address
    except OSError:
        return False
    finally:
        os.close(file)
    return False
