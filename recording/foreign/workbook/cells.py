"""The cells of a sheet as numbers: those that are numbers, those stored as text, dates and times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.recording.foreign.date_columns import KNOWN_DATES, DateColumns
from bufferstand.recording.foreign.decimal_signs import grouped_number, perhaps_thousands
from bufferstand.recording.foreign.heading import NUMBER
from bufferstand.recording.foreign.numbers import NOT_A_NUMBER, BadCell
from bufferstand.recording.foreign.record import Findings, Floats, Header, ReadingOptions

TIMES = datetime | time | timedelta
TEXT_NUMBERS = "number(s) stored as text"
DAY_0 = datetime(1899, 12, 31)  # noqa: DTZ001 - Excel knows no zones
"""The day that Excel numbers 0, unless a workbook counts from 1904."""
_A_YEAR = np.timedelta64(366, "D")


class SheetCells:
    """Turns columns of cells into numbers.

    Parameters
    ----------
    path, headers : Path, sequence of Header
        For messages.
    rows : sequence of int
        Number (from 1) of each row in the sheet.
    reading : Reading
        What the user says of decimal sign and missing values.
    findings : Findings
        Where what is odd is noted.
    """

    def __init__(
        self,
        path: Path,
        headers: Sequence[Header],
        rows: Sequence[int],
        reading: ReadingOptions,
        findings: Findings,
    ) -> None:
        self._path, self._headers, self._rows = path, headers, rows
        self._reading, self._findings = reading, findings
        self._no_value, self._missing = reading.no_value, reading.no_value_numbers
        self.decimal = ""
        """The decimal sign of the numbers stored as text, where one of them has any."""

    def numbers(self, table: Mapping[int, Sequence[Any]]) -> dict[int, Floats]:
        """Return columns of numbers, NaN where there is no value.

        Raises
        ------
        BadInput
            If a cell is neither a number nor no value, or its sign may separate thousands.
        """
        kept = {position: [self._kept(cell) for cell in cells] for position, cells in table.items()}
        texts = {position: [c for c in cells if isinstance(c, str)] for position, cells in kept.items()}
        sign = self._sign([text for of_column in texts.values() for text in of_column])
        for position, cells in kept.items():
            self._refuse_thousands(cells, sign, position)
        if any(sign in text for of_column in texts.values() for text in of_column):
            self.decimal = sign
        return {position: self._column(cells, sign, position) for position, cells in kept.items()}

    def times(self, cells: Sequence[Any], position: int, moments: DateColumns, day_0: datetime) -> Floats:
        """Return the times [s] of a column of dates and times, NaN where there is none.

        ``day_0`` is the day that the workbook numbers 0.

        Raises
        ------
        BadInput
            If a cell is neither a date, a time nor no value.
        """
        kept = [self._kept(cell) for cell in cells]
        if any(isinstance(cell, str) for cell in kept):
            texts = ["" if cell is None else str(cell) for cell in kept]
            seconds, bad = moments.seconds(texts, frozenset(("",)))
            wrong = bad.tolist()
        else:
            wrong = [i for i, cell in enumerate(kept) if not isinstance(cell, TIMES | None)]
            stamps = _stamps([cell if isinstance(cell, TIMES) else None for cell in kept], day_0)
            wrong += np.flatnonzero((stamps < KNOWN_DATES[0]) | (stamps > KNOWN_DATES[1])).tolist()
            stamps[wrong] = np.datetime64("NaT")
            ns = stamps.astype("datetime64[ns]").astype(np.int64)
            seconds = moments.since_first(ns, aware=False)
        for index in wrong:
            self._bad(self._rows[index], position, str(kept[index]), "")
        return seconds

    def _kept(self, cell: Any) -> Any:
        """Return a cell, texts without surrounding spaces; None for what says: no value."""
        if isinstance(cell, str):
            text = cell.strip()
            return None if text in self._no_value or self._means_missing(text) else text
        if self._missing and _is_number(cell) and cell in self._missing:
            return None
        return cell

    def _means_missing(self, text: str) -> bool:
        signs = self._reading.decimal or ".,"
        return bool(self._missing) and any(
            NUMBER[sign].fullmatch(text) and float(text.replace(",", ".")) in self._missing for sign in signs
        )

    def _sign(self, texts: Sequence[str]) -> str:
        """Return the decimal sign by which most texts are numbers; of equals, the point."""
        if self._reading.decimal is not None:
            return self._reading.decimal
        fitting = {
            sign: sum(form.fullmatch(text) is not None for text in texts) for sign, form in NUMBER.items()
        }
        return max(fitting, key=lambda sign: fitting[sign])

    def _refuse_thousands(self, cells: Sequence[Any], sign: str, position: int) -> None:
        """Refuse a sign that nobody stated, where it may as well separate thousands.

        It may if every number that has it could be one of thousands, and others have none: 950, 1,234.
        """
        if self._reading.decimal is not None:
            return
        form = NUMBER[sign]
        signed = [i for i, c in enumerate(cells) if isinstance(c, str) and sign in c and form.fullmatch(c)]
        plain = any(
            _is_number(c) or (isinstance(c, str) and sign not in c and form.fullmatch(c)) for c in cells
        )
        grouped = grouped_number(sign)
        if signed and plain and all(grouped.fullmatch(cells[i]) for i in signed):
            place = f"row {self._rows[signed[0]]}, column {position + 1} “{self._headers[position].text}”"
            raise perhaps_thousands(cells[signed[0]], sign, self._path, place)

    def _column(self, cells: Sequence[Any], sign: str, position: int) -> Floats:
        values = np.full(len(cells), np.nan)
        for index, cell in enumerate(cells):
            if _is_number(cell):
                values[index] = float(str(cell))  # an integer too long is infinite, no OverflowError
            elif isinstance(cell, str) and NUMBER[sign].fullmatch(cell):
                self._findings.note(TEXT_NUMBERS, self._rows[index])
                values[index] = float(cell.replace(",", "."))
            elif cell is not None:
                self._bad(self._rows[index], position, str(cell), sign)
        return values

    def _bad(self, row: int, position: int, text: str, sign: str) -> None:
        """Refuse a cell, or note that it counts as no value."""
        if not self._reading.salvage:
            raise BadCell(row, position, text, sign).message(
                self._path, self._headers, self._findings.row_word
            )
        self._findings.note(NOT_A_NUMBER, row)


def _is_number(cell: Any) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _stamps(cells: Sequence[datetime | time | timedelta | None], day_0: datetime) -> NDArray[np.datetime64]:
    """Return when cells were, NaT where there is none.

    Times without a date are on the day that their workbook numbers 0: Excel counts on from there, and 24:00
    is day 1. A column that begins in its workbook's first year has no dates, but such numbers; it is put
    where most workbooks count from, so that it is known by its year.
    """
    stamps = np.array([_instant(cell, day_0) for cell in cells], dtype="datetime64[us]")
    known = stamps[~np.isnat(stamps)]
    if len(known) and abs(known[0] - np.datetime64(day_0)) < _A_YEAR:
        stamps -= np.timedelta64(day_0 - DAY_0)
    return stamps


def _instant(cell: datetime | time | timedelta | None, day_0: datetime) -> datetime | None:
    if isinstance(cell, time):
        return datetime.combine(day_0, cell)
    try:
        return day_0 + cell if isinstance(cell, timedelta) else cell
    except OverflowError:
        return datetime.max  # noqa: DTZ901 - refused as any date that is out of range
