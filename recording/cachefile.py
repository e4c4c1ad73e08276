"""A file of things that were looked up before: it may be deleted at any time, and costs only time then."""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

SETTLED_S = 2.0
"""A file changed so lately may change again without its times showing it: nothing is kept of it."""
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

    @property
    def settled(self) -> bool:
        """Whether a later change would show in its times."""
        return time.time() - max(self.mtime_ns, self.ctime_ns) * 1e-9 > SETTLED_S

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
    return Stamp(facts.st_size, facts.st_mtime_ns, facts.st_ctime_ns, facts.st_ino)


def default_folder() -> Path:
    """Return where such files lie if nothing else is said: in the user's cache folder."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if Path(base).is_absolute() else Path.home() / ".cache") / "bufferstand"


class CacheFile:
    """An SQLite file. Whatever happens to it, those who ask go on without it.

    Parameters
    ----------
    path : Path
        Made, with its folder, if it is missing; made anew if it is damaged.
    schema : str
        SQL that makes the tables that are missing.
    """

    def __init__(self, path: Path, schema: str) -> None:
        self._path, self._schema = path, schema
        self._connection: sqlite3.Connection | None = None
        self.problem = ""
        """Why there is none, or none any more; empty while there is one."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
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
