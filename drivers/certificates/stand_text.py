"""Writing a calibration into a stand file, whose comments and order stay; or as lines to be pasted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import tomlkit

from bufferstand.drivers.certificates.channel_calibration import ChannelCalibration
from bufferstand.drivers.stand_file import load_any_stand
from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import Calibration, Quantity
from bufferstand.foundation.settings import read_text


def channel_of(stand: Path, name: str) -> tuple[Quantity, Calibration]:
    """Return what a channel of a stand file measures, and its calibration.

    Raises
    ------
    BadInput
        If the stand file cannot be used, or has no such channel.
    """
    channel = _channel(load_any_stand(stand).model_dump(), name, stand)
    quantity: Quantity = channel.get("quantity", "temperature")
    return quantity, Calibration.model_validate(channel["calibration"])


def changed_stand(stand: Path, name: str, before: Calibration, imported: ChannelCalibration) -> str:
    """Return a stand file's text with a channel's calibration and uncertainty changed; all else as it was.

    Parameters
    ----------
    stand : Path
    name : str
        Of the channel.
    before : Calibration
        Its calibration up to now: where the file leaves that to the device's own, it is written out.
    imported : ChannelCalibration

    Raises
    ------
    BadInput
        If the stand file has no such channel.
    """
    document = tomlkit.parse(read_text(stand))
    channel = _channel(document, name, stand)
    for key, values in (("calibration", imported.calibration), ("uncertainty", imported.uncertainty)):
        if key not in channel:
            channel[key] = tomlkit.inline_table()
        table = channel[key]
        if key == "calibration" and not before.table and "table" not in values:
            table.setdefault("coefficients", list(before.coefficients))
        for inner, value in values.items():
            if value is not None:
                table[inner] = _plain(value)
            elif inner in table:
                del table[inner]
    return tomlkit.dumps(document)


def fragment(imported: ChannelCalibration) -> str:
    """Return the two lines of a channel that a certificate gives, to be pasted into a stand file."""
    lines = []
    for key, values in (("calibration", imported.calibration), ("uncertainty", imported.uncertainty)):
        table = tomlkit.inline_table()
        table.update({inner: _plain(value) for inner, value in values.items() if value is not None})
        lines.append(f"{key} = {table.as_string()}\n")
    return "".join(lines)


def _plain(value: Any) -> Any:
    """Return a value as stand files have it: a table of pairs as arrays, a day as text."""
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return value.isoformat() if hasattr(value, "isoformat") else value


def _channel(document: Any, name: str, stand: Path) -> Any:
    found = list(_channels(document))
    for channel in found:
        if channel.get("name") == name:
            return channel
    names = ", ".join(str(channel["name"]) for channel in found)
    raise BadInput(f"it has no channel “{name}”", file=stand, remedy=f"name one of {names}")


def _channels(document: Any) -> Iterator[Any]:
    """Yield the tables that are channels or thermometers: they have a name, and what it measures or where."""
    if isinstance(document, Mapping):
        if "name" in document and ("quantity" in document or "role" in document or "rom" in document):
            yield document
        for inner in document.values():
            yield from _channels(inner)
    elif isinstance(document, list | tuple):
        for inner in document:
            yield from _channels(inner)
