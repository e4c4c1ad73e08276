"""Which column is what, in which unit: by exact names or by what the user says, never by guessing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from foundation.errors import BadInput
from foundation.units import conversion

REQUIRED = ("stroke_1", "force")
PLAIN_NAMES = ("time", "stroke_1", "stroke_2", "force", "speed")
_NAMES_SHOWN = "time, stroke, stroke_1, stroke_2, force, speed, temperature, temperature_1 …"
_SHORT = {"stroke": "stroke_1", "temperature": "temperature_1"}
_HEADER = re.compile(r"(?P<name>.*?)\s*(\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))\s*")
_TEMPERATURE = re.compile(r"temperature_[1-9]\d*")
_UNIT_SPELLINGS = {"ºC": "°C", "℃": "°C", "ºF": "°F", "℉": "°F", "° C": "°C", "° F": "°F"}
"""Other characters for the same sign; nothing here changes what a unit means."""


@dataclass(frozen=True)
class ColumnOptions:
    """What the user says of the columns; names as in the contract (``stroke`` means ``stroke_1``)."""

    column: Mapping[str, str]
    unit: Mapping[str, str]
    invert: Sequence[str]


@dataclass(frozen=True)
class Column:
    """A column that is used: ``value = (offset + factor · number) · sign`` in the inside unit."""

    name: str
    quantity: str
    header: str
    position: int
    unit: str
    unit_from: str
    factor: float
    offset: float
    inverted: bool

    @property
    def coefficients(self) -> tuple[float, float]:
        """Get the calibration that takes the record's numbers to the inside unit, sign included."""
        sign = -1.0 if self.inverted else 1.0
        return (sign * self.offset + 0.0, sign * self.factor)  # + 0.0: no negative zero

    def facts(self) -> dict[str, Any]:
        """Return what was decided, for the run file."""
        return {
            "header": self.header,
            "position": self.position + 1,
            "unit": self.unit,
            "unit_from": self.unit_from,
            "inverted": self.inverted,
        }


def full_name(name: str) -> str | None:
    """Return the channel that a name means, in lower case; None if it means none."""
    lowered = name.strip().lower()
    lowered = _SHORT.get(lowered, lowered)
    return lowered if lowered in PLAIN_NAMES or _TEMPERATURE.fullmatch(lowered) else None


def split_header(header: str) -> tuple[str, str | None]:
    """Return name and unit of a header like ``stroke [mm]`` or ``Force (kN)``; unit None if there is none."""
    match = _HEADER.fullmatch(header)
    if match is None:
        return header.strip(), None
    unit = (match["square"] if match["square"] is not None else match["round"]).strip()
    return match["name"].strip(), _UNIT_SPELLINGS.get(unit, unit) or None


def map_columns(headers: Sequence[str], options: ColumnOptions, file: Path, place: str) -> list[Column]:
    """Return the columns that are used, the time first.

    Parameters
    ----------
    headers : sequence of str
        The header row.
    options : ColumnOptions
        What the user says; it goes before what the headers say.
    file, place : Path, str
        The record and where its header row stands, for messages.

    Raises
    ------
    BadInput
        If an option names what is not there, two columns mean the same, stroke or force is missing, or a
        unit is missing or not understood.
    """
    positions = _positions(headers, options.column, file, place)
    for option, names in (("--unit", options.unit), ("--invert", options.invert)):
        for name in names:
            if _option_name(name, option) not in positions:
                raise BadInput(
                    f"{option} {name}: the record has no such column",
                    file=file,
                    place=place,
                    remedy=f"columns that were recognised: {', '.join(positions) or 'none'}",
                )
    missing = [name for name in REQUIRED if name not in positions]
    if missing:
        short = "stroke" if missing[0] == "stroke_1" else missing[0]
        raise BadInput(
            f"no column is named “{short}”",
            file=file,
            place=place,
            remedy=f"say which it is with --column {short}=HEADER; the headers are {_quoted(headers)}",
        )
    units = {_option_name(name, "--unit"): unit for name, unit in options.unit.items()}
    inverted = {_option_name(name, "--invert") for name in options.invert}
    if "time" in inverted:
        raise BadInput("--invert time: time runs forward only", file=file)
    return [
        _column(name, headers[position], position, units.get(name), name in inverted, file, place)
        for name, position in sorted(positions.items(), key=_order)
    ]


def _order(item: tuple[str, int]) -> tuple[int, int]:
    name = item[0]
    if name in PLAIN_NAMES:
        return PLAIN_NAMES.index(name), 0
    return len(PLAIN_NAMES), int(name.removeprefix("temperature_"))


def _option_name(name: str, option: str) -> str:
    full = full_name(name)
    if full is None:
        raise BadInput(f"{option}: “{name}” is no name of a channel", remedy=f"use one of {_NAMES_SHOWN}")
    return full


def _positions(headers: Sequence[str], given: Mapping[str, str], file: Path, place: str) -> dict[str, int]:
    positions: dict[str, int] = {}
    for name, header in given.items():
        full = _option_name(name, "--column")
        if full in positions:
            raise BadInput(f"--column: “{name}” is given twice", file=file)
        positions[full] = _find(header, headers, name, file, place)
    if len(set(positions.values())) < len(positions):
        raise BadInput("--column: one header is given two names", file=file, place=place)
    taken = set(positions.values())
    by_option = set(positions)
    for position, header in enumerate(headers):
        matched = full_name(split_header(header)[0])
        if matched is None or position in taken or matched in by_option:
            continue
        if matched in positions:
            raise BadInput(
                f"two columns mean “{matched}”: {_quoted([headers[positions[matched]], header])}",
                file=file,
                place=place,
                remedy=f"say which it is with --column {matched}=HEADER",
            )
        positions[matched] = position
    return positions


def _find(wanted: str, headers: Sequence[str], name: str, file: Path, place: str) -> int:
    """Return the position of a header: as it stands, else without regard to case, else without its unit."""
    rules = (
        lambda header: header == wanted.strip(),
        lambda header: header.lower() == wanted.strip().lower(),
        lambda header: split_header(header)[0].lower() == wanted.strip().lower(),
    )
    for rule in rules:
        found = [position for position, header in enumerate(headers) if rule(header)]
        if len(found) == 1:
            return found[0]
        if found:
            raise BadInput(f"--column {name}: {len(found)} headers are “{wanted}”", file=file, place=place)
    raise BadInput(
        f"--column {name}: no header is “{wanted}”",
        file=file,
        place=place,
        remedy=f"the headers are {_quoted(headers)}",
    )


def _column(
    name: str, header: str, position: int, unit: str | None, inverted: bool, file: Path, place: str
) -> Column:
    quantity = name.split("_", maxsplit=1)[0]
    own = split_header(header)[1]
    used = unit if unit is not None else own
    where = f"{place}, column {position + 1} “{header}”"
    if used is None:
        raise BadInput(
            "this column has no unit",
            file=file,
            place=where,
            remedy=f"write it into the header (“{header} [{_example(quantity)}]”) or say --unit {name}=…",
        )
    try:
        factor, offset = conversion(quantity, _UNIT_SPELLINGS.get(used.strip(), used.strip()))
    except BadInput as error:
        raise BadInput(error.problem, file=file, place=where, remedy=error.remedy) from None
    return Column(
        name=name,
        quantity=quantity,
        header=header,
        position=position,
        unit=_UNIT_SPELLINGS.get(used.strip(), used.strip()),
        unit_from="option" if unit is not None else "header",
        factor=factor,
        offset=offset,
        inverted=inverted,
    )


def _example(quantity: str) -> str:
    return {"time": "s", "stroke": "mm", "force": "kN", "speed": "mm/s"}.get(quantity, "°C")


def _quoted(headers: Iterable[str]) -> str:
    return ", ".join(f"“{header}”" for header in headers)
