"""Row by row through a sheet: rows of numbers, headings inside the data, blank rows and text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import date, time, timedelta
from pathlib import Path
from typing import Any

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.heading import NUMBER, is_units, is_value
from bufferstand.recording.foreign.record import Findings, ReadingOptions
from bufferstand.recording.foreign.text import HEADINGS, REMARKS

ABOVE = "row(s) of text above a header row inside the data, left out with it"
BLANK = "blank row(s) inside the data"
LEFT_OUT = "row(s) could not be read and were left out"
_VALUES = int | float | date | time | timedelta
_ERROR = re.compile(r"#N/A|#[A-Z0-9/_]+[!?]")
"""What a formula gives that failed: no text, but a value that is missing."""


@dataclass
class SheetTable:
    """Rows of numbers: number (from 1) and cells of each; the rows before which something else was."""

    columns: dict[int, list[Any]]
    row: list[int] = field(default_factory=list)
    headings: list[int] = field(default_factory=list)
    breaks: list[int] = field(default_factory=list)
    """Rows before which a blank row stood, or one that was left out."""
    blank: bool = False
    """Whether there was a blank row anywhere."""


@dataclass(frozen=True)
class _Waiting:
    """A row that a header row below it may explain as one of its block: blank (no cells) or ``Cycle | 2``."""

    number: int
    cells: Sequence[Any] = ()


class SheetRowFilter:
    """Takes the rows of numbers out of a sheet, and notes what else there was.

    Parameters
    ----------
    path : Path
        For messages.
    sheet : str
        For messages.
    headers : sequence of str
        What a header row inside the data says, as the first one.
    positions : sequence of int
        The columns wanted.
    reading : Reading
        What the user says of missing values and salvage.
    findings : Findings
        Where what is odd is noted.
    """

    def __init__(
        self,
        path: Path,
        sheet: str,
        headers: Sequence[str],
        positions: Sequence[int],
        reading: ReadingOptions,
        findings: Findings,
    ) -> None:
        self._path, self._sheet = path, sheet
        self._headers, self._positions = list(headers), positions
        self._no_value, self._salvage = reading.no_value, reading.salvage
        self._findings = findings
        self._waiting: list[_Waiting] = []
        self.table = SheetTable({position: [] for position in positions})

    def take(self, number: int, cells: Sequence[Any]) -> None:
        """Take the next row below the header row.

        Raises
        ------
        BadInput
            If a row before it is neither one of numbers nor part of a heading.
        """
        if all(map(_is_blank, cells)):
            self.table.blank = True
            self._waiting.append(_Waiting(number))
            return
        row = [*cells, *[None] * (len(self._headers) - len(cells))]
        values = sum(_is_value(row[position]) for position in self._positions)
        if values == len(self._positions):
            self._keep(number, row)
            return
        texts = as_texts(row)
        if is_remark(texts):
            self._findings.note(REMARKS, number)
        elif texts[: len(self._headers)] == self._headers:
            self._heading(number)
        elif is_units(texts):
            return
        elif values <= 1 and self._begins_with_text(texts):
            # Even with a number: a sample has two of them at least, or does not begin with a text.
            self._waiting.append(_Waiting(number, row))
        else:
            self._keep(number, row)

    def finish(self) -> SheetTable:
        """Return what was found. Blank rows at the end are no finding.

        Raises
        ------
        BadInput
            If a row at the end is no row of numbers.
        """
        while self._waiting and not self._waiting[-1].cells:
            self._waiting.pop()
        self._settle()
        return self.table

    def _begins_with_text(self, texts: Sequence[str]) -> bool:
        first = next(text for text in texts if text)
        return not is_value(first, self._no_value) and not _ERROR.fullmatch(first)

    def _heading(self, number: int) -> None:
        """Note a header row; what is directly above it is of its block."""
        self._findings.note(HEADINGS, number)
        for waiting in self._waiting:
            if waiting.cells:
                self._findings.note(ABOVE, waiting.number)
        self._waiting.clear()
        self.table.headings.append(len(self.table.row))

    def _keep(self, number: int, row: Sequence[Any]) -> None:
        self._settle()
        self.table.row.append(number)
        for position in self._positions:
            self.table.columns[position].append(row[position])

    def _settle(self) -> None:
        """Take rows that no header row explains for what they are."""
        waiting, self._waiting = self._waiting, []
        for row in waiting:
            if not row.cells:
                self._interrupted(BLANK, row.number)
            elif any(map(_is_value, row.cells)):
                self._keep(row.number, row.cells)
            elif self._salvage:
                self._interrupted(LEFT_OUT, row.number)
            else:
                raise BadInput(
                    "a row of text inside the data",
                    file=self._path,
                    place=f"sheet “{self._sheet}”, row {row.number}",
                    remedy="remove this row, or leave it out with --salvage",
                )

    def _interrupted(self, what: str, number: int) -> None:
        """Note a row that is missing from the record; a blank one below a heading is but layout."""
        here = len(self.table.row)
        if what != BLANK or (here > 0 and self.table.headings[-1:] != [here]):
            self._findings.note(what, number)
            self.table.breaks.append(here)


def as_texts(cells: Sequence[Any]) -> list[str]:
    """Return cells as texts without surrounding spaces."""
    return ["" if cell is None else str(cell).strip() for cell in cells]


def is_number(text: str) -> bool:
    """Tell whether a text is a number by either decimal sign."""
    return any(form.fullmatch(text) for form in NUMBER.values())


def is_remark(texts: Sequence[str]) -> bool:
    """Tell whether a row is a remark: one cell alone that begins with ``#``."""
    filled = [text for text in texts if text]
    return len(filled) == 1 and filled[0].startswith("#") and not _ERROR.fullmatch(filled[0])


def _is_blank(cell: Any) -> bool:
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _is_value(cell: Any) -> bool:
    return is_number(cell.strip()) if isinstance(cell, str) else isinstance(cell, _VALUES)
