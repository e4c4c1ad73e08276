"""The cache of evaluated runs.

A result is found by the hash of the run's content, of the settings and of the software. Which content a file
has is known without reading it while its size, its times and its inode are the same; otherwise all its bytes
are read.
"""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

from bufferstand.evaluation.archive.stored_run import RequestedParts, StoredRun
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import readable
from bufferstand.recording.finding import STAMP_COLUMNS, CacheFile, Stamp, check_sum
from bufferstand.recording.runfile import checked_content

FILE_NAME = "evaluations-3.sqlite"
KEPT_DAYS = 90
"""Results of other software than the present are dropped when they are older."""
_SCHEMA = f"""
CREATE TABLE IF NOT EXISTS files (path TEXT PRIMARY KEY, {STAMP_COLUMNS}, sha256 TEXT) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS runs (
    sha256 TEXT, settings TEXT, software TEXT, written REAL, check_sum INTEGER,
    text TEXT, cycles BLOB, loop BLOB, rows TEXT, entry_check_sum INTEGER, entry BLOB,
    PRIMARY KEY (sha256, settings, software)
);
"""


class Cache:
    """Results kept in a folder.

    Parameters
    ----------
    folder : Path or None
        Made if it is missing. None: there is nowhere to keep anything.
    settings, software : str
        Hashes of what is evaluated with.
    """

    def __init__(self, folder: Path | None, settings: str, software: str) -> None:
        self._file = CacheFile(folder, FILE_NAME, _SCHEMA)
        self._key = settings, software

    @property
    def problem(self) -> str:
        """Why there is no cache, or none any more; empty while there is one."""
        return self._file.problem

    def close(self) -> None:
        """Drop what is outdated, and close."""
        old = time.time() - KEPT_DAYS * 86_400.0
        with self._file.guarded() as connection:
            if connection is not None:
                connection.execute(
                    "DELETE FROM runs WHERE software <> ? AND written < ?", (self._key[1], old)
                )
        self._file.close()

    def known_contents(self, stamps: Iterable[tuple[Path, Stamp | None]]) -> dict[Path, str]:
        """Return the content hash of each file of which it is known, and right.

        A file that is not as it was when it was evaluated is read whole: if it is as it was sealed, the hash
        that it states holds; if not, the evaluation has to look at it.
        """
        found: dict[Path, str] = {}
        renewed: list[tuple[Path, Stamp, str]] = []
        for path, stamp in stamps:
            if stamp is None or not self._file.usable:
                continue
            kept = self._kept_file(path)
            if kept is not None and kept[0] == stamp:
                found[path] = kept[1]
            elif self._has_results() and (content := _content_if_whole(path)) is not None:
                found[path] = content
                renewed.append((path, stamp, content))
        with self._file.guarded() as connection:
            if connection is not None and renewed:
                _insert_files(connection, renewed)
        return found

    def _kept_file(self, path: Path) -> tuple[Stamp, str] | None:
        with self._file.guarded() as connection:
            if connection is None:
                return None
            row = connection.execute(
                "SELECT size, mtime_ns, ctime_ns, inode, sha256 FROM files WHERE path = ?", (_name(path),)
            ).fetchone()
            return None if row is None else (Stamp(*row[:4]), row[4])
        return None

    def _has_results(self) -> bool:
        """Say whether there is anything that a content could be looked up for."""
        with self._file.guarded() as connection:
            if connection is not None:
                row = connection.execute(
                    "SELECT 1 FROM runs WHERE settings = ? AND software = ? LIMIT 1", self._key
                ).fetchone()
                return row is not None
        return False

    def find(self, path: str, content: str, wanted: RequestedParts) -> StoredRun | None:
        """Return the result for a content, under a path; None where there is none, or it is damaged."""
        with self._file.guarded() as connection:
            if connection is None:
                return None
            kept = "entry_check_sum, entry" if wanted.entries else "0, x''"
            row = connection.execute(
                f"SELECT check_sum, text, cycles, loop, rows, {kept} FROM runs "
                "WHERE sha256 = ? AND settings = ? AND software = ?",
                (content, *self._key),
            ).fetchone()
            if row is None:
                return None
            stated, text, cycles, loop, rows, entry_stated, entry = row
            if stated == check_sum(text, cycles, loop, rows) and (
                not wanted.entries or entry_stated == check_sum(entry)
            ):
                return StoredRun(readable(path), text, cycles, loop, entry, rows).with_only(wanted)
        return None

    def remember(self, results: Sequence[tuple[Path, Stamp | None, StoredRun]]) -> None:
        """Keep results, each with the stamp that its file had before it was read."""
        with self._file.guarded() as connection:
            if connection is None:
                return
            for _, _, run in results:
                parts = run.text, run.cycles, run.loop, run.rows
                sums = check_sum(*parts), check_sum(run.entry)
                connection.execute(
                    "INSERT OR REPLACE INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                    (run.facts["sha256"], *self._key, time.time(), sums[0], *parts, sums[1], run.entry),
                )
            _insert_files(
                connection,
                [(p, stamp, run.facts["sha256"]) for p, stamp, run in results if stamp is not None],
            )


def _insert_files(connection: sqlite3.Connection, files: Sequence[tuple[Path, Stamp, str]]) -> None:
    rows = [(_name(path), *stamp.row(), content) for path, stamp, content in files if stamp.settled]
    connection.executemany("INSERT OR REPLACE INTO files VALUES (?, ?, ?, ?, ?, ?)", rows)


def _name(path: Path) -> str:
    return readable(os.path.abspath(path))  # noqa: PTH100 - resolving links takes ten times as long, and only saves time


def _content_if_whole(path: Path) -> str | None:
    try:
        return checked_content(path)
    except (BadInput, OSError):
        return None
