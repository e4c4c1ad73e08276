"""Do the datasets of a run file fit the document and each other? For whoever reads one beside another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import orjson

from bufferstand.foundation import BadInput
from bufferstand.recording.runfile.document_types import wrong_event
from bufferstand.recording.runfile.layout import ENTRY
from bufferstand.recording.runfile.metadata import StreamHead
from bufferstand.recording.runfile.reading_apart import RESTORE, DatasetReader

_STAMPS = {"time_us": ("i8", "us"), "time_s": ("f8", "s")}
_ITEMS = {
    "events": {"at_s": "f8", "kind": "S", "text": "S", "data": "S"},
    "anchors": {"device_us": "i8", "host_s": "f8", "utc": "S"},
}
_FARTHEST = 1 << 60
"""Of time stamps [µs], sequence numbers and lost samples: beyond it differences overflow."""
_LONGEST_S = 1e12


def check_columns(
    heads: Mapping[str, StreamHead], stated: Mapping[str, Mapping[str, Any]], reader: DatasetReader
) -> list[str]:
    """Return the streams that there are datasets of, if all that belongs together fits together.

    Parameters
    ----------
    heads : mapping of str to StreamHead
        The document's streams.
    stated : mapping
        What the document says of each dataset.
    reader : DatasetReader

    Raises
    ------
    BadInput
        If a dataset is missing, in a unit that is none, or of another type, shape or length than what it
        belongs to; if segments are none of the stream's rows; if what an event says is no table.
    """
    groups = {place.rpartition("/")[0] for place in stated}
    there = [name for name in heads if f"{ENTRY}/{name}" in groups]
    for name in there:
        _check_stream(heads[name], stated, reader)
    for group, kinds in _ITEMS.items():
        _check_items(group, kinds, reader)
    return there


def _check_stream(head: StreamHead, stated: Mapping[str, Mapping[str, Any]], reader: DatasetReader) -> None:
    group = f"{ENTRY}/{head.name}"
    time = "time_s" if reader.form(f"{group}/time_s") else "time_us"
    if all(reader.form(f"{group}/{name}") for name in _STAMPS):
        raise _wrong(reader, group, "has two times")
    kind, unit = _STAMPS[time]
    (rows,) = _form(reader, f"{group}/{time}", kind)
    for channel in head.channels:
        place = f"{group}/{channel.name}"
        if _form(reader, place, "iuf") != (rows,):
            raise _wrong(reader, place, f"has another length than its time stamps ({rows})")
        if not stated[place].get("units"):
            raise _wrong(reader, place, "the dataset has no unit")
    if stated[f"{group}/{time}"].get("units") != unit:
        found = stated[f"{group}/{time}"].get("units")
        what = f"time stamps are in “{found}” instead of “{unit}”" if found else "the dataset has no unit"
        raise _wrong(reader, f"{group}/{time}", what)
    _check_segments(f"{group}/segments", rows, reader)


def _check_segments(place: str, rows: int, reader: DatasetReader) -> None:
    if _form(reader, place, "i8", columns=3)[0] > max(rows, 1):
        raise _wrong(reader, place, f"there are more than the stream has rows ({rows})")
    segments = reader.column(place)
    first, lost = segments[:, 0], segments[:, 2]
    if not len(segments) and not rows:
        return
    fits = len(segments) and first[0] == 0 and np.all(first[1:] > first[:-1]) and first[-1] < max(rows, 1)
    if not fits or np.any(lost < 0) or np.any(np.abs(segments) > _FARTHEST):
        raise _wrong(reader, place, f"they are no segments of {rows} rows")


def _check_items(group: str, kinds: Mapping[str, str], reader: DatasetReader) -> None:
    places = {name: f"{ENTRY}/{group}/{name}" for name in kinds}
    lengths = {_form(reader, places[name], kind) for name, kind in kinds.items()}
    if len(lengths) > 1:
        raise _wrong(reader, f"{ENTRY}/{group}", "its datasets differ in length")
    for name, kind in kinds.items():
        values = reader.column(places[name])
        if kind == "S":
            _check_texts(places[name], values.tolist(), reader, data=name == "data")
        elif not np.all(np.abs(values) < (_FARTHEST if kind == "i8" else _LONGEST_S)):
            raise _wrong(reader, places[name], "holds what is no time")


def _check_texts(place: str, texts: Sequence[bytes], reader: DatasetReader, *, data: bool) -> None:
    for row, text in enumerate(texts):
        try:
            text.decode()
            wrong = wrong_event(orjson.loads(text)) if data else None
        except ValueError:
            wrong = "is no JSON" if data else "is no text"
        if wrong is not None:
            raise _wrong(reader, place, f"row {row} {wrong}")


def _form(reader: DatasetReader, place: str, kinds: str, columns: int | None = None) -> tuple[int, ...]:
    """Return the shape of a dataset that is there and of a type."""
    form = reader.form(place)
    if form is None:
        raise _wrong(reader, place, "the dataset is missing")
    dtype, shape = np.dtype(form[0]), form[1]
    right = dtype.str[1:] == kinds if kinds in ("i8", "f8") else dtype.kind in kinds
    if not right or shape[1:] != (() if columns is None else (columns,)):
        raise _wrong(reader, place, f"is of type {dtype.str} and shape {shape}: no run file has that here")
    return shape


def _wrong(reader: DatasetReader, place: str, what: str) -> BadInput:
    return BadInput(what, file=reader.path, place=place, remedy=RESTORE)
