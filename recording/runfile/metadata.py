"""The metadata document: checked before anything is recorded under it, and again when it is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import CHANNEL_UNITS, Channel
from bufferstand.foundation.files import canonical_json
from bufferstand.recording.runfile.document_format import check_format
from bufferstand.recording.runfile.document_types import wrong_fact

KINDS = ("static", "harmonic", "impact", "proof")
STATUSES = ("complete", "stopped", "failed", "recovered", "imported")
CLOCKS = ("device", "host")


@dataclass(frozen=True)
class StreamHead:
    """What the document says of one stream; ``rate_Hz`` is nominal, None where none is known.

    ``raw_units`` holds the unit in which a channel was delivered, where that is not counts.
    """

    name: str
    clock: str
    rate_Hz: float | None
    device: str
    channels: tuple[Channel, ...]
    raw_units: Mapping[str, str]


def check_document(document: Mapping[str, Any], file: Path) -> dict[str, StreamHead]:
    """Return the streams of a document that holds all that reading the run will need.

    Raises
    ------
    BadInput
        If a key is missing, a value cannot be, a unit is not the one its quantity is kept in, or two
        channels share a name.
    """
    check_format(document, file)
    run = document.get("run")
    if not isinstance(run, Mapping):
        raise BadInput("the table “run” is missing", file=file, place="metadata: run")
    for key, allowed in (("kind", KINDS), ("status", STATUSES)):
        if run.get(key) not in allowed:
            raise BadInput(
                f"{run.get(key)!r} is none of {', '.join(allowed)}", file=file, place=f"metadata: run.{key}"
            )
    if not isinstance(run.get("id"), str) or not run["id"]:
        raise BadInput("the run has no id", file=file, place="metadata: run.id")
    if wrong := wrong_fact(document):
        raise BadInput(wrong[1], file=file, place=f"metadata: {wrong[0]}")
    streams = document.get("streams")
    if not isinstance(streams, Mapping):
        raise BadInput("the table “streams” is missing", file=file, place="metadata: streams")
    heads = {name: _head(str(name), entry, file) for name, entry in streams.items()}
    _refuse_double_names(heads, file)
    return heads


def check_new_document(document: Mapping[str, Any], file: Path) -> dict[str, StreamHead]:
    """Return the streams of a document that can be written: one that :func:`check_document` accepts, as JSON.

    Raises
    ------
    BadInput
        As :func:`check_document`, or if something in it has no JSON form.
    """
    heads = check_document(document, file)
    try:
        canonical_json(document)
    except (ValueError, TypeError) as error:
        raise BadInput(f"cannot be written as JSON: {error}", file=file, place="metadata") from None
    return heads


def _head(name: str, entry: Any, file: Path) -> StreamHead:
    place = f"metadata: streams.{name}"
    if not isinstance(entry, Mapping) or entry.get("clock") not in CLOCKS:
        raise BadInput(f"the clock is none of {', '.join(CLOCKS)}", file=file, place=f"{place}.clock")
    rate = entry.get("rate_Hz")
    if rate is not None and (isinstance(rate, bool) or not isinstance(rate, int | float) or not rate > 0):
        raise BadInput(f"{rate!r} is no sample rate", file=file, place=f"{place}.rate_Hz")
    listed = entry.get("channels")
    if not isinstance(listed, list | tuple) or not listed:
        raise BadInput("no channels are listed", file=file, place=f"{place}.channels")
    channels = tuple(_channel(item, f"{place}.channels[{i}]", file) for i, item in enumerate(listed))
    device = str(entry.get("device", ""))
    raw_units = entry.get("raw_units", {})
    known = {channel.name for channel in channels}
    if not isinstance(raw_units, Mapping) or not all(
        channel in known and isinstance(unit, str) and unit for channel, unit in raw_units.items()
    ):
        raise BadInput(
            f"{raw_units!r} is no table of a unit for each of some channels",
            file=file,
            place=f"{place}.raw_units",
        )
    return StreamHead(
        name, entry["clock"], None if rate is None else float(rate), device, channels, raw_units
    )


def _channel(item: Any, place: str, file: Path) -> Channel:
    try:
        channel = Channel.model_validate(item)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise BadInput(f"{key}: {first['msg']}", file=file, place=place) from None
    units = CHANNEL_UNITS[channel.quantity]
    if channel.unit not in units:
        raise BadInput(
            f"channel {channel.name} is in “{channel.unit}”",
            file=file,
            place=place,
            remedy=f"a {channel.quantity} is kept in {' or '.join(units)}",
        )
    return channel


def _refuse_double_names(heads: Mapping[str, StreamHead], file: Path) -> None:
    owner: dict[str, str] = {}
    for head in heads.values():
        for channel in head.channels:
            if channel.name in owner:
                raise BadInput(
                    f"channel {channel.name} is in stream {owner[channel.name]} already",
                    file=file,
                    place=f"metadata: streams.{head.name}",
                )
            owner[channel.name] = head.name
