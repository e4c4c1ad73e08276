"""A file of things that were looked up before: it may be deleted at any time, and costs only time then."""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

SETTLED_S = 2.0
"""A file changed so lately may change again without its times showing it: nothing is kept of it."""
NO_FOLDER = "nothing is kept: this user has no home folder; name a folder with --cache, or set HOME"
"""What is to be said where :func:`default_folder` finds none."""
_BUSY_S = 20.0
_HELD_KB = 16_384
"""So much is held before a transaction ends; what does not fit would be written, and synchronised, twice."""


@dataclass(frozen=True)
class Stamp:
    """What tells that a file is as it was, without reading it."""

    size: int
    mtime_ns: int
    ctime_ns: int
    inode: int
    settled: bool = field(default=True, compare=False)
    """Whether a change after it was taken shows in the times; of one that was kept, it did."""

    def row(self) -> tuple[int, int, int, int]:
        """Return it as four columns."""
        return self.size, self.mtime_ns, self.ctime_ns, self.inode


STAMP_COLUMNS = "size INTEGER, mtime_ns INTEGER, ctime_ns INTEGER, inode INTEGER"


def stamp_of(path: Path) -> Stamp | None:
    """Return a file's stamp; None where there is no such file."""
    try:
        facts = path.stat()
    except OSError:
        return None
    settled = time.time() - max(facts.st_mtime_ns, facts.st_ctime_ns) * 1e-9 > SETTLED_S
    return Stamp(facts.st_size, facts.st_mtime_ns, facts.st_ctime_ns, facts.st_ino, settled)


def default_folder() -> Path | None:
    """Return where such files lie if nothing else is said: in the user's cache folder.

    None where there is no such folder: of a user whom the system does not know (containers), without HOME.
    """
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not base.is_absolute():
        try:
            base = Path.home() / ".cache"
        except RuntimeError:
            return None
    return base / "bufferstand"


class CacheFile:
    """An SQLite file. Whatever happens to it, those who ask go on without it.

    Parameters
    ----------
    folder : Path or None
        Made if it is missing. None: there is nowhere to keep anything.
    name : str
        Of the file in it, which is made if it is missing, and made anew if it is damaged.
    schema : str
        SQL that makes the tables that are missing.
    """

    def __init__(self, folder: Path | None, name: str, schema: str) -> None:
        self._schema = schema
        self._connection: sqlite3.Connection | None = None
        self.problem = ""
        """Why there is none, or none any more; empty while there is one."""
        if folder is None:
            self.problem = NO_FOLDER
            return
        self._path = folder / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._connection = self._opened()
        except (sqlite3.Error, OSError) as error:
            self._give_up(error)

    @property
    def usable(self) -> bool:
        """Whether there is one."""
        return self._connection is not None

    def close(self) -> None:
        """Close it."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    @contextmanager
    def guarded(self) -> Iterator[sqlite3.Connection | None]:
        """Give the connection, None where there is none, and commit; what goes wrong with it ends its use."""
        try:
            yield self._connection
            if self._connection is not None:
                self._connection.commit()
        except (sqlite3.Error, OSError) as error:
            self._give_up(error)

    def _opened(self) -> sqlite3.Connection:
        try:
            return self._connected()
        except sqlite3.DatabaseError as error:
            if isinstance(error, sqlite3.OperationalError):
                raise
        self._path.unlink(missing_ok=True)  # no database, or a damaged one: what it held can be had again
        return self._connected()

    def _connected(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self._path, timeout=_BUSY_S)
        try:
            connection.execute(f"PRAGMA cache_size = -{_HELD_KB}")
            connection.executescript(self._schema)
        except sqlite3.Error:
            connection.close()
            raise
        return connection

    def _give_up(self, error: Exception) -> None:
        self.problem = f"{self._path}: {error}; going on without it"
        self.close()
