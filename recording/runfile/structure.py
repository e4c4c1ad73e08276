"""The gate behind which a run file's numbers lie: HDF5 can do more than a run file may.

A data set may keep its numbers in any other file (external storage, virtual data sets), a name may lead into
another file or to a name (links), a few stated bytes may stand for gigabytes. A seal says nothing against
that: whoever makes the file makes the seal. So what is not of the format is refused before a number is read,
in files of whatever origin (docs/run-file.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from bufferstand.foundation import BadInput

RESTORE = "restore the file from a copy"
STRANGE = "do not evaluate it; have it exported anew where it was recorded"
MOST_DOCUMENT_BYTES = 64 << 20
"""Of the metadata document; that of a campaign of days has some 100 kB."""
MOST_CHUNK_BYTES = 64 << 20
"""Of what is decoded at once; our own chunks have 8 MiB, or one row."""
MOST_OBJECTS = 20_000
_DEPTH = 3
"""``entry/STREAM/CHANNEL``."""
_GZIP_GAIN = 1_100
"""Deflate gives back at most 1032 bytes for one (zlib's technical notes); and a little for small ones."""
_SMALL_BYTES = 4096
"""So much a data set may state in any case: a chunk is at least some bytes long."""
_FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}
_LAYOUTS = {h5py.h5d.COMPACT, h5py.h5d.CONTIGUOUS, h5py.h5d.CHUNKED}
_UNIT_BYTES = 256


@dataclass(frozen=True)
class StoredDataset:
    """A dataset that is one of a run file."""

    id: h5py.h5d.DatasetID
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    chunk_rows: int | None
    """Rows that are packed together; None where they lie in one piece."""

    @property
    def row_bytes(self) -> int:
        """Bytes of a row in memory."""
        return self.dtype.itemsize * (self.shape[1] if len(self.shape) > 1 else 1)

    @property
    def nbytes(self) -> int:
        """Bytes of all rows in memory."""
        return self.shape[0] * self.row_bytes

    def units(self) -> str | None:
        """Return the unit that it states; None where it states none."""
        return text_attribute(self.id, b"units", _UNIT_BYTES)


def datasets_of(tree: Any, path: Path) -> dict[str, StoredDataset]:
    """Return all datasets of an open file by their place, if it holds nothing that a run file may not.

    Raises
    ------
    BadInput
        If it does: a link other than a plain name, a second name of one object, a dataset whose numbers lie
        elsewhere, of another type or shape than those of the format, or one that states more than it has.
    """
    found: dict[str, StoredDataset] = {}
    stored = 0
    for place, dataset in _below(tree.id, "", {h5py.h5o.get_info(tree.id).addr}, path):
        found[place], taken = _checked(dataset, path, place)
        stored += taken
    if stored > path.stat().st_size:
        raise BadInput(
            "its datasets overlap: they take more bytes than the file has", file=path, remedy=STRANGE
        )
    return found


def _below(
    group: h5py.h5g.GroupID, prefix: str, seen: set[int], path: Path
) -> Iterator[tuple[str, h5py.h5d.DatasetID]]:
    links = group.links
    for name in group:
        place = f"{prefix}{name.decode(errors='replace')}"
        kind = links.get_info(name).type
        if kind != h5py.h5l.TYPE_HARD:
            what = {h5py.h5l.TYPE_SOFT: "a soft link", h5py.h5l.TYPE_EXTERNAL: "a link into another file"}
            raise _strange(f"is {what.get(kind, 'a link of an unknown kind')}", path, place)
        facts = h5py.h5o.get_info(group, name)
        if facts.addr in seen:
            raise _strange("is a second name of another object", path, place)
        seen.add(facts.addr)
        if len(seen) > MOST_OBJECTS:
            raise _strange(f"the file holds more than {MOST_OBJECTS} objects", path, place)
        if facts.type == h5py.h5o.TYPE_DATASET:
            yield place, h5py.h5d.open(group, name)
        elif facts.type != h5py.h5o.TYPE_GROUP:
            raise _strange("is neither a group nor a dataset", path, place)
        elif place.count("/") + 1 >= _DEPTH:
            raise _strange("is a group where only datasets may be", path, place)
        else:
            yield from _below(h5py.h5g.open(group, name), f"{place}/", seen, path)


def _checked(dataset: h5py.h5d.DatasetID, path: Path, place: str) -> tuple[StoredDataset, int]:
    """Return a dataset, if it is one of a run file, and how many bytes of the file it takes."""
    plist = dataset.get_create_plist()
    layout = plist.get_layout()
    if layout not in _LAYOUTS:
        raise _strange("is a virtual dataset: its numbers lie elsewhere", path, place)
    if plist.get_external_count():
        raise _strange("has external storage: its numbers lie in another file", path, place)
    filters = {plist.get_filter(number)[0] for number in range(plist.get_nfilters())}
    if filters - _FILTERS:
        numbers = ", ".join(str(number) for number in sorted(filters - _FILTERS))
        raise _strange(
            f"is packed by another filter than gzip, shuffle or Fletcher-32 ({numbers})", path, place
        )
    dtype, shape = dataset.dtype, dataset.shape
    if not _is_of_the_format(dtype):
        raise _strange("holds neither numbers nor texts of fixed length", path, place)
    if not shape or len(shape) > 2 or (len(shape) == 2 and shape[1] > 3):
        raise _strange(f"has the shape {shape}: it is no column", path, place)
    chunk = plist.get_chunk() if layout == h5py.h5d.CHUNKED else None
    checked = StoredDataset(dataset, dtype, shape, chunk and chunk[0])
    at_once = dtype.itemsize * prod(chunk) if chunk else checked.row_bytes
    if at_once > MOST_CHUNK_BYTES:
        raise _strange(f"wants {at_once} bytes at once", path, place)
    stored = int(dataset.get_storage_size())
    gain = _GZIP_GAIN if h5py.h5z.FILTER_DEFLATE in filters else 1
    if checked.nbytes > max(gain * stored, _SMALL_BYTES if stored else 0):
        raise _strange(f"states {shape[0]} rows, and holds {stored} bytes: too few for them", path, place)
    return checked, stored


def _is_of_the_format(dtype: np.dtype[Any]) -> bool:
    if dtype.kind in "iu":
        return h5py.check_enum_dtype(dtype) is None
    return dtype.kind == "S" or (dtype.kind == "f" and dtype.itemsize in (4, 8))


def text_attribute(item: Any, name: bytes, most_bytes: int) -> str | None:
    """Return a text that is an attribute of an object; None where it has none of that name, or no text.

    Parameters
    ----------
    item : object id of h5py
    name : bytes
    most_bytes : int
        A longer one is none of ours and is not read.
    """
    if not h5py.h5a.exists(item, name):
        return None
    attribute = h5py.h5a.open(item, name)
    dtype = attribute.dtype
    one = prod(attribute.shape or ()) == 1
    if not one or h5py.check_string_dtype(dtype) is None or attribute.get_storage_size() > most_bytes:
        return None
    value = np.empty(attribute.shape, dtype=dtype)
    attribute.read(value)
    text = value.reshape(-1)[0]
    if isinstance(text, bytes):
        text = text.decode("utf-8", "surrogateescape")
    return text if isinstance(text, str) and len(text) <= most_bytes else None


def _strange(what: str, path: Path, place: str) -> BadInput:
    return BadInput(f"{what}; a run file has none such", file=path, place=place, remedy=STRANGE)
