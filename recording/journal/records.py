"""The journal of a running recording: CRC-framed records, appended only.

Layout (little endian)::

    frame   = magic "BSJ1", u32 crc, u32 length, u8 kind, u8 0, u16 stream, u64 number, payload[length]
    header  = JSON {"format", "format_version", "run_id", "segment", "first_record", "metadata"} always first
    layout  = JSON {"stream": name, "channels": [[name, dtype], …]}                before a stream's data
    data    = i64 sequence, i64 lost, u32 rows, u32 0, i64 time_us[rows], then each channel's rows
    anchor  = JSON {"device_us", "host_s", "utc"}
    event   = JSON {"at_s", "kind", "text", "data"}
    end     = JSON {"status", "reason", "ended_utc", "figures"}

The CRC-32 covers everything after itself and is seeded with the CRC of the frame before, so that a frame
counts only as the continuation of exactly those before it: a missing, doubled, foreign or stale frame is as
invalid as a torn one. Zeros after the last frame are space reserved ahead.
"""

from __future__ import annotations

import math
import os
import re
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from bufferstand.foundation import BadInput, has_controls
from bufferstand.foundation.files import canonical_json, json_content, of_type
from bufferstand.recording.content import Anchor, Event

MAGIC = b"BSJ1"
JOURNAL_FORMAT = "bufferstand/journal"
JOURNAL_VERSION = 1
FRAME = struct.Struct("<4sIIBBHQ")
_CRC_FROM = 8  # the magic and the CRC itself are not covered
_DATA = struct.Struct("<qqII")
MAX_PAYLOAD = 1 << 28
_READ_AT_ONCE = 1 << 20
LONGEST_NAME = 200
"""Characters of the name of a stream or channel."""
_NUMBERS = re.compile("[<>|]?(?:[iu][1248]|f[248]|b1)")


class FrameKind(IntEnum):
    """What a frame holds."""

    HEADER = 1
    LAYOUT = 2
    DATA = 3
    ANCHOR = 4
    EVENT = 5
    END = 6


@dataclass(frozen=True)
class DataRecord:
    """Consecutive samples of one stream, as appended."""

    stream: str
    sequence: int
    lost: int
    time_us: NDArray[np.int64]
    counts: Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class EndRecord:
    """How the recording was closed; ``figures`` are what the recorder counted about itself."""

    status: str
    reason: str
    ended_utc: str
    figures: Mapping[str, Any] = field(default_factory=dict)


Record = DataRecord | Anchor | Event | EndRecord


class HeaderForm(TypedDict):
    """What a header frame holds."""

    format: str
    format_version: int
    run_id: str
    segment: int
    first_record: int
    metadata: dict[str, Any]


class LayoutForm(TypedDict):
    """What a layout frame holds."""

    stream: str
    channels: list[tuple[str, str]]


class JournalEnd(Enum):
    """Why reading a journal stopped where it did."""

    ENDED = "end record"
    OPEN = "nothing follows"
    TORN = "record cut short"
    INVALID = "invalid record"


class JournalWriter:
    """Frames payloads: numbers them and chains their CRCs. Knows nothing of files."""

    def __init__(self) -> None:
        self._number = 0
        self._crc = 0
        self._layouts: dict[str, tuple[int, list[list[str]]]] = {}

    def mark(self) -> JournalWriter:
        """Return a copy to go on from, should the frames made from here on not reach the file."""
        copy = JournalWriter()
        copy._number, copy._crc, copy._layouts = self._number, self._crc, dict(self._layouts)
        return copy

    def header(
        self, run_id: str, metadata: Mapping[str, Any], *, segment: int = 0, first_record: int = 0
    ) -> bytes:
        """Return the first frame: the run's complete metadata document.

        ``segment`` counts the files of the run's journal, ``first_record`` says with which record of the run
        (header and layout frames do not count) this one begins.
        """
        document = {
            "format": JOURNAL_FORMAT,
            "format_version": JOURNAL_VERSION,
            "run_id": run_id,
            "segment": segment,
            "first_record": first_record,
            "metadata": metadata,
        }
        return self._json(FrameKind.HEADER, document)

    def data(
        self,
        stream: str,
        sequence: int,
        time_us: NDArray[np.int64],
        counts: Mapping[str, NDArray[Any]],
        lost: int,
    ) -> bytes:
        """Return the frame of a block, after a layout frame where the stream's layout is new."""
        columns = {name: np.asarray(column) for name, column in counts.items()}
        layout = [[name, column.dtype.newbyteorder("<").str] for name, column in columns.items()]
        known = self._layouts.get(stream)
        before = b""
        if known is None or known[1] != layout:
            number = len(self._layouts) if known is None else known[0]
            self._layouts[stream] = (number, layout)
            before = self._json(FrameKind.LAYOUT, {"stream": stream, "channels": layout}, number)
        parts = [_DATA.pack(sequence, lost, len(time_us), 0), np.asarray(time_us, dtype="<i8").tobytes()]
        parts += [
            column.astype(dtype, copy=False).tobytes()
            for column, (_, dtype) in zip(columns.values(), layout, strict=True)
        ]
        return before + self._frame(FrameKind.DATA, self._layouts[stream][0], b"".join(parts))

    def anchor(self, anchor: Anchor) -> bytes:
        """Return the frame of a clock anchor."""
        return self._json(FrameKind.ANCHOR, vars(anchor))

    def event(self, event: Event) -> bytes:
        """Return the frame of an event."""
        return self._json(FrameKind.EVENT, {**vars(event), "data": dict(event.data)})

    def end(self, end: EndRecord) -> bytes:
        """Return the last frame."""
        return self._json(FrameKind.END, {**vars(end), "figures": dict(end.figures)})

    def record(self, record: Record) -> bytes:
        """Return the frame of any record."""
        if isinstance(record, DataRecord):
            return self.data(record.stream, record.sequence, record.time_us, record.counts, record.lost)
        if isinstance(record, Anchor):
            return self.anchor(record)
        if isinstance(record, Event):
            return self.event(record)
        return self.end(record)

    def _json(self, kind: FrameKind, content: Any, stream: int = 0) -> bytes:
        return self._frame(kind, stream, canonical_json(content).encode())

    def _frame(self, kind: FrameKind, stream: int, payload: bytes) -> bytes:
        if len(payload) > MAX_PAYLOAD:
            raise ValueError(f"a record of {len(payload)} bytes is larger than the journal takes")
        head = FRAME.pack(MAGIC, 0, len(payload), kind, 0, stream, self._number)[_CRC_FROM:]
        self._crc = zlib.crc32(payload, zlib.crc32(head, self._crc))
        self._number += 1
        return b"".join((MAGIC, struct.pack("<I", self._crc), head, payload))


class JournalReader:
    """Reads a journal, also while it is written: needs no lock and cannot harm the recording.

    Parameters
    ----------
    path : Path
        The journal.

    Raises
    ------
    BadInput
        If the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.header: dict[str, Any] | None = None
        """Content of the header frame, once it was read."""
        self.offset = 0
        """Bytes of whole, valid frames read so far."""
        self.frames = 0
        self.crc = 0
        """CRC of the last valid frame: by the chain, a fingerprint of all of them."""
        self.stop = JournalEnd.OPEN
        self.why = "nothing was read yet"
        self.drained = False
        """Whether the last call of :meth:`poll` came to where reading stops."""
        self._layouts: dict[int, tuple[str, list[tuple[str, np.dtype[Any]]]]] = {}
        try:
            self._handle = os.open(path, os.O_RDONLY)
        except OSError as error:
            raise BadInput(f"cannot be read: {error.strerror}", file=path) from None

    def __enter__(self) -> JournalReader:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file."""
        os.close(self._handle)

    def poll(self, at_most: int | None = None) -> list[Record]:
        """Return the records that have come in since the last call, up to the first invalid frame.

        ``stop`` and ``why`` say afterwards why it stopped there.

        Parameters
        ----------
        at_most : int, optional
            Bytes after which the call leaves the rest to the next one: ``drained`` is false then.

        Raises
        ------
        BadInput
            If the journal was written in a newer format.
        """
        records: list[Record] = []
        began = self.offset
        self.drained = True
        buffer, at = b"", 0  # ``at`` is where in the buffer the byte ``self.offset`` of the file lies
        while self.stop is not JournalEnd.ENDED:
            if at_most is not None and self.offset - began >= at_most:
                self.drained = False
                break
            frame = self._next_frame(buffer, at)
            if isinstance(frame, int):
                buffer, at = buffer[at:], 0
                more = os.pread(self._handle, max(frame, _READ_AT_ONCE), self.offset + len(buffer))
                if not more:
                    self._judge_end(buffer)
                    break
                buffer += more
                continue
            if frame is None:
                break
            kind, stream, payload, crc = frame
            try:
                record = self._record(kind, stream, payload)
            except (ValueError, KeyError, TypeError, struct.error) as error:
                self._stop(JournalEnd.INVALID, f"record {self.frames} makes no sense ({error})")
                break
            size = FRAME.size + len(payload)
            at += size
            self.offset += size
            self.frames += 1
            self.crc = crc
            if record is not None:
                records.append(record)
            if kind == FrameKind.END:
                self._stop(JournalEnd.ENDED, "end record")
        return records

    def _next_frame(self, buffer: bytes, at: int) -> tuple[int, int, bytes, int] | int | None:
        """Return the frame at ``buffer[at:]``, or how many bytes are wanting, or None if it is invalid."""
        held = len(buffer) - at
        if held < FRAME.size:
            return FRAME.size - held
        head: tuple[bytes, int, int, int, int, int, int] = FRAME.unpack_from(buffer, at)
        magic, crc, length, kind, _, stream, number = head
        if magic != MAGIC:
            if not any(buffer[at : at + FRAME.size]):
                self._stop(JournalEnd.OPEN, "no further record, only reserved space")
            else:
                self._stop(JournalEnd.INVALID, f"no record begins at byte {self.offset}")
            return None
        if length > MAX_PAYLOAD or number != self.frames:
            self._stop(JournalEnd.INVALID, f"the record at byte {self.offset} does not continue those before")
            return None
        size = FRAME.size + length
        if held < size:
            return size - held
        payload = buffer[at + FRAME.size : at + size]
        covered = zlib.crc32(buffer[at + _CRC_FROM : at + FRAME.size], self.crc)
        if zlib.crc32(payload, covered) != crc:
            self._stop(JournalEnd.TORN, f"the record at byte {self.offset} is torn or altered (CRC)")
            return None
        return kind, stream, payload, crc

    def _judge_end(self, buffer: bytes) -> None:
        if any(buffer):
            self._stop(
                JournalEnd.TORN, f"the record at byte {self.offset} is cut short after {len(buffer)} bytes"
            )
        else:
            self._stop(JournalEnd.OPEN, "no further record")

    def _stop(self, stop: JournalEnd, why: str) -> None:
        self.stop, self.why = stop, why

    def _record(self, kind: int, stream: int, payload: bytes) -> Record | None:
        if kind == FrameKind.DATA:
            return self._data(stream, payload)
        content = json_content(payload)
        if kind == FrameKind.HEADER:
            self._take_header(content)
            return None
        if kind == FrameKind.LAYOUT:
            layout = of_type(LayoutForm, content)
            columns = [(_name(name), _numbers(dtype)) for name, dtype in layout["channels"]]
            self._layouts[stream] = (_name(layout["stream"]), columns)
            return None
        if kind == FrameKind.ANCHOR:
            return of_type(Anchor, content, math.inf)
        if kind == FrameKind.EVENT:
            return of_type(Event, content, math.inf)
        if kind == FrameKind.END:
            return of_type(EndRecord, content, math.inf)
        raise ValueError(f"unknown kind {kind}")

    def _take_header(self, content: Any) -> None:
        known = content if isinstance(content, dict) else {}
        version = known.get("format_version")
        newer = isinstance(version, int) and version > JOURNAL_VERSION
        if newer and known.get("format") == JOURNAL_FORMAT:
            raise BadInput(
                f"journal version {version} is newer than this software understands ({JOURNAL_VERSION})",
                file=self.path,
                remedy="update bufferstand",
            )
        of_type(HeaderForm, content, math.inf)
        self.header = content

    def _data(self, stream: int, payload: bytes) -> DataRecord:
        name, columns = self._layouts[stream]
        sequence, lost, rows, _ = _DATA.unpack_from(payload)
        expected = _DATA.size + rows * (8 + sum(dtype.itemsize for _, dtype in columns))
        if len(payload) != expected:
            raise ValueError(f"{len(payload)} bytes where {expected} belong")
        time_us = np.frombuffer(payload, "<i8", rows, _DATA.size)
        offset = _DATA.size + 8 * rows
        counts: dict[str, NDArray[Any]] = {}
        for channel, dtype in columns:
            counts[channel] = np.frombuffer(payload, dtype, rows, offset)
            offset += rows * dtype.itemsize
        return DataRecord(name, sequence, lost, time_us, counts)


def _name(text: str) -> str:
    """Return the name of a stream or channel, which becomes that of a dataset.

    Raises
    ------
    ValueError
        If it cannot be one.
    """
    if not text.strip(".") or "/" in text or len(text) > LONGEST_NAME or has_controls(text):
        raise ValueError(f"{text[:LONGEST_NAME]!r} is no name of a channel")
    return text


def _numbers(dtype: str) -> np.dtype[Any]:
    """Return the type of a channel's numbers.

    Raises
    ------
    ValueError
        If it is no type of plain numbers of at most eight bytes.
    """
    if _NUMBERS.fullmatch(dtype) is None:
        raise ValueError(f"{dtype[:LONGEST_NAME]!r} is no type of numbers")
    return np.dtype(dtype)


def more_records_behind(path: Path, offset: int) -> bool:
    """Tell whether the mark of a record occurs anywhere from ``offset`` on."""
    with path.open("rb") as stream:
        stream.seek(offset)
        tail = b""
        while block := stream.read(_READ_AT_ONCE):
            if MAGIC in tail + block:
                return True
            tail = block[-len(MAGIC) + 1 :]
    return False
