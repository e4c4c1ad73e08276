"""Finds the beginning of a table: its header row, a row of units below it, and the lines above."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from bufferstand.foundation import FACTORS
from bufferstand.recording.foreign.columns import DATE_TIME, REQUIRED, full_name, spelled, split_header
from bufferstand.recording.foreign.record import Header, ReadingOptions

LOOKED_AT = 200
"""Rows in which the header row is sought."""
NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"),
}
"""What a number looks like, by decimal sign."""
_VALUE = re.compile(r"[+-]?[\d.,]*\d[\d.,]*([eE][+-]?\d+)?|\d[\d:.,/+TZ -]*[\dZ]|[+-]?inf")
"""What may be a number or a date in some way of writing."""
_UNITS = {unit for units in FACTORS.values() for unit in units} | {DATE_TIME}


@dataclass(frozen=True)
class Heading:
    """Where the table's heading stands.

    Parameters
    ----------
    row, units_row : int or None
        Index of the header row and of the row of units among the rows looked at; None if there is none.
    first_row : int
        Index of the first row that may be data.
    headers : tuple of Header
    """

    row: int | None
    units_row: int | None
    first_row: int
    headers: tuple[Header, ...]


def is_number(cell: str) -> bool:
    """Tell whether a cell is a number by one decimal sign or the other."""
    return any(form.fullmatch(cell) for form in NUMBER.values())


def is_value(cell: str, no_value: frozenset[str]) -> bool:
    """Tell whether a cell may be a number, a date or no value, rather than a text."""
    return cell in no_value or _VALUE.fullmatch(cell) is not None


def is_data(cells: Sequence[str], no_value: frozenset[str]) -> bool:
    """Tell whether a row holds values only, at least one of them."""
    return any(cell not in no_value for cell in cells) and all(is_value(cell, no_value) for cell in cells)


def is_units(cells: Sequence[str]) -> bool:
    """Tell whether a row holds units: at least two known ones, and no number or name of a channel."""
    stated = [_bare(cell) for cell in cells]
    known = sum(unit in _UNITS for unit in stated)
    others = [unit for unit in stated if unit not in _UNITS]
    return known >= 2 and not any(_VALUE.fullmatch(unit) or full_name(unit) for unit in others)


def _bare(cell: str) -> str:
    stripped = cell.strip()
    if stripped[:1] + stripped[-1:] in ("[]", "()", "{}", "<>"):
        stripped = stripped[1:-1]
    return spelled(stripped)


def find_heading(rows: Sequence[Sequence[str]], reading: ReadingOptions) -> Heading | None:
    """Find the heading of a table.

    The header row is the one that the user says; else the first that holds all headers that the user names,
    or stroke and force by name; else the last row of texts before the first row of values (and a row of
    units); else the first row that is not blank.

    Parameters
    ----------
    rows : sequence of sequence of str
        The first rows' cells, without surrounding spaces; a row that is blank or a remark has none.
    reading : Reading
        What the user says of it.

    Returns
    -------
    Heading or None
        None if all rows are blank.
    """
    if reading.header_line == 0:
        return _without_header(rows, reading)
    if reading.header_line is not None:
        row: int | None = reading.header_line - 1
    else:
        row = _named(rows, reading.expected)
        row = _before_data(rows, reading.no_value) if row is None else row
        row = next((i for i, cells in enumerate(rows) if cells), None) if row is None else row
    if row is None or row >= len(rows) or not rows[row]:
        return None
    following = next((i for i in range(row + 1, len(rows)) if rows[i]), None)
    units_row = None
    if reading.units_line is not None:
        units_row = reading.units_line - 1
    elif following is not None and is_units(rows[following]):
        units_row = following
    first = row + 1 if units_row is None else max(row, units_row) + 1
    if reading.first_line is not None:
        first = reading.first_line - 1
    units = rows[units_row] if units_row is not None and units_row < len(rows) else ()
    names = _fitted(rows, row, first, reading.no_value)
    headers = tuple(
        Header(text, unit=unit, unit_from="units row" if unit else "")
        for text, unit in zip(names, [*map(_bare, units), *[""] * len(names)], strict=False)
    )
    return Heading(row, units_row, first, headers)


def _without_header(rows: Sequence[Sequence[str]], reading: ReadingOptions) -> Heading | None:
    first = next((i for i, cells in enumerate(rows) if is_data(cells, reading.no_value)), None)
    first = first if reading.first_line is None else reading.first_line - 1
    if first is None or first >= len(rows):
        return None
    return Heading(None, None, first, tuple(Header(f"column {i + 1}") for i in range(len(rows[first]))))


def _named(rows: Sequence[Sequence[str]], expected: Sequence[str]) -> int | None:
    """Return the first row that names the headers; if all such rows hold values, the first of them."""
    named = [index for index, cells in enumerate(rows) if names_headers(cells, expected)]
    return next((index for index in named if not _holds_values(rows[index])), next(iter(named), None))


def names_headers(cells: Sequence[str], expected: Sequence[str]) -> bool:
    """Tell whether a row holds all headers that the user names, or stroke and force by name."""
    wanted = [text.strip().lower() for text in expected]
    lowered = {cell.lower() for cell in cells} | {split_header(cell)[0].lower() for cell in cells}
    if wanted and all(text in lowered for text in wanted):
        return True
    names = [full_name(split_header(cell)[0]) for cell in cells]
    return all(name in names for name in REQUIRED)


def _holds_values(cells: Sequence[str]) -> bool:
    return any(_VALUE.fullmatch(cell) for cell in cells)


def _before_data(rows: Sequence[Sequence[str]], no_value: frozenset[str]) -> int | None:
    """Return the last row of texts before the first row of values that has as many cells.

    A row of values and texts (a remark, “OVER”) is a row of the table as well, and no heading.
    """
    for index, cells in enumerate(rows):
        if len(cells) < 2 or not is_data(cells, no_value):
            continue
        above = [i for i in range(index) if rows[i]]
        while above and abs(len(rows[above[-1]]) - len(cells)) <= 1 and _holds_values(rows[above[-1]]):
            above.pop()
        if above and is_units(rows[above[-1]]):
            above.pop()
        if above and abs(len(rows[above[-1]]) - len(cells)) <= 1 and not is_data(rows[above[-1]], no_value):
            return above[-1]
        return None
    return None


def _fitted(rows: Sequence[Sequence[str]], row: int, first: int, no_value: frozenset[str]) -> tuple[str, ...]:
    """Return the headers, with empty ones at the end added or taken off where all rows have them so."""
    names = list(rows[row])
    data = next((cells for cells in rows[first:] if is_data(cells, no_value)), None)
    if data is None:
        return tuple(names)
    while len(names) > len(data) and not names[-1]:
        names.pop()
    while len(names) < len(data) and not any(data[len(names) :]):
        names.append("")
    return tuple(names)
