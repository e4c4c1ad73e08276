"""The numbers of a text file of columns: read fast, and where one cannot be read, say which."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from foundation.errors import BadInput
from recording.dialect import NUMBER, SEPARATORS, Dialect, detect

MISSING = ("", "NaN", "nan", "NAN")
"""Cells that say: no value."""


@dataclass(frozen=True)
class Numbers:
    """Columns by position (float64, NaN where empty, shape (n,)) and the line (from 1) of every row."""

    columns: dict[int, NDArray[np.float64]]
    line: NDArray[np.int64]
    decimal: str


class DelimitedRecord:
    """A text file of columns, CSV or TSV.

    Raises
    ------
    BadInput
        As :func:`recording.dialect.detect`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.dialect: Dialect = detect(path)
        self.headers = self.dialect.headers
        self.header_place = f"line {self.dialect.header_line}"

    def facts(self) -> dict[str, Any]:
        """Return how the file is written, for the run file."""
        return {
            "encoding": self.dialect.encoding,
            "separator": SEPARATORS[self.dialect.separator],
            "header_line": self.dialect.header_line,
        }

    def findings(self) -> list[str]:
        """Return what is odd about the file as a whole."""
        if self.dialect.ends_with_newline:
            return []
        return ["the last line is not ended: the file may be cut short, and its last number with it"]

    def place(self, line: int, position: int) -> str:
        """Return where a cell stands, for messages."""
        return f"line {line}, column {position + 1} “{self.headers[position]}”"

    def read(self, positions: Sequence[int]) -> Numbers:
        """Return the numbers of some columns, those with decimal comma where that is what they are.

        Raises
        ------
        BadInput
            If a line has more or fewer cells than the header row, or a cell is neither a number nor empty.
        """
        line = self._lines_of_rows()
        if not len(line):
            raise BadInput("no numbers below the header row", file=self.path, place=self.header_place)
        signs = "." if self.dialect.separator == "," else ".,"
        for decimal in signs:
            columns = self._parse(positions, decimal)
            if columns is not None:
                if any(len(column) != len(line) for column in columns.values()):
                    raise BadInput("lines and quotes do not match up", file=self.path)
                self._refuse_infinite(columns, line)
                return Numbers(columns, line, decimal)
        raise self._bad_cell(positions, signs)

    def _lines_of_rows(self) -> NDArray[np.int64]:
        """Return the line of every row, after making sure that each has a cell for every header."""
        if b'"' in self.dialect.body:
            return np.array([number for number, _ in self._rows()], dtype=np.int64)
        text = np.frombuffer(self.dialect.body, dtype=np.uint8)
        ends = np.flatnonzero(text == ord("\n"))
        marks = np.flatnonzero(text == ord(self.dialect.separator))
        cells = np.diff(np.searchsorted(marks, ends), prepend=0) + 1
        odd = np.flatnonzero(cells != len(self.headers))
        starts = np.concatenate([[0], ends[:-1] + 1])
        blank = [i for i in odd.tolist() if not self.dialect.body[starts[i] : ends[i]].strip(b" ")]
        if len(blank) < len(odd):
            first = next(i for i in odd.tolist() if i not in set(blank))
            raise self._wrong_width(self.dialect.header_line + 1 + first, int(cells[first]))
        kept = np.ones(len(ends), dtype=bool)
        kept[blank] = False
        return np.flatnonzero(kept) + self.dialect.header_line + 1

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        """Give line and cells of every row (slow: for quoted files and for messages)."""
        stream = io.TextIOWrapper(io.BytesIO(self.dialect.body), encoding="utf-8", newline="")
        reader = csv.reader(stream, delimiter=self.dialect.separator, skipinitialspace=True)
        for cells in reader:
            number = self.dialect.header_line + reader.line_num
            if len(cells) == len(self.headers):
                yield number, [cell.strip() for cell in cells]
            elif any(cell.strip() for cell in cells):
                raise self._wrong_width(number, len(cells))

    def _wrong_width(self, line: int, cells: int) -> BadInput:
        return BadInput(
            f"{cells} cell(s) where the header row has {len(self.headers)}",
            file=self.path,
            place=f"line {line}",
            remedy="mend or remove this line (columns are separated by "
            f"{SEPARATORS[self.dialect.separator]} here)",
        )

    def _parse(self, positions: Sequence[int], decimal: str) -> dict[int, NDArray[np.float64]] | None:
        """Return the columns, or None if a cell is no number by this decimal sign."""
        try:
            frame = pd.read_csv(
                io.BytesIO(self.dialect.body),
                sep=self.dialect.separator,
                header=None,
                names=range(len(self.headers)),
                usecols=list(positions),
                dtype=np.float64,
                decimal=decimal,
                keep_default_na=False,
                na_values=list(MISSING),
                skipinitialspace=True,
                index_col=False,
                encoding="utf-8",
            )
        except ValueError:  # pandas' ParserError is one, too
            return None
        return {position: frame[position].to_numpy(dtype=np.float64) for position in positions}

    def _refuse_infinite(self, columns: dict[int, NDArray[np.float64]], line: NDArray[np.int64]) -> None:
        for position, column in columns.items():
            if np.isinf(column).any():
                row = int(np.argmax(np.isinf(column)))
                raise BadInput(
                    "an infinite value", file=self.path, place=self.place(int(line[row]), position)
                )

    def _bad_cell(self, positions: Sequence[int], signs: str) -> BadInput:
        """Return the message for the first cell that is no number, by the decimal sign that fits most."""
        fits = dict.fromkeys(signs, 0)
        first: dict[str, tuple[int, int, str]] = {}
        for line, cells in self._rows():
            for position in positions:
                cell = cells[position]
                for sign in signs:
                    if cell in MISSING or NUMBER[sign].fullmatch(cell):
                        fits[sign] += 1
                    else:
                        first.setdefault(sign, (line, position, cell))
        sign = max(signs, key=lambda one: fits[one])
        line, position, cell = first.get(sign, (self.dialect.header_line, positions[0], ""))
        return BadInput(
            f"“{cell[:40]}” is no number (decimal sign “{sign}”)",
            file=self.path,
            place=self.place(line, position),
            remedy="mend it, or leave the cell empty if there is no value",
        )
