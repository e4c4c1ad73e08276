"""Line by line through a piece of a text file that is not plain rows of values: what is sound is kept."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from foundation.errors import BadInput
from recording.foreign.heading import is_data, is_units
from recording.foreign.record import Findings

LEFT_OUT = "line(s) could not be read and were left out"
HEADINGS = "header row(s) inside the data"
REMARKS = "remark(s) (#) inside the data"
CUT = "line(s) at the end not written whole and left out (the file is cut short)"


@dataclass(frozen=True)
class Form:
    """What a row of the file looks like, and what may be done with one that looks otherwise."""

    headers: Sequence[str]
    separator: str
    no_value: frozenset[str]
    salvage: bool


@dataclass
class Sifted:
    """Rows of values: line (from 1) and cells of each; the rows before which a heading or a bad line was."""

    line: list[int] = field(default_factory=list)
    cells: list[list[str]] = field(default_factory=list)
    headings: list[int] = field(default_factory=list)
    left_out: list[int] = field(default_factory=list)


class Sieve:
    """Takes rows of values out of text, and notes what else there was."""

    def __init__(self, form: Form, findings: Findings) -> None:
        self._form, self._findings = form, findings
        self._other: list[tuple[int, int]] = []
        """Lines not yet explained: a header row below them makes them part of its block; (line, cells)."""

    def sift(self, text: str, first_line: int, *, last_is_cut: bool) -> Sifted:
        """Return the rows of values in some whole lines.

        Raises
        ------
        WrongLine
            If a line is neither a row, part of a heading, a remark nor blank.
        """
        found = Sifted()
        rows = list(self._rows(text))
        for index, (offset, cells) in enumerate(rows):
            line = first_line + offset
            if not any(cells):
                continue
            if cells[0].startswith("#"):
                self._findings.note(REMARKS, line)
            elif list(cells) == list(self._form.headers):
                self._findings.note(HEADINGS, line)
                self._other.clear()
                found.headings.append(len(found.line))
            elif is_units(cells) and not is_data(cells, self._form.no_value):
                continue
            elif len(cells) == len(self._form.headers) and self._is_row(cells):
                self._refuse_other(found)
                found.line.append(line)
                found.cells.append(cells)
            elif last_is_cut and index == len(rows) - 1:
                self._findings.note(CUT, line)
            else:
                self._other.append((line, len(cells)))
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
        self._refuse_other(Sifted())

    def _is_row(self, cells: Sequence[str]) -> bool:
        """Tell whether cells are a row and no line of text that happens to have as many cells."""
        return any(cell[:1] in "+-.,0123456789" for cell in cells if cell) or all(
            cell in self._form.no_value for cell in cells
        )

    def _rows(self, text: str) -> Iterator[tuple[int, list[str]]]:
        """Give the offset of each line, and its cells; a line's empty cells too many are dropped."""
        width = len(self._form.headers)
        reader = csv.reader(
            text.splitlines(keepends=True), delimiter=self._form.separator, skipinitialspace=True
        )
        for row in reader:
            cells = [cell.strip() for cell in row]
            while len(cells) > width and not cells[-1]:
                cells.pop()
            yield reader.line_num - 1, cells

    def _refuse_other(self, found: Sifted) -> None:
        if not self._other:
            return
        if not self._form.salvage:
            raise WrongLine(*self._other[0])
        for line, _ in self._other:
            self._findings.note(LEFT_OUT, line)
        self._other.clear()
        found.left_out.append(len(found.line))


class WrongLine(Exception):  # noqa: N818 - it names the fact
    """A line that is no row of the table: its number and how many cells it has."""

    def __init__(self, line: int, cells: int) -> None:
        super().__init__(line, cells)
        self.line, self.cells = line, cells


def wrong_line(error: WrongLine, form: Form, file: object, separator_name: str) -> BadInput:
    """Return the message for a line that is no row."""
    return BadInput(
        f"{error.cells} cell(s) where the header row has {len(form.headers)}"
        if error.cells != len(form.headers)
        else "a line of text inside the data",
        file=str(file),
        place=f"line {error.line}",
        remedy="mend or remove this line, or leave it out with --salvage (columns are separated by "
        f"{separator_name} here)",
    )
