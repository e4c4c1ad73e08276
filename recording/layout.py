"""The run file's bytes: an HDF5 tree behind a 512-byte user block that carries the hash of all the rest.

The tree is built in memory and written as ordinary bytes. HDF5 itself never writes to the disk: on a full
disk it takes the whole process down when a file is closed (h5py issue 914).
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from numpy.typing import NDArray

from foundation.canonical import canonical_json
from foundation.errors import BadInput
from recording.content import Anchor, Event, StreamContent
from recording.metadata import FORMAT, FORMAT_VERSION, StreamHead, content_hash_of

USER_BLOCK_BYTES = 512
CHUNK_ROWS = 131_072
ENTRY = "entry"
_IMAGE_STEP = 1 << 22
_GZIP_LEVEL = 4
_SEAL = re.compile(rb"^bufferstand/run \d+\nsha256 of all bytes after byte 512: ([0-9a-f]{64})\n")


@dataclass(frozen=True)
class Column:
    """A dataset to be: its place, its numbers and the unit of the numbers as they are stored."""

    place: str
    values: NDArray[Any]
    units: str | None

    def facts(self) -> dict[str, Any]:
        """Return what the metadata document says of it: dtype, shape, unit, SHA-256 of its bytes."""
        return {
            "dtype": self.values.dtype.str,
            "rows": len(self.values),
            "units": self.units,
            "sha256": sha256_of(self.values),
        }


def sha256_of(values: NDArray[Any]) -> str:
    """Return the SHA-256 (hex) of an array's bytes in the order and byte order in which they are stored."""
    return hashlib.sha256(np.ascontiguousarray(values).data).hexdigest()


def stream_columns(name: str, stream: StreamContent, raw_units: Mapping[str, str]) -> list[Column]:
    """Return the datasets of a stream: time, channels as delivered, segments."""
    place = f"{ENTRY}/{name}"
    imported = stream.time.dtype.kind == "f"
    time = (
        Column(f"{place}/time_s", stream.time.astype("<f8"), "s")
        if imported
        else (Column(f"{place}/time_us", stream.time.astype("<i8"), "us"))
    )
    channels = [
        Column(
            f"{place}/{channel}",
            values.astype(values.dtype.newbyteorder("<"), copy=False),
            raw_units.get(channel, "count"),
        )
        for channel, values in stream.counts.items()
    ]
    rows = [(s.first_row, s.first_sequence, s.lost) for s in stream.segments]
    segments = np.array(rows, dtype="<i8").reshape(-1, 3)
    return [time, *channels, Column(f"{place}/segments", segments, None)]


def event_columns(events: Sequence[Event]) -> list[Column]:
    """Return the datasets of the events, in the order in which they were recorded."""
    return [
        Column(f"{ENTRY}/events/at_s", np.array([e.at_s for e in events], dtype="<f8"), "s"),
        Column(f"{ENTRY}/events/kind", _texts([e.kind for e in events]), None),
        Column(f"{ENTRY}/events/text", _texts([e.text for e in events]), None),
        Column(f"{ENTRY}/events/data", _texts([canonical_json(dict(e.data)) for e in events]), None),
    ]


def anchor_columns(anchors: Sequence[Anchor]) -> list[Column]:
    """Return the datasets of the clock anchors."""
    return [
        Column(f"{ENTRY}/anchors/device_us", np.array([a.device_us for a in anchors], dtype="<i8"), "us"),
        Column(f"{ENTRY}/anchors/host_s", np.array([a.host_s for a in anchors], dtype="<f8"), "s"),
        Column(f"{ENTRY}/anchors/utc", _texts([a.utc for a in anchors]), None),
    ]


def _texts(texts: Sequence[str]) -> NDArray[Any]:
    encoded = [text.encode() for text in texts]
    width = max([1, *map(len, encoded)])
    return np.array(encoded, dtype=h5py.string_dtype("utf-8", width))


def complete_document(metadata: Mapping[str, Any], columns: Sequence[Column]) -> dict[str, Any]:
    """Return the document with the hashes of all datasets, and the hash of itself that covers them."""
    document = {**metadata, "format": FORMAT, "format_version": FORMAT_VERSION}
    document["datasets"] = {column.place: column.facts() for column in columns}
    document["content_sha256"] = content_hash_of(document)
    return document


def file_bytes(
    document: Mapping[str, Any], columns: Sequence[Column], heads: Mapping[str, StreamHead]
) -> bytes:
    """Return the whole run file. Same content, same h5py and HDF5: same bytes."""
    options = {"libver": ("v110", "v110"), "userblock_size": USER_BLOCK_BYTES}
    with h5py.File("run", "w", driver="core", backing_store=False, block_size=_IMAGE_STEP, **options) as tree:
        tree.attrs["metadata"] = canonical_json(document)
        tree.attrs["NX_class"] = "NXroot"
        tree.attrs["default"] = ENTRY
        entry = tree.create_group(ENTRY)
        entry.attrs["NX_class"] = "NXentry"
        for column in columns:
            _write_column(tree, column)
        present = [name for name in heads if name in entry]
        for name in present:
            _dress(entry[name], heads[name])
        if present:
            entry.attrs["default"] = present[0]
        for name in ("events", "anchors"):
            entry[name].attrs["NX_class"] = "NXcollection"
        tree.flush()
        image: bytes = tree.id.get_file_image()
    seal = (
        f"{FORMAT} {FORMAT_VERSION}\n"
        f"sha256 of all bytes after byte 512: {hashlib.sha256(image).hexdigest()}\n"
        "check: tail -c +513 FILE | sha256sum\n"
    )
    return seal.encode().ljust(USER_BLOCK_BYTES, b"\0") + image


def _write_column(tree: Any, column: Column) -> None:
    rows = len(column.values)
    options: dict[str, Any] = {}
    if rows:
        chunk = min(rows, CHUNK_ROWS)
        options = {"chunks": (chunk, *column.values.shape[1:]), "fletcher32": True}
        if column.values.dtype.kind in "iuS":
            options |= {"shuffle": True, "compression": "gzip", "compression_opts": _GZIP_LEVEL}
    dataset = tree.create_dataset(column.place, data=column.values, track_times=False, **options)
    if column.units is not None:
        dataset.attrs["units"] = column.units


def _dress(group: Any, head: StreamHead) -> None:
    """Add what a NeXus reader needs to plot a stream."""
    group.attrs["NX_class"] = "NXdata"
    group.attrs["signal"] = head.channels[0].name
    group.attrs["axes"] = "time_s" if "time_s" in group else "time_us"


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
