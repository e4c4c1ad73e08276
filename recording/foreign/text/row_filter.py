"""Reads a piece of a text file that is not plain rows of values line by line, and keeps the sound ones."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, field

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.heading import is_data, is_units, is_value
from bufferstand.recording.foreign.record import Findings
from bufferstand.recording.foreign.text.cell_splitting import TextRow, text_rows

LEFT_OUT = "line(s) could not be read and were left out"
HEADINGS = "header row(s) inside the data"
REMARKS = "remark(s) (#) inside the data"
ABOVE_HEADINGS = "line(s) with a number or two above a header row inside the data, left out with it"
ODD_QUOTES = "line(s) with a quote that is not closed, read as a character"
SHORT = "line(s) without the last columns, which are not used"
CUT = "line(s) at the end not written whole and left out (the file is cut short)"


@dataclass(frozen=True)
class RowForm:
    """What a row of the file looks like, and what may be done with one that looks otherwise."""

    headers: Sequence[str]
    separator: str
    no_value: frozenset[str]
    salvage: bool


@dataclass
class FilteredRows:
    """Rows of values: line (from 1) and cells of each; the rows before which something else was."""

    line: list[int] = field(default_factory=list)
    cells: list[list[str]] = field(default_factory=list)
    headings: list[int] = field(default_factory=list)
    left_out: list[int] = field(default_factory=list)
    blank: list[int] = field(default_factory=list)


class RowFilter:
    """Takes rows of values out of text, and notes what else there was.

    Parameters
    ----------
    form : Form
    findings : Findings
        Where it is noted.
    positions : sequence of int
        The columns that are used: by them a row is told from a line of text.
    """

    def __init__(self, form: RowForm, findings: Findings, positions: Sequence[int]) -> None:
        self._form, self._findings, self._positions = form, findings, positions
        self._needed = max(positions) + 1
        self._headers = _without_tail(form.headers)
        self._other: list[_Other] = []
        """Lines not yet explained: a header row below them makes them part of its block."""

    def sift(self, text: str, first_line: int, *, last_is_cut: bool) -> FilteredRows:
        """Return the rows of values in some whole lines.

        Raises
        ------
        WrongLine
            If a line is neither a row, part of a heading, a remark nor blank.
        """
        found = FilteredRows()
        lines = io.StringIO(text).readlines()
        for row in text_rows(lines, self._form.separator):
            line, cells = first_line + row.line, self._fitted(row.cells)
            if row.cells == [""]:
                found.blank.append(len(found.line))
            elif cells[0].startswith("#") and cells[0] not in self._form.no_value:
                self._findings.note(REMARKS, line)
            elif _without_tail(cells) == self._headers:
                self._findings.note(HEADINGS, line)
                self._other.clear()
                self._drop_above(found)
                found.headings.append(len(found.line))
            elif is_units(cells) and not is_data(cells, self._form.no_value):
                continue
            elif not row.swallows and self._is_row(cells):
                self._refuse_other(found)
                self._note_oddness(row, line)
                found.line.append(line)
                found.cells.append(cells + [""] * (len(self._form.headers) - len(cells)))
            elif last_is_cut and row.line + row.lines == len(lines):
                self._findings.note(CUT, line)
            else:
                self._other.append(_Other(line, len(cells), row))
        return found

    @property
    def waiting(self) -> bool:
        """Whether there are lines that only what follows can explain."""
        return bool(self._other)

    def finish(self) -> None:
        """Refuse what is still not explained at the end of the file.

        Raises
        ------
        WrongLine
            If there is such a line and it is not to be left out.
        """
        self._refuse_other(FilteredRows())

    def _fitted(self, cells: list[str]) -> list[str]:
        """Return the cells of a line without empty ones too many."""
        while len(cells) > len(self._form.headers) and not cells[-1]:
            cells = cells[:-1]
        return cells

    def _is_row(self, cells: Sequence[str]) -> bool:
        """Tell whether cells are a row and no line of text that happens to have as many cells.

        Columns at the end that are not used may be missing (LabVIEW leaves out an empty comment).
        """
        if not self._needed <= len(cells) <= len(self._form.headers):
            return False
        used = [cells[position] for position in self._positions]
        return any(cell[:1] in "+-.,0123456789" for cell in used if cell) or all(
            cell in self._form.no_value for cell in used
        )

    def _note_oddness(self, row: TextRow, line: int) -> None:
        if row.odd_quote:
            self._findings.note(ODD_QUOTES, line)
        if len(row.cells) < len(self._form.headers):
            self._findings.note(SHORT, line)

    def _drop_above(self, found: FilteredRows) -> None:
        """Take back lines right above a header row that hold a number beside a text (“Cycle,2,”)."""
        while found.line and self._is_caption(found.cells[-1]):
            self._findings.note(ABOVE_HEADINGS, found.line.pop())
            found.cells.pop()

    def _is_caption(self, cells: Sequence[str]) -> bool:
        whole = is_data([cells[p] for p in self._positions], frozenset())
        return not whole and not all(is_value(cell, self._form.no_value) for cell in cells)

    def _refuse_other(self, found: FilteredRows) -> None:
        if not self._other:
            return
        if not self._form.salvage:
            raise WrongLine(self._other[0].line, self._other[0].problem(len(self._form.headers)))
        for other in self._other:
            self._findings.note(LEFT_OUT, other.line)
        self._other.clear()
        found.left_out.append(len(found.line))


@dataclass(frozen=True)
class _Other:
    """A line that is no row: its number (from 1), how many cells it has, how they were distinguished."""

    line: int
    cells: int
    row: TextRow

    def problem(self, width: int) -> str:
        if self.row.swallows:
            return "a quote is opened here and closed in a later line, with rows of numbers between"
        quote = " (a quote in it is not closed)" if self.row.odd_quote else ""
        if self.cells != width:
            return f"{self.cells} cell(s) where the header row has {width}{quote}"
        return f"a line of text inside the data{quote}"


def _without_tail(cells: Sequence[str]) -> list[str]:
    """Return cells without empty ones at the end."""
    kept = list(cells)
    while kept and not kept[-1]:
        kept.pop()
    return kept


class WrongLine(Exception):  # noqa: N818 - it names the fact
    """A line that is no row of the table: its number, and what is wrong with it."""

    def __init__(self, line: int, problem: str) -> None:
        super().__init__(line, problem)
        self.line, self.problem = line, problem


def wrong_line(error: WrongLine, file: object, separator_name: str) -> BadInput:
    """Return the message for a line that is no row."""
    return BadInput(
        error.problem,
        file=str(file),
        place=f"line {error.line}",
        remedy="mend or remove this line, or leave it out with --salvage (columns are separated by "
        f"{separator_name} here)",
    )
