"""Reads the numbers of a text file of columns quickly, and names a cell that cannot be read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.date_columns import DateColumns
from bufferstand.recording.foreign.decimal_signs import DecimalSignEvidence, perhaps_thousands
from bufferstand.recording.foreign.numbers import NOT_A_NUMBER, BadCell, CellReader
from bufferstand.recording.foreign.record import (
    Findings,
    Floats,
    Header,
    Numbers,
    ReadingOptions,
    TimeColumn,
)
from bufferstand.recording.foreign.text.blocks import TextBlock, text_blocks
from bufferstand.recording.foreign.text.dialect import SEPARATORS, TextDialect, detect
from bufferstand.recording.foreign.text.plain_rows import PlainReader
from bufferstand.recording.foreign.text.row_filter import RowFilter, RowForm, WrongLine, wrong_line

SIGNS = (".", ",")


@dataclass(frozen=True)
class _Piece:
    """The rows of one block of text."""

    columns: dict[int, Floats]
    line: NDArray[np.int64]
    headings: Sequence[int] = ()
    left_out: Sequence[int] = ()
    blank: Sequence[int] = ()
    """Rows before which there was a heading, a line left out, a blank line."""


class DelimitedRecord:
    """A text file of columns, CSV or TSV. Only one block of its text is in memory at a time.

    Raises
    ------
    BadInput
        As :func:`bufferstand.recording.foreign.text.dialect.detect`.
    """

    row_word = "line"

    def __init__(self, path: Path, reading: ReadingOptions | None = None) -> None:
        self.path = path
        self._reading = reading or ReadingOptions()
        self.dialect: TextDialect = detect(path, self._reading)
        self.headers: tuple[Header, ...] = self.dialect.headers
        self.header_place = f"line {self.dialect.header_line or self.dialect.first_line}"
        self._form = RowForm(
            self.dialect.header_texts,
            self.dialect.separator,
            self._reading.no_value,
            self._reading.salvage,
        )
        self._decimal = ""
        self._findings = Findings(self.row_word)
        self._further: list[str] = []

    def where(self, position: int) -> str:
        """Return where a column's header stands, for messages."""
        return f"{self.header_place}, column {position + 1} “{self.headers[position].text}”"

    def facts(self) -> dict[str, Any]:
        """Return how the file is written, for the run file."""
        optional = {"units_line": self.dialect.units_line, "preamble": list(self.dialect.preamble)}
        return {
            "format": "text",
            "encoding": self.dialect.encoding,
            "separator": SEPARATORS[self.dialect.separator],
            "header_line": self.dialect.header_line,
            "decimal": self._decimal,
            **{key: value for key, value in optional.items() if value},
        }

    def findings(self) -> list[str]:
        """Return what is odd about the file as a whole."""
        return [*self._further, *self._findings.texts()]

    def read(self, positions: Sequence[int], clock: TimeColumn | None = None) -> list[Numbers]:
        """Return the numbers of some columns, those with decimal comma where that is what they are.

        Raises
        ------
        BadInput
            If a line is no row of the table, or a cell is neither a number nor empty.
        """
        if self._reading.salvage and self._reading.decimal is None:
            return [self._salvaged(positions, clock)]
        failures: list[BadCell] = []
        for sign in self._reading.decimal or SIGNS:
            try:
                return [self._pass(positions, clock, sign)]
            except BadCell as failure:
                failures.append(failure)
        furthest = max(failures, key=lambda failure: (failure.line, failure.position))
        raise furthest.message(self.path, self.headers)

    def _salvaged(self, positions: Sequence[int], clock: TimeColumn | None) -> Numbers:
        """Return the numbers by the decimal sign by which most cells are numbers."""
        bad: dict[str, int] = {}
        for sign in SIGNS:
            numbers = self._pass(positions, clock, sign)
            bad[sign] = self._findings.count(NOT_A_NUMBER)
            if not bad[sign]:
                return numbers
        best = min(SIGNS, key=lambda sign: bad[sign])
        return numbers if best == self._decimal else self._pass(positions, clock, best)

    def _pass(self, positions: Sequence[int], clock: TimeColumn | None, sign: str) -> Numbers:
        self._decimal, self._findings, self._further = sign, Findings(self.row_word), []
        moments = DateColumns(clock) if clock else None
        numeric = [position for position in positions if clock is None or position != clock.position]
        asked = numeric if self._reading.decimal is None else []
        witnesses = {position: DecimalSignEvidence(sign) for position in asked}
        cells = CellReader(positions, self._reading, sign, clock)
        plain = PlainReader(self._form, self._reading, sign, positions, clock)
        sieve = RowFilter(self._form, self._findings, positions)
        pieces: list[_Piece] = []
        try:
            for block in text_blocks(self.path, self.dialect):
                rows = None if sieve.waiting else plain.read(block.text, moments)
                if rows is not None:
                    piece = _Piece(rows.columns, rows.lines + block.first_line, blank=rows.blank)
                    texts = partial(plain.texts, block.text)
                else:
                    sifted = sieve.sift(block.text, block.first_line, last_is_cut=block.cut)
                    line = np.array(sifted.line, dtype=np.int64)
                    columns = cells.columns(sifted.cells, line, self._findings, moments)
                    piece = _Piece(columns, line, sifted.headings, sifted.left_out, sifted.blank)
                    texts = partial(_cells_of, sifted.cells)
                for position, witness in witnesses.items():
                    values, sign_there = piece.columns[position], sign in block.text
                    witness.look(values, piece.line, partial(texts, position), sign_there=sign_there)
                self._note_cut(block, piece)
                pieces.append(piece)
            sieve.finish()
        except WrongLine as error:
            raise wrong_line(error, self.path, SEPARATORS[self._form.separator]) from None
        if self.dialect.zeros_at_end:
            self._further.append(
                f"the file ends in {self.dialect.zeros_at_end} zero byte(s): its end was not written"
            )
        if moments is not None and not moments.zone_is_stated:
            self._further.append("its dates and times state no zone and count as UTC")
        self._refuse_thousands(witnesses)
        return self._joined(pieces, positions, moments)

    def _joined(self, pieces: list[_Piece], positions: Sequence[int], moments: DateColumns | None) -> Numbers:
        rows = [len(piece.line) for piece in pieces]
        if not sum(rows):
            raise BadInput("no numbers below the header row", file=self.path, place=self.header_place)
        starts = np.cumsum([0, *rows[:-1]]).tolist()
        line = np.concatenate([piece.line for piece in pieces])
        columns = {}
        for position in positions:  # one after the other: no more than one is there twice
            columns[position] = np.concatenate([piece.columns.pop(position) for piece in pieces])
        placed = list(zip(starts, pieces, strict=True))
        headings = {start + row for start, piece in placed for row in piece.headings}
        left_out = {start + row for start, piece in placed for row in piece.left_out}
        blank = {start + row for start, piece in placed for row in piece.blank}
        if blank.issuperset(range(1, len(line))):  # behind every row: a way of ending lines
            blank.clear()
        breaks = sorted(row for row in headings | left_out | blank if 0 < row < len(line))
        return Numbers(
            columns=columns,
            row=line,
            breaks=breaks,
            blocks=[row for row in breaks if row in headings],
            started=moments.started if moments else None,
        )

    def _note_cut(self, block: TextBlock, piece: _Piece) -> None:
        last = block.first_line + block.text.count("\n") - 1
        if block.cut and len(piece.line) and piece.line[-1] == last:
            self._further.append(
                "the last line is not ended: the file may be cut short, and its last number with it"
            )

    def _refuse_thousands(self, witnesses: Mapping[int, DecimalSignEvidence]) -> None:
        for position, witness in witnesses.items():
            if witness.suspect is not None:
                line, text = witness.suspect
                place = f"line {line}, column {position + 1} “{self.headers[position].text}”"
                raise perhaps_thousands(text, self._decimal, self.path, place)


def _cells_of(rows: Sequence[Sequence[str]], position: int, indices: NDArray[np.int64]) -> list[str]:
    return [rows[index][position] for index in indices.tolist()]
