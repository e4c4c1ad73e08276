"""Run files: writing one durably, opening one that can be trusted. The format is docs/run-file.md."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from foundation.errors import BadInput
from recording.content import Anchor, Event, StreamContent
from recording.durable import give_final_name, write_under_temporary_name
from recording.layout import (
    ENTRY,
    Column,
    anchor_columns,
    complete_document,
    event_columns,
    file_bytes,
    file_is_as_sealed,
    stream_columns,
)
from recording.metadata import FORMAT, FORMAT_VERSION, check_document, check_format, is_unaltered
from recording.reading import RESTORE, open_tree, read_document
from recording.run import Columns, Run, Series, StreamData
from recording.verify import content_faults

__all__ = [
    "FORMAT",
    "FORMAT_VERSION",
    "Run",
    "Series",
    "StreamData",
    "open_run",
    "read_metadata",
    "write_run",
]

TEMPORARY_SUFFIX = ".h5.tmp"


def write_run(
    path: Path,
    metadata: Mapping[str, Any],
    streams: Mapping[str, StreamContent],
    events: Sequence[Event] = (),
    anchors: Sequence[Anchor] = (),
    *,
    raw_units: Mapping[str, str] | None = None,
) -> Path:
    """Write a run file: durably, under its final name only when it was read back and found right.

    Parameters
    ----------
    path : Path
        Final name; a file of that name is replaced.
    metadata : mapping
        The metadata document without ``datasets`` and ``content_sha256``, which are added.
    streams : mapping of str to StreamContent
        Samples of those streams of the document that delivered any.
    events, anchors : sequence
        What happened, and pairs of clock readings.
    raw_units : mapping of str to str, optional
        Unit of a channel's raw numbers, ``count`` where not given.

    Returns
    -------
    Path
        ``path``.

    Raises
    ------
    BadInput
        If the document lacks something or does not fit the streams.
    OSError
        If it cannot be written, or not what was written can be read back.
    """
    heads = check_document(metadata, path)
    columns: list[Column] = []
    for name, head in heads.items():
        if name not in streams:
            continue
        if list(streams[name].counts) != [channel.name for channel in head.channels]:
            raise BadInput(
                f"stream {name} holds {', '.join(streams[name].counts)}", file=path, place=f"streams.{name}"
            )
        columns += stream_columns(name, streams[name], raw_units or {})
    if unknown := set(streams) - set(heads):
        raise BadInput(f"streams without metadata: {', '.join(sorted(unknown))}", file=path)
    columns += [*event_columns(events), *anchor_columns(anchors)]
    document = complete_document(metadata, columns)
    temporary = path.with_suffix(TEMPORARY_SUFFIX)
    write_under_temporary_name(temporary, file_bytes(document, columns, heads))
    if not file_is_as_sealed(temporary) or (faults := content_faults(temporary)):
        detail = faults[0].text if file_is_as_sealed(temporary) else "its bytes differ"
        raise OSError(f"{temporary}: what was written cannot be read back ({detail})")
    give_final_name(temporary, path)
    return path


def read_metadata(path: Path) -> dict[str, Any]:
    """Return the metadata document of a run file; quick, as the data are not looked at.

    Raises
    ------
    BadInput
        If it is no run file, of a newer format, or its document is altered.
    """
    with open_tree(path) as tree:
        document = read_document(tree, path)
    check_format(document, path)
    if not is_unaltered(document):
        raise BadInput("the metadata were altered", file=path, place="metadata", remedy=RESTORE)
    return document


def open_run(path: Path) -> Run:
    """Open a run file for evaluation, after making sure that it is whole and unaltered.

    That is so if all its bytes are those that were sealed, or, for a file that was repacked, if the hashes
    of the metadata document and of every dataset are right.

    Raises
    ------
    BadInput
        If it is no run file, of a newer format, damaged, or a unit is missing or wrong.
    """
    whole = path.is_file() and file_is_as_sealed(path)
    document = read_metadata(path)
    if not whole and (faults := content_faults(path)):
        raise BadInput(faults[0].text, file=path, place=faults[0].place, remedy=RESTORE)
    heads = check_document(document, path)
    facts: Mapping[str, Mapping[str, Any]] = document["datasets"]
    streams = {
        name: StreamData(path, head, facts)
        for name, head in heads.items()
        if f"{ENTRY}/{name}/segments" in facts
    }
    for stream in streams.values():
        _check_datasets(stream, facts, path)
    anchors = [
        Anchor(device_us, host_s, utc.decode())
        for device_us, host_s, utc in _rows(path, facts, "anchors", ("device_us", "host_s", "utc"))
    ]
    events = [
        Event(at_s, kind.decode(), text.decode(), json.loads(data))
        for at_s, kind, text, data in _rows(path, facts, "events", ("at_s", "kind", "text", "data"))
    ]
    return Run(path, document, streams, anchors, events)


def _rows(
    path: Path, facts: Mapping[str, Any], group: str, names: Sequence[str]
) -> Iterator[tuple[Any, ...]]:
    columns = Columns(path, {name: f"{ENTRY}/{group}/{name}" for name in names}, facts)
    return zip(*(columns[name].tolist() for name in names), strict=True)


def _check_datasets(stream: StreamData, facts: Mapping[str, Any], path: Path) -> None:
    """Refuse a stream whose document names no dataset, or one in a unit that is none."""
    for wanted in (*stream.channels, stream.time_name):
        place = f"{ENTRY}/{stream.name}/{wanted}"
        if place not in facts:
            raise BadInput("the dataset is missing", file=path, place=place, remedy=RESTORE)
        if not facts[place].get("units"):
            raise BadInput("the dataset has no unit", file=path, place=place, remedy=RESTORE)
    place = f"{ENTRY}/{stream.name}/{stream.time_name}"
    unit = "s" if stream.time_name == "time_s" else "us"
    if facts[place]["units"] != unit:
        raise BadInput(
            f"time stamps are in “{facts[place]['units']}” instead of “{unit}”", file=path, place=place
        )
