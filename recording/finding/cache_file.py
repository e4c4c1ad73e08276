"""A cache file: it may be deleted at any time, at the cost of time only."""

from __future__ import annotations

import os
import sqlite3
import time
import zlib
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

SETTLED_S = 2.0
"""A file changed so lately may change again without its times showing it: nothing is kept of it."""
NO_FOLDER = "nothing is kept: this user has no home folder; name a folder with --cache, or set HOME"
"""What is to be said where :func:`default_folder` finds none."""
_BUSY_S = 20.0
_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR)
"""The last one is of SQL that does not fit the tables: they are not those of the schema."""
_FAULTS = (sqlite3.Error, OSError, UnicodeDecodeError)
"""The last one is raised for an error of SQLite whose message has the garbled name of a table."""
_COLUMNS = """
SELECT tables.name, columns.cid, columns.name, columns.type, columns.pk
FROM sqlite_master AS tables, pragma_table_info(tables.name) AS columns
WHERE tables.type = 'table' ORDER BY tables.name, columns.cid
"""
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
        self._inode = 0
        self._made_anew = False
        self._connection: sqlite3.Connection | None = None
        self.problem = ""
        """Why there is none, or none any more; empty while there is one."""
        if folder is None:
            self.problem = NO_FOLDER
            return
        self._path = folder / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._connection = self._connected()
        except _FAULTS as error:
            self._recover(error)

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
        """Give the connection, None without one, and commit; what goes wrong ends it or makes it anew."""
        try:
            yield self._connection
            if self._connection is not None:
                self._connection.commit()
        except _FAULTS as error:
            self._recover(error)

    def _connected(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self._path, timeout=_BUSY_S)
        try:
            self._inode = self._path.stat().st_ino
            connection.text_factory = _text  # what is no text any more is for the check sums to find
            connection.execute(f"PRAGMA cache_size = -{_HELD_KB}")
            connection.executescript(self._schema)
            if not _has_tables(connection, self._schema):
                raise _OtherTables("it has other tables")
        except _FAULTS:
            connection.close()
            raise
        return connection

    def _recover(self, error: Exception) -> None:
        """Make it anew if it is damaged: what it held can be had again. Else, or the second time, give up."""
        self.close()
        try:
            if self._made_anew or not _is_damage(error):
                raise error
            self._made_anew = True
            self._discard()
            self._connection = self._connected()
        except _FAULTS as last:
            self.problem = f"{self._path}: {last}; going on without it"

    def _discard(self) -> None:
        """Delete it, unless another process that found the damage, too, has made it anew already."""
        with suppress(FileNotFoundError):
            if self._path.stat().st_ino == self._inode:
                self._path.unlink()


class _OtherTables(sqlite3.DatabaseError):
    """A database, but none of ours."""


def _is_damage(error: Exception) -> bool:
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # the lowest byte is the kind of error
    return isinstance(error, _OtherTables | UnicodeDecodeError) or code in _DAMAGE


def _has_tables(connection: sqlite3.Connection, schema: str) -> bool:
    """Tell whether the tables of a schema are there with its columns, and no others."""
    with closing(sqlite3.connect(":memory:")) as other:
        other.executescript(schema)
        wanted = other.execute(_COLUMNS).fetchall()
    names = {row[0] for row in wanted}
    return [row for row in connection.execute(_COLUMNS) if row[0] in names] == wanted


def _text(content: bytes) -> str:
    return content.decode("utf-8", "replace")


def check_sum(*parts: object) -> int:
    """Return a check sum of texts and bytes as they come out of the file; of anything else one that none has.

    Which of both a part is counts, too: a single bit in the file makes one of the other.
    """
    total = 0
    for part in parts:
        if isinstance(part, str):
            total = zlib.crc32(part.encode(), zlib.crc32(b"text", total))
        elif isinstance(part, bytes):
            total = zlib.crc32(part, zlib.crc32(b"bytes", total))
        else:
            return -1
    return total
