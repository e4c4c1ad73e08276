"""Run files: writing one durably, opening one that can be trusted. The format is docs/run-file.md."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.recording.content import Anchor, Event, StreamContent
from bufferstand.recording.runfile.column_checks import check_columns
from bufferstand.recording.runfile.content_checks import ContentFault, stated_faults
from bufferstand.recording.runfile.document_format import (
    FORMAT,
    FORMAT_VERSION,
    check_format,
    is_unaltered,
)
from bufferstand.recording.runfile.hdf5_file import TreeFile
from bufferstand.recording.runfile.layout import (
    ENTRY,
    DatasetColumn,
    TreeWriter,
    Widths,
    file_is_as_sealed,
    item_values,
    segment_rows,
    stream_columns,
    user_block,
)
from bufferstand.recording.runfile.metadata import (
    StreamHead,
    check_document,
    check_new_document,
)
from bufferstand.recording.runfile.reading import document_text, open_tree, parsed_document
from bufferstand.recording.runfile.reading_apart import (
    RESTORE,
    DatasetReader,
    looked_into,
    stored_document,
)
from bufferstand.recording.runfile.run import Run, Series
from bufferstand.recording.runfile.stream import StreamData
from bufferstand.recording.runfile.structure import datasets_of
from bufferstand.recording.whole_files import give_final_name

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
        Unit of a channel's raw numbers where the document says none; ``count`` where neither does.

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
    held = {name: tuple(stream.counts) for name, stream in streams.items()}
    heads = fitting_heads(metadata, held, path)
    content = {name: streams[name] for name in heads if name in streams}
    widths = Widths()
    items: list[Event | Anchor] = [*events, *anchors]
    for item in items:
        widths.take(item)
    columns = widths.columns()
    for name, stream in content.items():
        dtypes = {channel: values.dtype for channel, values in stream.counts.items()}
        columns += stream_columns(
            name,
            stream.rows,
            stream.time.dtype,
            dtypes,
            len(stream.segments),
            {**heads[name].raw_units, **(raw_units or {})},
        )
    return write_columns(path, metadata, heads, columns, _values(content, items))


def write_columns(
    path: Path,
    metadata: Mapping[str, Any],
    heads: Mapping[str, StreamHead],
    columns: Sequence[DatasetColumn],
    values: Iterable[tuple[str, NDArray[Any]]],
) -> Path:
    """Write a run file of known datasets, whose numbers come bit by bit; otherwise as :func:`write_run`.

    Parameters
    ----------
    path, metadata
        As :func:`write_run`.
    heads : mapping of str to StreamHead
        The document's streams.
    columns : sequence of Column
        All datasets.
    values : iterable of (str, NDArray)
        Place of a dataset and its next rows, in any mixture.

    Raises
    ------
    BadInput
        By ``values``.
    OSError
        If it cannot be written, or not what was written can be read back.
    """
    temporary = path.with_suffix(TEMPORARY_SUFFIX)
    with TreeFile(temporary) as file:
        with TreeWriter(file, columns) as tree:
            for place, rows in values:
                tree.append(place, rows)
            tree.finish(metadata, heads)
        file.keep(user_block(temporary))
    if not file_is_as_sealed(temporary):
        raise OSError(f"{temporary}: what was written cannot be read back (its bytes differ)")
    if faults := _faults_of_own(temporary):
        raise OSError(f"{temporary}: what was written cannot be read back ({faults[0].text})")
    give_final_name(temporary, path)
    return path


def fitting_heads(
    metadata: Mapping[str, Any], held: Mapping[str, Sequence[str]], path: Path
) -> dict[str, StreamHead]:
    """Return the streams of a document that fits what is held.

    Parameters
    ----------
    metadata : mapping
        The metadata document.
    held : mapping of str to sequence of str
        The channels that there are numbers of, by stream.
    path : Path
        The run file to be, for the message.

    Raises
    ------
    BadInput
        If the document lacks something, or has other streams or channels than those held.
    """
    heads = check_new_document(metadata, path)
    if unknown := set(held) - set(heads):
        raise BadInput(f"streams without metadata: {', '.join(sorted(unknown))}", file=path)
    for name, channels in held.items():
        if list(channels) != [channel.name for channel in heads[name].channels]:
            raise BadInput(f"stream {name} holds {', '.join(channels)}", file=path, place=f"streams.{name}")
    return heads


def _values(
    streams: Mapping[str, StreamContent], items: Sequence[Event | Anchor]
) -> Iterator[tuple[str, NDArray[Any]]]:
    for name, stream in streams.items():
        place = f"{ENTRY}/{name}"
        yield f"{place}/{'time_s' if stream.time.dtype.kind == 'f' else 'time_us'}", stream.time
        for channel, values in stream.counts.items():
            yield f"{place}/{channel}", values
        yield f"{place}/segments", segment_rows(stream.segments)
    for item in items:
        yield from item_values(item)


def read_metadata(path: Path) -> dict[str, Any]:
    """Return the metadata document of a run file; quick, as the data are not looked at.

    Raises
    ------
    BadInput
        If it is no run file, of a newer format, or its document is altered or not of the types of the format.
    """
    document = metadata_as_stated(path)
    check_document(document, path)
    return document


def metadata_as_stated(path: Path) -> dict[str, Any]:
    """Return the metadata document as :func:`read_metadata`, whatever the types of its facts: for lists.

    Raises
    ------
    BadInput
        If it is no run file, of a newer format, or its document is altered.
    """
    document = parsed_document(stored_document(path), path)
    check_format(document, path)
    if not is_unaltered(document):
        raise BadInput("the metadata were altered", file=path, place="metadata", remedy=RESTORE)
    return document


def checked_content(path: Path) -> str | None:
    """Return the hash of the content of a run file that can be evaluated; None of one that cannot.

    Raises
    ------
    BadInput
        If it cannot be read, or is no run file.
    """
    seen = looked_into(path, numbers=False)
    return None if seen.faults else str(parsed_document(seen.text, path)["content_sha256"])


def content_faults(path: Path) -> list[ContentFault]:
    """Return all that is wrong with the content of a run file, whatever its bytes are.

    Raises
    ------
    BadInput
        If it cannot be opened, is no run file, or one of a newer format, or it holds what no run file does.
    """
    seen = looked_into(path)
    faults = [ContentFault("fault", place, what) for place, what in seen.faults]
    try:
        if not faults:
            _run(seen.reader, parsed_document(seen.text, path))
    except BadInput as error:
        faults.append(ContentFault("fault", error.place, error.problem))
    return faults


def open_run(path: Path) -> Run:
    """Open a run file for evaluation, after making sure that it is whole and unaltered.

    That is so if :func:`content_faults` finds nothing: the hashes of the metadata document and of every
    dataset are right, and it holds nothing else. Its bytes may be others than those that were sealed (it was
    repacked then).

    Raises
    ------
    BadInput
        If it is no run file, of a newer format, damaged, or a unit is missing or wrong.
    """
    seen = looked_into(path)
    for place, what in seen.faults:
        raise BadInput(what, file=path, place=place, remedy=RESTORE)
    return _run(seen.reader, parsed_document(seen.text, path))


def _faults_of_own(path: Path) -> list[ContentFault]:
    """Return what is wrong with the content of a file that this process has written itself, and just now."""
    with open_tree(path) as tree:
        text = document_text(tree, path)
        return stated_faults(datasets_of(tree, path), text, path)


def _run(reader: DatasetReader, document: dict[str, Any]) -> Run:
    heads = check_document(document, reader.path)
    facts: Mapping[str, Mapping[str, Any]] = document["datasets"]
    there = check_columns(heads, facts, reader)
    return Run(reader, document, {name: StreamData(reader, heads[name], facts) for name in there})
