"""Reads a journal in two passes: first its outline, then its numbers for the run file, some MiB at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.recording.content import Anchor, Event, Segment, add_segment
from bufferstand.recording.journal import ChainReader, DataRecord, EndRecord, JournalEnd, Record
from bufferstand.recording.runfile import (
    ENTRY,
    DatasetColumn,
    StreamHead,
    Widths,
    item_values,
    segment_rows,
    stream_columns,
)


@dataclass
class StreamOutline:
    """What a journal holds of one device."""

    dtypes: dict[str, np.dtype[Any]]
    """Of each channel: one that holds the numbers of all its blocks."""
    rows: int = 0
    segments: list[Segment] = field(default_factory=list)

    def take(self, record: DataRecord) -> None:
        """Count a block."""
        if len(record.time_us):
            add_segment(self.segments, Segment(self.rows, record.sequence, record.lost))
        self.rows += len(record.time_us)
        for channel, values in record.counts.items():
            known = self.dtypes.setdefault(channel, values.dtype)
            self.dtypes[channel] = np.result_type(known, values.dtype)


@dataclass(frozen=True)
class Outline:
    """What a journal holds, through all its segments, each up to its first invalid record.

    Parameters
    ----------
    header : mapping or None
        Content of its first header; None if that is not whole.
    streams : mapping of str to StreamOutline
        Of those that delivered, in the order in which they first did.
    widths : Widths
        Of events and anchors.
    end : EndRecord or None
        How the recording was closed.
    last_utc : str or None
        Time of the last anchor.
    frames, valid_bytes, crc : int
        Whole frames, their bytes, and a fingerprint of all of them.
    stop : Stop
        Why reading stopped where it did, and ``why`` in words.
    more_follows : bool
        Further records seem to lie behind an invalid one.
    missing : int
        Records that were lost between segments.
    """

    header: Mapping[str, Any] | None
    streams: Mapping[str, StreamOutline]
    widths: Widths
    end: EndRecord | None
    last_utc: str | None
    frames: int
    valid_bytes: int
    crc: int
    stop: JournalEnd
    why: str
    more_follows: bool
    missing: int

    def columns(self, heads: Mapping[str, StreamHead]) -> list[DatasetColumn]:
        """Return the datasets of the run file, those of streams that delivered in the given order."""
        stamps = np.dtype("<i8")
        columns: list[DatasetColumn] = []
        for name, head in heads.items():
            if stream := self.streams.get(name):
                columns += stream_columns(
                    name, stream.rows, stamps, stream.dtypes, len(stream.segments), head.raw_units
                )
        return [*columns, *self.widths.columns()]


def outline(journal: Path) -> Outline:
    """Read a whole journal and return what it holds.

    Raises
    ------
    BadInput
        If it cannot be read, was written in a newer format, or holds a segment of another run.
    """
    streams: dict[str, StreamOutline] = {}
    widths = Widths()
    end: EndRecord | None = None
    last_utc: str | None = None
    with ChainReader(journal) as reader:
        for record in _records(reader):
            if isinstance(record, DataRecord):
                streams.setdefault(record.stream, StreamOutline({})).take(record)
            elif isinstance(record, EndRecord):
                end = end or record
            else:
                widths.take(record)
                last_utc = record.utc if isinstance(record, Anchor) else last_utc
        frames, valid_bytes, crc = reader.read_so_far
        return Outline(
            header=reader.header,
            streams=streams,
            widths=widths,
            end=end,
            last_utc=last_utc,
            frames=frames,
            valid_bytes=valid_bytes,
            crc=crc,
            stop=reader.stop,
            why=reader.why,
            more_follows=reader.more_lies_behind(),
            missing=reader.missing,
        )


def values_of(journal: Path, found: Outline) -> Iterator[tuple[str, NDArray[Any]]]:
    """Return the numbers of a journal in order: a dataset's place, and its next rows.

    Raises
    ------
    BadInput
        As :func:`outline`, and if the journal is no longer what it was then.
    """
    for name, stream in found.streams.items():
        yield f"{ENTRY}/{name}/segments", segment_rows(stream.segments)
    with ChainReader(journal) as reader:
        for record in _records(reader):
            if isinstance(record, DataRecord):
                place = f"{ENTRY}/{record.stream}"
                yield f"{place}/time_us", record.time_us
                for channel, values in record.counts.items():
                    yield f"{place}/{channel}", values
            elif isinstance(record, Event | Anchor):
                yield from item_values(record)
        if reader.read_so_far != (found.frames, found.valid_bytes, found.crc):
            raise BadInput("the journal changed while it was sealed", file=journal, remedy="seal it again")


def _records(reader: ChainReader) -> Iterator[Record]:
    for batch in reader.batches():
        yield from batch
