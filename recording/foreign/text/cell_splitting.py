"""Lines of text into cells: separators, quotes, and quotes that are no quotes."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bufferstand.recording.foreign.heading import is_number

QUOTE = '"'
_ROW_LIKE = 2
"""So many numbers in a line are taken for a row rather than for the further line of a text."""


@dataclass(frozen=True)
class TextRow:
    """A row of cells, without surrounding spaces and quotes.

    Parameters
    ----------
    line : int
        Index of its first line.
    lines : int
        How many it takes: more than one where a quoted cell holds line breaks.
    cells : list of str
    odd_quote : bool
        Whether a quote is opened in it and not closed as a cell's quote is: it then is a character as any
        other, and ends no line.
    swallows : bool
        Whether its quoted cell would take in lines that look like rows: one cannot tell what was meant.
    """

    line: int
    lines: int
    cells: list[str]
    odd_quote: bool = False
    swallows: bool = False


def split_line(line: str, separator: str) -> list[str]:
    """Return the cells of one line, without surrounding spaces and quotes; none of a blank one."""
    return next(text_rows([line], separator)).cells if line.strip() else []


def text_rows(lines: Sequence[str], separator: str) -> Iterator[TextRow]:
    """Give the rows of some lines. A blank line is a row of one empty cell.

    Quotes are those of RFC 4180, with spaces allowed before them. A quote that does not close its cell is a
    character as any other, so that one stray quote (inches!) does not take in the lines below it.
    """
    index = 0
    while index < len(lines):
        line = lines[index]
        row = _quoted(lines, index, separator) if QUOTE in line else None
        row = row or TextRow(index, 1, [cell.strip() for cell in line.split(separator)])
        yield row
        index += row.lines


def _quoted(lines: Sequence[str], index: int, separator: str) -> TextRow:
    reader = csv.reader(
        (lines[i] for i in range(index, len(lines))), delimiter=separator, skipinitialspace=True, strict=True
    )
    try:
        cells = [" ".join(cell.split()) if "\n" in cell else cell.strip() for cell in next(reader)]
    except csv.Error:  # not closed, closed inside a cell, or longer than any cell is
        cells = [_unquoted(cell.strip()) for cell in lines[index].split(separator)]
        return TextRow(index, 1, cells, odd_quote=any(QUOTE in cell for cell in cells))
    further = lines[index + 1 : index + reader.line_num]
    if any(_is_row_like(line, separator) for line in further):
        return TextRow(index, 1, cells, swallows=True)
    return TextRow(index, reader.line_num, cells)


def _unquoted(cell: str) -> str:
    """Return a cell without the quotes around it, if it has no others."""
    inner = cell[1:-1]
    return inner if len(cell) > 1 and cell[0] == cell[-1] == QUOTE and QUOTE not in inner else cell


def _is_row_like(line: str, separator: str) -> bool:
    return sum(is_number(cell.strip()) for cell in line.split(separator)) >= _ROW_LIKE
