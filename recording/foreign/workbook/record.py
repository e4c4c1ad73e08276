"""Excel workbooks: one sheet as a table, read row by row."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.columns import DATE_TIME
from bufferstand.recording.foreign.date_columns import DateColumns
from bufferstand.recording.foreign.heading import LOOKED_AT, find_heading
from bufferstand.recording.foreign.library_files import missing_library, of_library, quiet
from bufferstand.recording.foreign.record import (
    Findings,
    Floats,
    Header,
    Numbers,
    ReadingOptions,
    TimeColumn,
)
from bufferstand.recording.foreign.workbook.cells import DAY_0, TIMES, SheetCells
from bufferstand.recording.foreign.workbook.limits import cells_of, demand_bounded
from bufferstand.recording.foreign.workbook.rows import (
    SheetRowFilter,
    SheetTable,
    as_texts,
    is_number,
    is_remark,
)

_TEXT_OF_FORMULA = "str"
"""Type of a cell whose formula gave a text: openpyxl keeps it where that is empty."""


class ExcelRecord:
    """One sheet of a workbook (.xlsx, .xlsm). Of formulas, the values that Excel stored are taken.

    Raises
    ------
    BadInput
        If it cannot be read, has several sheets and none is named, or the sheet holds no table.
    """

    row_word = "row"

    def __init__(self, path: Path, reading: ReadingOptions) -> None:
        self.path, self._reading = path, reading
        if reading.groups:
            raise BadInput("a workbook has sheets, not groups", file=path, remedy="name one by --sheet")
        self._findings = Findings(self.row_word)
        self._decimal = ""
        self._further: list[str] = []
        with self._opened(values=True) as book:
            with of_library(path, "workbook"):
                self._sheet = _sheet(book, reading.sheet, path)
            self._day_0 = max(book.epoch, DAY_0)  # openpyxl counts from the day before day 0, or from 1904
            first = list(islice(self._rows(book), LOOKED_AT))
        rows = [_texts(row) for row in first]
        heading = find_heading(rows, reading)
        if heading is None or len(heading.headers) < 2:
            raise BadInput(
                "no header row with at least two columns", file=path, place=f"sheet “{self._sheet}”"
            )
        dated = {
            i for row in first[heading.first_row :] for i, cell in enumerate(row) if isinstance(cell, TIMES)
        }
        self._heading = heading
        self.headers: tuple[Header, ...] = tuple(
            replace(header, unit=DATE_TIME, unit_from="cells")
            if not header.unit and position in dated
            else header
            for position, header in enumerate(heading.headers)
        )
        line = heading.first_row if heading.row is None else heading.row
        self.header_place = f"sheet “{self._sheet}”, row {line + 1}"
        texts = [header.text for header in self.headers if header.text]
        if reading.header_line is None and all(map(is_number, texts)):
            raise BadInput(
                "no header row: this row holds numbers only",
                file=path,
                place=self.header_place,
                remedy="put a row like “time [s] | stroke [mm] | force [kN]” before the numbers",
            )

    def where(self, position: int) -> str:
        """Return where a column's header stands, for messages."""
        return f"{self.header_place}, column {_letters(position)} “{self.headers[position].text}”"

    def facts(self) -> dict[str, Any]:
        """Return how the sheet is written, for the run file."""
        facts: dict[str, Any] = {"format": "Excel", "sheet": self._sheet}
        if self._heading.row is not None:
            facts["header_line"] = self._heading.row + 1
        if self._heading.units_row is not None:
            facts["units_line"] = self._heading.units_row + 1
        return facts | ({"decimal": self._decimal} if self._decimal else {})

    def findings(self) -> list[str]:
        """Return what is odd about the sheet as a whole."""
        return [*self._further, *self._findings.texts()]

    def read(self, positions: Sequence[int], clock: TimeColumn | None = None) -> list[Numbers]:
        """Return the numbers of some columns.

        Raises
        ------
        BadInput
            If a row is no row of the table, a cell is neither a number nor empty, or a formula has no value.
        """
        table = self._table(positions)
        if table.blank or any(None in cells for cells in table.columns.values()):
            self._refuse_formulas(positions)
        if not table.row:
            raise BadInput("no numbers below the header row", file=self.path, place=self.header_place)
        cells = SheetCells(self.path, self.headers, table.row, self._reading, self._findings)
        moments = DateColumns(clock) if clock else None
        columns: dict[int, Floats] = {}
        if clock is not None and moments is not None:
            columns[clock.position] = cells.times(
                table.columns.pop(clock.position), clock.position, moments, self._day_0
            )
        columns |= cells.numbers(table.columns)
        self._decimal = cells.decimal
        if moments is not None and moments.started is not None and not moments.zone_is_stated:
            self._further.append("its dates and times state no zone and count as UTC")
        inside = [row for row in table.headings if 0 < row < len(table.row)]
        return [
            Numbers(
                columns=columns,
                row=np.array(table.row, dtype=np.int64),
                breaks=sorted({*inside, *(row for row in table.breaks if 0 < row < len(table.row))}),
                blocks=sorted(set(inside)),
                started=moments.started if moments else None,
            )
        ]

    def _table(self, positions: Sequence[int]) -> SheetTable:
        """Return the rows of numbers below the header row."""
        texts = [header.text for header in self.headers]
        sieve = SheetRowFilter(self.path, self._sheet, texts, positions, self._reading, self._findings)
        with self._opened(values=True) as book:
            for number, cells in enumerate(self._rows(book), start=1):
                if number > self._heading.first_row:
                    sieve.take(number, cells)
        return sieve.finish()

    def _refuse_formulas(self, positions: Sequence[int]) -> None:
        """Refuse formulas whose value was never stored; an empty text that was stored is no value."""
        with self._opened(values=False) as formulas, self._opened(values=True) as stored:
            for number, (cells, values) in enumerate(
                zip(self._cells(formulas), self._cells(stored), strict=True), start=1
            ):
                for position in positions if number > self._heading.first_row else ():
                    if position >= len(cells) or cells[position].data_type != "f":
                        continue
                    if values[position].value is None and values[position].data_type != _TEXT_OF_FORMULA:
                        raise BadInput(
                            "a formula whose value is not stored",
                            file=self.path,
                            place=f"sheet “{self._sheet}”, cell {_letters(position)}{number}",
                            remedy="open the workbook in Excel or LibreOffice, and save it",
                        )

    def _rows(self, book: Any) -> Iterator[tuple[Any, ...]]:
        """Give the values of each row's cells."""
        yield from self._cells(book, values_only=True)

    def _cells(self, book: Any, *, values_only: bool = False) -> Iterator[tuple[Any, ...]]:
        with of_library(self.path, "workbook", f"sheet “{self._sheet}”"):
            yield from cells_of(book[self._sheet], self.path, values_only=values_only)

    @contextmanager
    def _opened(self, *, values: bool) -> Iterator[Any]:
        try:
            from openpyxl import load_workbook  # noqa: PLC0415 - optional library
        except ImportError:
            raise missing_library("openpyxl", self.path, "a workbook") from None
        try:
            stream = self.path.open("rb")
        except OSError as error:
            raise BadInput(f"cannot be read: {error.strerror}", file=self.path) from None
        with stream, quiet("openpyxl"):
            demand_bounded(stream, self.path)
            with of_library(self.path, "workbook (.xlsx)"):
                book = load_workbook(stream, read_only=True, data_only=values)
            try:
                yield book
            finally:
                book.close()


def _sheet(book: Any, asked: str | None, path: Path) -> str:
    """Return the name of the sheet to read: the one asked for, else the only one not empty."""
    names = [sheet.title for sheet in book.worksheets]
    listed = ", ".join(f"“{name}”" for name in names)
    if asked is not None:
        if asked not in names:
            raise BadInput(f"no sheet is named “{asked}”", file=path, remedy=f"the sheets are {listed}")
        return asked
    filled = [sheet.title for sheet in book.worksheets if not _is_empty(sheet, path)]
    if not filled:
        raise BadInput("the workbook is empty", file=path)
    if len(filled) > 1:
        raise BadInput(
            f"{len(filled)} sheets hold something",
            file=path,
            remedy=f"say which by --sheet; they are {listed}",
        )
    return str(filled[0])


def _is_empty(sheet: Any, path: Path) -> bool:
    return not any(any(cell is not None for cell in row) for row in cells_of(sheet, path))


def _texts(cells: Sequence[Any]) -> list[str]:
    """Return cells as texts, without the empty ones at the end; none of a blank row or a remark."""
    texts = as_texts(cells)
    while texts and not texts[-1]:
        texts.pop()
    return [] if is_remark(texts) else texts


def _letters(position: int) -> str:
    """Return a column's letters: A … Z, AA …"""
    letters = ""
    number = position + 1
    while number:
        number, rest = divmod(number - 1, 26)
        letters = chr(ord("A") + rest) + letters
    return letters
