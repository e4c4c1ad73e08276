"""Writes the copy of a run file, sealed anew, with every sample as it was."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import file_hash
from bufferstand.recording.content import Anchor, Event
from bufferstand.recording.runfile import (
    ENTRY,
    DatasetColumn,
    Run,
    StreamData,
    Widths,
    fitting_heads,
    item_values,
    open_run,
    read_metadata,
    segment_rows,
    stream_columns,
    write_columns,
)
from bufferstand.recording.withholding.machine_facts import RECORD_KEY, without_machine

_ROWS_AT_ONCE = 1_000_000


def copy_without_machine(path: Path, copy: Path) -> list[str]:
    """Write a run file anew, without what it says of the machine (docs/run-file.md, Copies for others).

    Samples, time stamps and clock anchors are those of the original, with the same hashes. The document
    says in ``withheld`` what was taken out, and the hashes of the original's bytes and content.

    Parameters
    ----------
    path : Path
        A run file.
    copy : Path
        The file to be.

    Returns
    -------
    list of str
        Keys that were taken out or changed; ``events`` where a text of an event was.

    Raises
    ------
    BadInput
        If it is no run file, or not whole and unaltered; or the copy cannot be written.
    """
    run = open_run(path)
    document, keys, cleaned = without_machine(run.metadata)
    events = [_event(event, cleaned) for event in run.recorded_events]
    if events != list(run.recorded_events):
        keys.append("events")
    document[RECORD_KEY] = {
        "keys": keys,
        "of_content_sha256": run.sha256,
        "of_file_sha256": file_hash(path),
    }
    items: list[Event | Anchor] = [*events, *run.anchors]
    held = {name: tuple(stream.channels) for name, stream in run.streams.items()}
    try:
        heads = fitting_heads(document, held, copy)
        write_columns(copy, document, heads, _columns(run, items), _values(run, items))
    except OSError as error:
        problem = f"the copy for others cannot be written: {error.strerror or error}"
        raise BadInput(problem, file=path, remedy="make room, or name another folder") from None
    _check_same_samples(run, copy)
    return keys


def _event(event: Event, cleaned: Callable[[str], str]) -> Event:
    return Event(event.at_s, event.kind, cleaned(event.text), _cleaned_data(dict(event.data), cleaned))


def _cleaned_data(value: Any, cleaned: Callable[[str], str]) -> Any:
    if isinstance(value, str):
        return cleaned(value)
    if isinstance(value, dict):
        return {key: _cleaned_data(inner, cleaned) for key, inner in value.items()}
    if isinstance(value, list):
        return [_cleaned_data(inner, cleaned) for inner in value]
    return value


def _columns(run: Run, items: list[Event | Anchor]) -> list[DatasetColumn]:
    widths = Widths()
    for item in items:
        widths.take(item)
    columns = widths.columns()
    facts: Mapping[str, Mapping[str, Any]] = run.metadata["datasets"]
    for name, stream in run.streams.items():
        of = {channel: facts[f"{ENTRY}/{name}/{channel}"] for channel in stream.channels}
        columns += stream_columns(
            name,
            stream.rows,
            np.dtype(facts[f"{ENTRY}/{name}/{stream.time_name}"]["dtype"]),
            {channel: np.dtype(fact["dtype"]) for channel, fact in of.items()},
            len(stream.segments),
            {channel: fact["units"] for channel, fact in of.items() if fact.get("units")},
        )
    return columns


def _values(run: Run, items: list[Event | Anchor]) -> Iterator[tuple[str, NDArray[Any]]]:
    for name, stream in run.streams.items():
        yield from _samples(f"{ENTRY}/{name}", stream)
        yield f"{ENTRY}/{name}/segments", segment_rows(stream.segments)
    for item in items:
        yield from item_values(item)


def _samples(place: str, stream: StreamData) -> Iterator[tuple[str, NDArray[Any]]]:
    for row in range(0, stream.rows, _ROWS_AT_ONCE):
        rows = slice(row, row + _ROWS_AT_ONCE)
        yield f"{place}/{stream.time_name}", stream.stamps(rows)
        for channel in stream.channels:
            yield f"{place}/{channel}", stream.counts.rows(channel, rows)


def _check_same_samples(run: Run, copy: Path) -> None:
    """Make sure that nothing but the document and texts of events differs.

    Raises
    ------
    BadInput
        If a dataset of samples has another hash than in the original.
    """
    written = read_metadata(copy)["datasets"]
    for place, facts in run.metadata["datasets"].items():
        if (
            not place.startswith(f"{ENTRY}/events/")
            and written.get(place, {}).get("sha256") != facts["sha256"]
        ):
            raise BadInput(
                "a copy without what it says of the machine would have other numbers",
                file=run.path,
                place=place,
                remedy="publish it as it was recorded (--as-recorded)",
            )
