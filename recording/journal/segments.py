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
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from bufferstand.foundation import BadInput
from bufferstand.recording.content import main_stream
from bufferstand.recording.journal.file import JournalFile
from bufferstand.recording.journal.records import (
    DataRecord,
    EndRecord,
    JournalEnd,
    JournalReader,
    JournalWriter,
    Record,
    more_records_behind,
)

SEGMENT_BYTES = 1 << 30
"""A file that has grown beyond this is followed by another."""
BATCH_BYTES = 4 << 20
"""So much of a journal is held in memory at once by who reads all of it."""


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
        """Samples of the leading stream that the operating system has."""
        self.durable = 0
        """Samples of the leading stream that are on the disk (acknowledged)."""
        self.renewals: list[str] = []
        """Why files were given up and their unacknowledged records written again."""
        self._first, self._run_id, self._document = first, run_id, document
        self._make_file, self._segment_bytes = journal_file, segment_bytes
        self._leading = main_stream(document.get("streams") or ())
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
        self.written += _samples(records, self._leading)

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


def _samples(records: Sequence[Record], stream: str) -> int:
    return sum(len(r.time_us) for r in records if isinstance(r, DataRecord) and r.stream == stream)


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
        self._records = 0  # of the run: so many were returned, or are missing
        self._position = 0  # of the run: the number of the record that the present segment gives next
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
    def stop(self) -> JournalEnd:
        """Why reading stopped where it did."""
        return self._reader.stop

    @property
    def drained(self) -> bool:
        """Whether the last call of :meth:`poll` came to where reading stops."""
        return self._reader.drained

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
            self.stop is not JournalEnd.ENDED
            and more_records_behind(self._reader.path, self._reader.offset + 1)
        )

    def poll(self, at_most: int | None = None) -> list[Record]:
        """Return the records that have come in since the last call, each once.

        Parameters
        ----------
        at_most : int, optional
            Bytes after which the call leaves the rest to the next one: ``drained`` is false then.

        Raises
        ------
        BadInput
            If the journal was written in a newer format, or a segment is not one of this run.
        """
        records = self._take(self._reader.poll(at_most))
        while self.drained and self.stop is not JournalEnd.ENDED:
            following = self._following()
            if following is None:
                break
            records += self._take(self._reader.poll())  # before there is a next one, this one is complete
            self._go_on_with(*following)
            records += self._take(self._reader.poll(at_most))
        return records

    def batches(self) -> Iterator[list[Record]]:
        """Go through all records to the end of the last segment, some MiB at a time.

        Raises
        ------
        BadInput
            As :meth:`poll`.
        """
        while True:
            records = self.poll(BATCH_BYTES)
            yield records
            if self.drained:
                return

    def _take(self, records: list[Record]) -> list[Record]:
        """Return those of the present segment's next records that no segment before gave."""
        if self.header is None:
            self.header = self._reader.header
        known = max(self._records - self._position, 0)
        self._position += len(records)
        self._records = max(self._records, self._position)
        return records[known:]

    def _following(self) -> tuple[int, JournalReader] | None:
        """Return the next segment whose header is whole, and its number; note those that are damaged."""
        damaged: list[str] = []
        for path in later_segments(self._first):
            number = int(path.name.removeprefix(f"{self._first.name}."))
            if number <= self._number:
                continue
            reader = JournalReader(path)
            reader.poll(at_most=1)  # the header alone
            header = reader.header
            if header is not None:
                self._demand_same_run(header, reader)
                self._note_damaged(damaged)
                return number, reader
            damaged.append(f"{path.name}: {reader.why}")
            reader.close()
        self._note_damaged(damaged)
        return None

    def _demand_same_run(self, header: Mapping[str, Any], reader: JournalReader) -> None:
        run_id = self.header["run_id"] if self.header is not None else self._first.stem
        if header["run_id"] != run_id:
            reader.close()
            raise BadInput("is no part of this run's journal", file=reader.path, remedy="move it away")

    def _note_damaged(self, whys: Sequence[str]) -> None:
        self.breaks += [why for why in whys if why not in self.breaks]
        self._more_behind |= bool(whys)

    def _go_on_with(self, number: int, following: JournalReader) -> None:
        begins = int((following.header or {})["first_record"])
        if begins > self._records:
            lacking = begins - self._records
            self.missing += lacking
            self._more_behind |= more_records_behind(self._reader.path, self._reader.offset + 1)
            self.breaks.append(f"{self._reader.path.name}: {self._reader.why}, {lacking} records are missing")
            self._records = begins
        self._done = self.read_so_far
        self._reader.close()
        self._reader, self._number, self._position = following, number, begins


def _fold(before: int, after: int) -> int:
    return zlib.crc32(after.to_bytes(4, "little"), before)
