"""Assigns columns to channels and units: by exact names or by the user's options, never by guessing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from bufferstand.foundation import FACTORS, BadInput, conversion
from bufferstand.foundation.channels import STROKE_CHANNELS, ChannelUncertainty
from bufferstand.recording.foreign.record import ForeignRecord, Header

REQUIRED = ("stroke_1", "force")
PLAIN_NAMES = ("time", *STROKE_CHANNELS, "force", "speed")
DATE_TIME = "date-time"
"""In place of the time's unit: its cells are dates and times."""
NAMES_SHOWN = "time, stroke, stroke_1 … stroke_4, force, speed, temperature, temperature_1 …"
"""The names of channels, as messages list them."""
_SHORT = {"stroke": "stroke_1", "temperature": "temperature_1"}
_HEADER = re.compile(r"(?P<name>.*?)\s*(\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))\s*", re.DOTALL)
_TEMPERATURE = re.compile(r"temperature_[1-9]\d*")
_UNIT_SPELLINGS = {
    **dict.fromkeys(("ºC", "℃", "° C", "deg C", "Deg C", "DegC", "Celsius"), "°C"),
    **dict.fromkeys(("ºF", "℉", "° F", "deg F", "Deg F", "degF", "DegF", "Fahrenheit"), "°F"),
    **dict.fromkeys(("sec", "Sec", "second", "seconds", "Seconds"), "s"),
    **dict.fromkeys(("msec", "milliseconds"), "ms"),
    **dict.fromkeys(("inch", "inches"), "in"),
    **dict.fromkeys(("kips", "KIP"), "kip"),
    **dict.fromkeys(("KN", "kn"), "kN"),
    "MM": "mm",
}
"""Other ways to write a unit; nothing here changes what it means."""


@dataclass(frozen=True)
class ChannelRequest:
    """What the user says of one channel, and where each was said (for messages).

    ``header`` or ``number`` (from 1) tell the column; ``value = offset + scale · number`` in ``unit``.
    """

    header: str | None = None
    number: int | None = None
    header_said: str = ""
    unit: str | None = None
    unit_said: str = ""
    inverted: bool = False
    invert_said: str = ""
    scale: float = 1.0
    offset: float = 0.0
    raw_unit: str | None = None
    optional: bool = False
    facts: Mapping[str, Any] = field(default_factory=dict)
    """Calibration, delay and uncertainty of the channel, as far as they are stated."""


@dataclass(frozen=True)
class MappedColumn:
    """A column that is used: ``value = (offset + factor · number) · sign`` in the inside unit."""

    name: str
    quantity: str
    header: Header
    position: int
    unit: str
    unit_from: str
    raw_unit: str
    factor: float
    offset: float
    inverted: bool
    channel_facts: Mapping[str, Any]

    @property
    def coefficients(self) -> tuple[float, float]:
        """Get the calibration that takes the record's numbers to the inside unit, sign included."""
        sign = -1.0 if self.inverted else 1.0
        return (sign * self.offset + 0.0, sign * self.factor)  # + 0.0: no negative zero

    def facts(self) -> dict[str, Any]:
        """Return what was decided, for the run file."""
        facts = {
            "header": self.header.text,
            "position": self.position + 1,
            "unit": self.unit,
            "unit_from": self.unit_from,
            "inverted": self.inverted,
        }
        return facts | ({"group": self.header.group} if self.header.group else {})


def full_name(name: str) -> str | None:
    """Return the channel that a name means, in lower case; None if it means none."""
    lowered = name.strip().lower()
    lowered = _SHORT.get(lowered, lowered)
    return lowered if lowered in PLAIN_NAMES or _TEMPERATURE.fullmatch(lowered) else None


def channel_name(name: str, said: str) -> str:
    """Return the channel that a user's name means.

    Raises
    ------
    BadInput
        If it means none; ``said`` names where it was said.
    """
    full = full_name(name)
    if full is None:
        raise BadInput(f"{said}: “{name}” is no name of a channel", remedy=f"use one of {NAMES_SHOWN}")
    return full


def spelled(unit: str) -> str:
    """Return a unit as it is written here."""
    return _UNIT_SPELLINGS.get(unit.strip(), unit.strip())


def split_header(header: str) -> tuple[str, str | None]:
    """Return name and unit of a header like ``stroke [mm]`` or ``Force (kN)``; unit None if there is none."""
    match = _HEADER.fullmatch(header)
    if match is None:
        return header.strip(), None
    unit = match["square"] if match["square"] is not None else match["round"]
    return match["name"].strip(), spelled(unit) or None


def map_columns(record: ForeignRecord, wishes: Mapping[str, ChannelRequest]) -> list[MappedColumn]:
    """Return the columns that are used, the time first.

    Parameters
    ----------
    record : ForeignRecord
        Its headers, and its places for messages.
    wishes : mapping of str to Wish
        What the user says, by channel; it goes before what the headers say.

    Raises
    ------
    BadInput
        If what the user names is not there, two columns mean the same, stroke or force is missing, or a
        unit is missing or not understood.
    """
    positions = _positions(record, wishes)
    for name, wish in wishes.items():
        said = wish.unit_said or wish.invert_said
        if name not in positions and said and not wish.optional:
            raise BadInput(
                f"{said}: the record has no such column",
                file=record.path,
                place=record.header_place,
                remedy=f"columns that were recognised: {', '.join(positions) or 'none'}",
            )
    missing = [name for name in REQUIRED if name not in positions]
    if missing:
        short = "stroke" if missing[0] == "stroke_1" else missing[0]
        raise BadInput(
            f"no column is named “{short}”",
            file=record.path,
            place=record.header_place,
            remedy=f"say which it is with --column {short}=HEADER; the headers are {quoted(record.headers)}",
        )
    if wishes.get("time", ChannelRequest()).inverted:
        raise BadInput("--invert time: time runs forward only", file=record.path)
    ordered = sorted(positions.items(), key=_order)
    return [_column(name, position, wishes.get(name, ChannelRequest()), record) for name, position in ordered]


def _order(item: tuple[str, int]) -> tuple[int, int]:
    name = item[0]
    if name in PLAIN_NAMES:
        return PLAIN_NAMES.index(name), 0
    return len(PLAIN_NAMES), int(name.removeprefix("temperature_"))


def _positions(record: ForeignRecord, wishes: Mapping[str, ChannelRequest]) -> dict[str, int]:
    positions: dict[str, int] = {}
    for name, wish in wishes.items():
        if wish.header is not None or wish.number is not None:
            position = _find(wish, record)
            if position is not None:
                positions[name] = position
    for name, position in positions.items():
        for other in (n for n, p in positions.items() if p == position and n != name):
            raise BadInput(
                f"{wishes[name].header_said} and {wishes[other].header_said}: one header is given two names",
                file=record.path,
                place=record.where(position),
            )
    taken = set(positions.values())
    by_wish = set(positions)
    for position, header in enumerate(record.headers):
        matched = full_name(split_header(header.text)[0])
        if matched is None or position in taken or matched in by_wish:
            continue
        if matched in positions:
            raise BadInput(
                f"two columns mean “{matched}”: {quoted([record.headers[positions[matched]], header])}",
                file=record.path,
                place=record.header_place,
                remedy=f"say which it is with --column {matched}=HEADER (if they are equal, by number in a "
                "mapping file)" + (", or read one group with --group NAME" if header.group else ""),
            )
        positions[matched] = position
    return positions


def _find(wish: ChannelRequest, record: ForeignRecord) -> int | None:
    """Return the position of a column that the user names; None if it is not there and need not be."""
    headers = record.headers
    if wish.number is not None:
        if wish.number <= len(headers):
            return wish.number - 1
        if wish.optional:
            return None
        raise BadInput(
            f"{wish.header_said}: the record has {len(headers)} columns only",
            file=record.path,
            place=record.header_place,
        )
    found = _matching(str(wish.header), headers)
    if len(found) == 1:
        return found[0]
    if found:
        full = {headers[position].full for position in found}
        by_name = f"say which: {', '.join(sorted(full))}"
        remedy = by_name if len(full) == len(found) else "say which by number, in a mapping file"
        raise BadInput(
            f"{wish.header_said}: {len(found)} headers are “{wish.header}”",
            file=record.path,
            place=record.header_place,
            remedy=remedy,
        )
    if wish.optional:
        return None
    raise BadInput(
        f"{wish.header_said}: no header is “{wish.header}”",
        file=record.path,
        place=record.header_place,
        remedy=f"the headers are {quoted(headers)}",
    )


def _matching(wanted: str, headers: Sequence[Header]) -> list[int]:
    """Return the headers that are a text: as it stands, else by letters alone, else without their units."""
    text = wanted.strip()
    exact = [i for i, header in enumerate(headers) if text in (header.text, header.full)]
    if exact:
        return exact
    text = text.lower()
    alike = [i for i, header in enumerate(headers) if text in (header.text.lower(), header.full.lower())]
    return alike or [
        i
        for i, header in enumerate(headers)
        if text in (split_header(header.text)[0].lower(), split_header(header.full)[0].lower())
    ]


def _column(name: str, position: int, wish: ChannelRequest, record: ForeignRecord) -> MappedColumn:
    header = record.headers[position]
    quantity = name.split("_", maxsplit=1)[0]
    if wish.unit is not None:
        used, unit_from = wish.unit, "option" if wish.unit_said.startswith("-") else "mapping"
    else:
        used, unit_from = _stated_unit(name, quantity, header, record.where(position), record)
    if not used.strip():
        raise BadInput(
            "this column has no unit",
            file=record.path,
            place=record.where(position),
            remedy=f"write it into the header (“{header.text} [{_example(quantity)}]”) "
            f"or say --unit {name}=…",
        )
    unit = spelled(used)
    if quantity == "time" and unit == DATE_TIME:
        factor, offset = 1.0, 0.0
    else:
        try:
            factor, offset = conversion(quantity, unit)
        except BadInput as error:
            raise BadInput(
                error.problem, file=record.path, place=record.where(position), remedy=error.remedy
            ) from None
    scaled = (wish.scale, wish.offset) != (1.0, 0.0)
    if unit == DATE_TIME and scaled:
        raise BadInput(
            "dates and times cannot be scaled",
            file=record.path,
            place=record.where(position),
            remedy="leave out scale and offset",
        )
    return MappedColumn(
        name=name,
        quantity=quantity,
        header=header,
        position=position,
        unit=unit,
        unit_from=unit_from,
        raw_unit=wish.raw_unit or ("count" if scaled else unit),
        factor=factor * wish.scale,
        offset=factor * wish.offset + offset,
        inverted=wish.inverted,
        channel_facts=_inside(wish.facts, factor),
    )


def _stated_unit(
    name: str, quantity: str, header: Header, place: str, record: ForeignRecord
) -> tuple[str, str]:
    """Return the unit that the record states, and where: in the header, or apart from it.

    Raises
    ------
    BadInput
        If it states two that differ.
    """
    in_header = split_header(header.text)[1]
    apart = spelled(header.unit)
    known = FACTORS[quantity]
    if in_header is None or (in_header not in known and apart in known):  # “force (max)”
        return header.unit, header.unit_from
    if apart in known and known[apart] != known[in_header]:
        raise BadInput(
            f"two units are stated: {in_header} in the header, {apart} as {header.unit_from}",
            file=record.path,
            place=place,
            remedy=f"say which it is with --unit {name}=…",
        )
    return in_header, "header"


def _inside(facts: Mapping[str, Any], factor: float) -> Mapping[str, Any]:
    """Return what is stated of a channel with its limits, stated in the column's unit, in the inside unit."""
    uncertainty = facts.get("uncertainty")
    if not isinstance(uncertainty, ChannelUncertainty):
        return facts
    limits = {"zero": uncertainty.zero, "linearity": uncertainty.linearity}
    scaled = {key: value * factor for key, value in limits.items() if value is not None}
    return {**facts, "uncertainty": uncertainty.model_copy(update=scaled)}


def _example(quantity: str) -> str:
    return {"time": "s", "stroke": "mm", "force": "kN", "speed": "mm/s"}.get(quantity, "°C")


def quoted(headers: Iterable[Header]) -> str:
    """Return headers as a list for a message; of very many, the first ones."""
    texts = [f"“{header.full}”" for header in headers]
    shown = texts[:_MOST_SHOWN]
    return ", ".join(shown) + (f" and {len(texts) - len(shown)} more" if len(texts) > len(shown) else "")


_MOST_SHOWN = 30
