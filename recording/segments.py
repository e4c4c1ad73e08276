"""One run's journal as a chain of files: the next one begins where a disk failed or a file is long enough.

``<run>.journal`` is the first; ``<run>.journal.1``, ``.2`` … follow. The header of a later one says with
which record of the run it begins (``first_record``; header and layout frames are no records). Records that
the file before could not bring to the disk are written again in the next, so that a reader takes every
record once, from wherever it is whole.
"""

from __future__ import annotations

import threading
import zlib
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from foundation.errors import BadInput
from recording.content import MAIN_STREAM
from recording.journal import (
    DataRecord,
    EndRecord,
    JournalReader,
    JournalWriter,
    Record,
    Scan,
    Stop,
    more_records_behind,
)
from recording.journal_file import JournalFile

SEGMENT_BYTES = 1 << 30
"""A file that has grown beyond this is followed by another."""


def segment_path(first: Path, number: int) -> Path:
    """Return the path of a segment of a run's journal; 0 is the first."""
    return first if number == 0 else first.with_name(f"{first.name}.{number}")


def later_segments(first: Path) -> list[Path]:
    """Return the segments that lie behind a journal's first, in order; those behind a hole as well."""
    found = []
    for path in first.parent.glob(f"{first.name}.*"):
        number = path.name.removeprefix(f"{first.name}.")
        if number.isascii() and number.isdigit():
            found.append((int(number), path))
    return [path for _, path in sorted(found)]


class SegmentedJournal:
    """Appends records and acknowledges them; goes on in a new file when the disk refuses a sync.

    :meth:`write` and :meth:`finish` are for one thread, :meth:`sync` for another.

    Parameters
    ----------
    first : Path
        Its first file.
    run_id : str
        Of the run.
    document : mapping
        The complete metadata document, in every segment's header.
    journal_file : callable
        Makes a file from its path and first bytes.
    segment_bytes : int
        A file of this size is followed by another.

    Raises
    ------
    BadInput
        If the folder does not take the first file.
    """

    def __init__(
        self,
        first: Path,
        run_id: str,
        document: Mapping[str, Any],
        *,
        journal_file: Callable[[Path, bytes], JournalFile] = JournalFile,
        segment_bytes: int = SEGMENT_BYTES,
    ) -> None:
        self.written = 0
        """Samples of the controller stream that the operating system has."""
        self.durable = 0
        """Samples of the controller stream that are on the disk (acknowledged)."""
        self.renewals: list[str] = []
        """Why files were given up and their unacknowledged records written again."""
        self._first, self._run_id, self._document = first, run_id, document
        self._make_file, self._segment_bytes = journal_file, segment_bytes
        self._lock = threading.Lock()
        self._records = 0
        self._waiting: deque[Record] = deque()  # written, not acknowledged; the last of the records
        self._frames = JournalWriter()
        self._files = [journal_file(first, self._frames.header(run_id, document))]

    @property
    def disk_warning(self) -> str | None:
        """Why no space could be reserved ahead, once that happened in the present file."""
        return self._files[-1].disk_warning

    def write(self, records: Sequence[Record]) -> None:
        """Write records behind those that are there: all of them or none.

        Raises
        ------
        OSError
            If the file does not take them.
        ValueError
            If one of them cannot be framed.
        """
        with self._lock:
            self._append(records)
            if self._files[-1].size >= self._segment_bytes:
                self._rotate()

    def sync(self) -> None:
        """Bring to the disk what was written before the call, if need be in a new file.

        Raises
        ------
        OSError
            If it did not get there, and a new file did not take it either.
        """
        with self._lock:
            file, records, written = self._files[-1], self._records, self.written
        try:
            file.sync()
        except OSError as error:
            with self._lock:
                if file is self._files[-1]:
                    self._renew(error)
            return
        with self._lock:
            self._acknowledge(records, written)

    def finish(self, end: EndRecord) -> None:
        """Write the last record and bring everything to the disk.

        Raises
        ------
        OSError
            If that failed. What was acknowledged before is safe.
        """
        with self._lock:
            refused: OSError | None = None
            try:
                self._append([end])
            except OSError as error:
                refused = error
            try:
                self._files[-1].finish()
            except OSError as error:
                self._renew(error)
            self._acknowledge(self._records, self.written)
            if refused is not None:
                raise refused

    def close(self) -> None:
        """Let go of all files and their locks."""
        for file in self._files:
            file.close()

    def _append(self, records: Sequence[Record]) -> None:
        frames = self._frames.mark()
        content = b"".join([frames.record(record) for record in records])
        if content:
            self._files[-1].append(content)
        self._frames = frames
        self._records += len(records)
        self._waiting.extend(records)
        self.written += _samples(records)

    def _acknowledge(self, records: int, written: int) -> None:
        """Note that so many records of the run, with so many samples, are on the disk."""
        for _ in range(records - (self._records - len(self._waiting))):
            self._waiting.popleft()
        self.durable = max(self.durable, written)

    def _rotate(self) -> None:
        """End a long file, whole and on the disk, and go on in the next."""
        try:
            self._files[-1].finish()
        except OSError as error:
            self._renew(error)
            return
        self._acknowledge(self._records, self.written)
        try:
            self._open_next()
        except (OSError, BadInput):
            self._segment_bytes *= 2  # the present file goes on: longer than wished is better than none

    def _renew(self, error: OSError) -> None:
        """Give up a file after a failed sync: the kernel may have dropped what it could not write.

        Raises
        ------
        OSError
            The error itself, if a new file does not take the unacknowledged records.
        """
        try:
            self._open_next()
        except (OSError, BadInput):
            raise error from None
        self.renewals.append(str(error))
        self._acknowledge(self._records, self.written)

    def _open_next(self) -> None:
        """Go on in a new file that begins, on the disk, with all records that wait for acknowledgement."""
        number = len(self._files)
        frames = JournalWriter()
        begin = frames.header(
            self._run_id, self._document, segment=number, first_record=self._records - len(self._waiting)
        )
        file = self._make_file(segment_path(self._first, number), begin)
        try:
            if content := b"".join([frames.record(record) for record in self._waiting]):
                file.append(content)
            file.sync()
        except OSError:
            file.close()
            file.path.unlink(missing_ok=True)
            raise
        self._frames = frames
        self._files.append(file)


def _samples(records: Sequence[Record]) -> int:
    return sum(len(r.time_us) for r in records if isinstance(r, DataRecord) and r.stream == MAIN_STREAM)


class ChainReader:
    """Reads a run's journal through all its segments, also while it is written; takes no lock.

    Parameters
    ----------
    first : Path
        Its first file.

    Raises
    ------
    BadInput
        If that cannot be opened.
    """

    def __init__(self, first: Path) -> None:
        self.header: dict[str, Any] | None = None
        """Content of the first header, once it was read."""
        self.missing = 0
        """Records that no segment holds whole."""
        self.breaks: list[str] = []
        """Why segments that lack records break off."""
        self._first = first
        self._number = 0
        self._records = 0
        self._more_behind = False
        self._done = (0, 0, 0)  # frames, bytes, fingerprint of the segments before
        self._reader = JournalReader(first)

    def __enter__(self) -> ChainReader:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._reader.close()

    @property
    def stop(self) -> Stop:
        """Why reading stopped where it did."""
        return self._reader.stop

    @property
    def why(self) -> str:
        """The same in words."""
        return "; ".join([*self.breaks, self._reader.why])

    @property
    def read_so_far(self) -> tuple[int, int, int]:
        """Whole frames, their bytes, and a fingerprint of all of them."""
        frames, size, crc = self._done
        fingerprint = self._reader.crc if self._number == 0 else _fold(crc, self._reader.crc)
        return frames + self._reader.frames, size + self._reader.offset, fingerprint

    def more_lies_behind(self) -> bool:
        """Tell whether a segment that lacks records seems to hold further ones behind an invalid one."""
        return self._more_behind or (
            self.stop is not Stop.ENDED and more_records_behind(self._reader.path, self._reader.offset + 1)
        )

    def poll(self) -> list[Record]:
        """Return the records that have come in since the last call, each once.

        Raises
        ------
        BadInput
            If the journal was written in a newer format, or a segment is not one of this run.
        """
        records = self._take(self._reader.poll())
        while self._reader.stop is not Stop.ENDED:
            following = self._following()
            if following is None:
                break
            records += self._take(self._reader.poll())  # before there is a next one, this one is complete
            records += self._go_on_with(following)
        return records

    def _take(self, records: list[Record]) -> list[Record]:
        if self.header is None:
            self.header = self._reader.header
        self._records += len(records)
        return records

    def _following(self) -> tuple[JournalReader, list[Record]] | None:
        path = segment_path(self._first, self._number + 1)
        if not path.exists():
            return None
        reader = JournalReader(path)
        records = reader.poll()
        header = reader.header
        if header is None:
            reader.close()
            return None
        if self.header is None or header["run_id"] != self.header["run_id"]:
            reader.close()
            raise BadInput("is no part of this run's journal", file=path, remedy="move it away")
        return reader, records

    def _go_on_with(self, following: tuple[JournalReader, list[Record]]) -> list[Record]:
        reader, records = following
        begins = int((reader.header or {})["first_record"])
        if begins > self._records:
            lacking = begins - self._records
            self.missing += lacking
            self._more_behind |= more_records_behind(self._reader.path, self._reader.offset + 1)
            self.breaks.append(f"{self._reader.path.name}: {self._reader.why}, {lacking} records are missing")
            self._records = begins
        repeated = self._records - begins
        self._done = self.read_so_far
        self._reader.close()
        self._reader, self._number = reader, self._number + 1
        self._records = max(self._records, begins + len(records))
        return records[repeated:]


def _fold(before: int, after: int) -> int:
    return zlib.crc32(after.to_bytes(4, "little"), before)


def scan_chain(first: Path) -> Scan:
    """Read a whole journal through all its segments, each up to its first invalid record.

    Raises
    ------
    BadInput
        If it cannot be read, was written in a newer format, or holds a segment of another run.
    """
    with ChainReader(first) as reader:
        records = reader.poll()
        frames, size, crc = reader.read_so_far
        return Scan(
            header=reader.header,
            records=records,
            valid_bytes=size,
            frames=frames,
            crc=crc,
            stop=reader.stop,
            why=reader.why,
            more_follows=reader.more_lies_behind(),
            missing=reader.missing,
        )
