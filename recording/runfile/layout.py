"""The run file's bytes: an HDF5 tree behind a 512-byte user block that carries the hash of all the rest.

The tree is written as its numbers come, a chunk of each dataset at a time, so that a run of any length takes
the same memory.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import canonical_json
from bufferstand.recording.content import Anchor, Event, Segment
from bufferstand.recording.runfile.document_format import FORMAT, FORMAT_VERSION, content_hash_of
from bufferstand.recording.runfile.hdf5_file import TreeFile
from bufferstand.recording.runfile.metadata import StreamHead

USER_BLOCK_BYTES = 512
CHUNK_ROWS = 131_072
CHUNK_BYTES = 8 << 20
"""A chunk of wide rows (long texts) is not larger than this."""
ENTRY = "entry"
FILE_FORMAT = "v108"
"""HDF5 1.8 is what older MATLAB and LabVIEW read; its metadata have checksums, and nothing later is used."""
_GZIP_LEVEL = 4
_STRUCTURE_BYTES = 1 << 20
_STRUCTURE_BYTES_PER_CHUNK = 64
"""Room for HDF5's own structures, which it writes when the tree is closed."""
_SEAL = re.compile(rb"^bufferstand/run \d+\nsha256 of all bytes after byte 512: ([0-9a-f]{64})\n")


@dataclass(frozen=True)
class DatasetColumn:
    """A dataset to be: its place, type and shape of its numbers, and the unit in which they are stored."""

    place: str
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    units: str | None

    @property
    def chunk_rows(self) -> int:
        """Rows of a chunk."""
        row_bytes = self.dtype.itemsize * int(np.prod(self.shape[1:], dtype=int))
        return max(1, min(self.shape[0], CHUNK_ROWS, CHUNK_BYTES // row_bytes))


def stream_columns(
    name: str,
    rows: int,
    time: np.dtype[Any],
    channels: Mapping[str, np.dtype[Any]],
    segments: int,
    raw_units: Mapping[str, str],
) -> list[DatasetColumn]:
    """Return the datasets of a stream: time, channels as delivered, segments."""
    place = f"{ENTRY}/{name}"
    imported = time.kind == "f"
    stamps = ("time_s", "<f8", "s") if imported else ("time_us", "<i8", "us")
    return [
        DatasetColumn(f"{place}/{stamps[0]}", np.dtype(stamps[1]), (rows,), stamps[2]),
        *(
            DatasetColumn(
                f"{place}/{channel}", dtype.newbyteorder("<"), (rows,), raw_units.get(channel, "count")
            )
            for channel, dtype in channels.items()
        ),
        DatasetColumn(f"{place}/segments", np.dtype("<i8"), (segments, 3), None),
    ]


def segment_rows(segments: Sequence[Segment]) -> NDArray[np.int64]:
    """Return the numbers of a stream's dataset ``segments``, shape (k, 3)."""
    rows = [(s.first_row, s.first_sequence, s.lost) for s in segments]
    return np.array(rows, dtype="<i8").reshape(-1, 3)


class Widths:
    """What decides the types of events' and anchors' texts: the longest, and whether any is not ASCII."""

    def __init__(self) -> None:
        self.events = 0
        self.anchors = 0
        self._width = dict.fromkeys(("events/kind", "events/text", "events/data", "anchors/utc"), 1)
        self._beyond_ascii: set[str] = set()

    def take(self, item: Event | Anchor) -> None:
        """Count an event or an anchor."""
        if isinstance(item, Event):
            self.events += 1
        else:
            self.anchors += 1
        for place, text in _texts_of(item):
            self._width[place] = max(self._width[place], len(text))
            if not text.isascii():
                self._beyond_ascii.add(place)

    def columns(self) -> list[DatasetColumn]:
        """Return the datasets of all events and anchors that were counted."""

        def numbers(place: str, dtype: str, units: str) -> DatasetColumn:
            rows = self.events if place.startswith("events") else self.anchors
            return DatasetColumn(f"{ENTRY}/{place}", np.dtype(dtype), (rows,), units)

        def texts(place: str) -> DatasetColumn:
            rows = self.events if place.startswith("events") else self.anchors
            encoding = "utf-8" if place in self._beyond_ascii else "ascii"
            dtype = h5py.string_dtype(encoding, self._width[place])
            return DatasetColumn(f"{ENTRY}/{place}", dtype, (rows,), None)

        return [
            numbers("events/at_s", "<f8", "s"),
            *(texts(f"events/{name}") for name in ("kind", "text", "data")),
            numbers("anchors/device_us", "<i8", "us"),
            numbers("anchors/host_s", "<f8", "s"),
            texts("anchors/utc"),
        ]


def item_values(item: Event | Anchor) -> Iterator[tuple[str, NDArray[Any]]]:
    """Return an event or an anchor as a row of each of its datasets: place and value, shape (1,)."""
    if isinstance(item, Event):
        yield f"{ENTRY}/events/at_s", np.array([item.at_s])
    else:
        yield f"{ENTRY}/anchors/device_us", np.array([item.device_us])
        yield f"{ENTRY}/anchors/host_s", np.array([item.host_s])
    for place, text in _texts_of(item):
        yield f"{ENTRY}/{place}", np.array([text])


def _texts_of(item: Event | Anchor) -> list[tuple[str, bytes]]:
    if isinstance(item, Event):
        data = canonical_json(dict(item.data))
        texts = {"events/kind": item.kind, "events/text": item.text, "events/data": data}
    else:
        texts = {"anchors/utc": item.utc}
    return [(place, text.encode()) for place, text in texts.items()]


class TreeWriter:
    """Writes the HDF5 tree of a run as its numbers come. Same content, same h5py and HDF5: same bytes.

    Parameters
    ----------
    file : TreeFile
        Where to.
    columns : sequence of Column
        Its datasets.

    Raises
    ------
    OSError
        If the disk has no room.
    """

    def __init__(self, file: TreeFile, columns: Sequence[DatasetColumn]) -> None:
        self._file = file
        chunks = sum(-(-column.shape[0] // column.chunk_rows) for column in columns)
        self._structure_bytes = _STRUCTURE_BYTES + _STRUCTURE_BYTES_PER_CHUNK * chunks
        file.reserve(self._structure_bytes)
        options = {"libver": (FILE_FORMAT, FILE_FORMAT), "userblock_size": USER_BLOCK_BYTES}
        self._tree = h5py.File(file, "w", **options)
        self._tree.attrs["NX_class"] = "NXroot"
        self._tree.attrs["default"] = ENTRY
        self._tree.create_group(ENTRY).attrs["NX_class"] = "NXentry"
        self._growing = {
            column.place: _GrowingDataset(self._tree, column, self._reserve) for column in columns
        }

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._tree.close()

    def append(self, place: str, values: NDArray[Any]) -> None:
        """Add the next rows of a dataset.

        Raises
        ------
        OSError
            If the disk has no room, or a write failed.
        ValueError
            If they are more than were announced.
        """
        self._growing[place].append(values)

    def finish(self, metadata: Mapping[str, Any], heads: Mapping[str, StreamHead]) -> None:
        """Add the metadata document, completed by the hashes of all datasets, and what NeXus wants.

        Raises
        ------
        OSError
            If the disk has no room, or a write failed.
        ValueError
            If a dataset got fewer rows than were announced.
        """
        document = {**metadata, "format": FORMAT, "format_version": FORMAT_VERSION}
        document["datasets"] = {place: growing.finish() for place, growing in self._growing.items()}
        document["content_sha256"] = content_hash_of(document)
        text = canonical_json(document)
        self._reserve(2 * len(text.encode()))
        self._tree.attrs["metadata"] = text
        entry = self._tree[ENTRY]
        present = [name for name in heads if name in entry]
        for name in present:
            _dress(entry[name], heads[name])
        if present:
            entry.attrs["default"] = present[0]
        for name in ("events", "anchors"):
            entry[name].attrs["NX_class"] = "NXcollection"

    def _reserve(self, coming: int) -> None:
        self._file.reserve(coming + self._structure_bytes)


class _GrowingDataset:
    """A dataset of known length, written chunk by chunk."""

    def __init__(self, tree: Any, column: DatasetColumn, reserve: Callable[[int], None]) -> None:
        self._column, self._reserve = column, reserve
        self._digest = hashlib.sha256()
        self._written = self._held = 0
        options: dict[str, Any] = {}
        if column.shape[0]:
            options = {"chunks": (column.chunk_rows, *column.shape[1:]), "fletcher32": True}
            if column.dtype.kind in "iuS":
                options |= {"shuffle": True, "compression": "gzip", "compression_opts": _GZIP_LEVEL}
        self._dataset = tree.create_dataset(
            column.place, shape=column.shape, dtype=column.dtype, track_times=False, **options
        )
        if column.units is not None:
            self._dataset.attrs["units"] = column.units
        self._chunk = np.zeros((column.chunk_rows, *column.shape[1:]), dtype=column.dtype)

    def append(self, values: NDArray[Any]) -> None:
        if self._written + self._held + len(values) > self._column.shape[0]:
            raise ValueError(f"{self._column.place} gets more rows than were announced")
        while len(values):
            taken = min(len(values), len(self._chunk) - self._held)
            self._chunk[self._held : self._held + taken] = values[:taken]
            self._held += taken
            values = values[taken:]
            if self._held == len(self._chunk):
                self._flush()

    def finish(self) -> dict[str, Any]:
        """Write what is left; return what the metadata document says of the dataset."""
        self._flush()
        if self._written != self._column.shape[0]:
            raise ValueError(f"{self._column.place} got fewer rows than were announced")
        return {
            "dtype": self._column.dtype.str,
            "rows": self._written,
            "units": self._column.units,
            "sha256": self._digest.hexdigest(),
        }

    def _flush(self) -> None:
        if not self._held:
            return
        rows = self._chunk[: self._held]
        self._digest.update(rows.data)
        self._reserve(self._chunk.nbytes + self._chunk.nbytes // 64 + 4096)  # gzip may make it larger
        self._dataset[self._written : self._written + self._held] = rows
        self._written += self._held
        self._held = 0


def _dress(group: Any, head: StreamHead) -> None:
    """Add what a NeXus reader needs to plot a stream."""
    group.attrs["NX_class"] = "NXdata"
    group.attrs["signal"] = head.channels[0].name
    time = "time_s" if "time_s" in group else "time_us"
    group.attrs["axes"] = time
    group.attrs[f"{time}_indices"] = 0
    if others := [channel.name for channel in head.channels[1:]]:
        group.attrs["auxiliary_signals"] = others


def user_block(path: Path) -> bytes:
    """Return the first 512 bytes that belong to a tree which lies on the disk behind them.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with path.open("rb") as stream:
        stream.seek(USER_BLOCK_BYTES)
        digest = _digest(stream)
    seal = (
        f"{FORMAT} {FORMAT_VERSION}\n"
        f"sha256 of all bytes after byte 512: {digest}\n"
        "check: tail -c +513 FILE | sha256sum\n"
    )
    return seal.encode().ljust(USER_BLOCK_BYTES, b"\0")


def stated_file_hash(block: bytes) -> str | None:
    """Return the hash that a user block states, None if there is none."""
    match = _SEAL.match(block)
    return match[1].decode() if match else None


def file_is_as_sealed(path: Path) -> bool:
    """Tell whether all bytes of a run file are those that were sealed. Needs no HDF5.

    Raises
    ------
    BadInput
        If the file cannot be read.
    """
    try:
        with path.open("rb") as stream:
            stated = stated_file_hash(stream.read(USER_BLOCK_BYTES))
            return stated is not None and stated == _digest(stream)
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path, remedy="check the path") from None


def _digest(stream: BinaryIO) -> str:
    digest = hashlib.sha256()
    while block := stream.read(1 << 20):
        digest.update(block)
    return digest.hexdigest()
