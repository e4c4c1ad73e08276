"""The numbers of a text file of columns: read fast, and where one cannot be read, say which."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from foundation.errors import BadInput
from recording.foreign.cells import BadCell, CellReader
from recording.foreign.dialect import SEPARATORS, Dialect, detect
from recording.foreign.moments import Moments
from recording.foreign.record import Clock, Findings, Floats, Header, Numbers, Reading
from recording.foreign.sifting import Form, Sieve, WrongLine, wrong_line
from recording.foreign.textblocks import TextBlock, text_blocks

SIGNS = (".", ",")


@dataclass(frozen=True)
class _Piece:
    """The rows of one block of text."""

    columns: dict[int, Floats]
    line: NDArray[np.int64]
    headings: Sequence[int] = ()
    left_out: Sequence[int] = ()


class DelimitedRecord:
    """A text file of columns, CSV or TSV. Only one block of its text is in memory at a time.

    Raises
    ------
    BadInput
        As :func:`recording.foreign.dialect.detect`.
    """

    row_word = "line"

    def __init__(self, path: Path, reading: Reading | None = None) -> None:
        self.path = path
        self._reading = reading or Reading()
        self.dialect: Dialect = detect(path, self._reading)
        self.headers: tuple[Header, ...] = self.dialect.headers
        self.header_place = f"line {self.dialect.header_line or self.dialect.first_line}"
        self._form = Form(
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

    def read(self, positions: Sequence[int], clock: Clock | None = None) -> list[Numbers]:
        """Return the numbers of some columns, those with decimal comma where that is what they are.

        Raises
        ------
        BadInput
            If a line is no row of the table, or a cell is neither a number nor empty.
        """
        failures: list[BadCell] = []
        for sign in self._signs(positions):
            try:
                return [self._pass(positions, clock, sign)]
            except BadCell as failure:
                failures.append(failure)
        furthest = max(failures, key=lambda failure: failure.line)  # of equals, the first: the point
        raise furthest.message(self.path, self.headers)

    def _signs(self, positions: Sequence[int]) -> Sequence[str]:
        """Return the decimal signs to try, one after the other."""
        if self._reading.decimal is not None:
            return self._reading.decimal
        if not self._reading.salvage:
            return SIGNS
        block = next(text_blocks(self.path, self.dialect), TextBlock(1, "", cut=False))
        cells = CellReader(positions, self._form.no_value, ".", None, salvage=True)
        rows = Sieve(self._form, Findings(self.row_word)).sift(block.text[: 1 << 18], 1, last_is_cut=True)
        return max(SIGNS, key=lambda sign: cells.fitting(rows.cells, sign))

    def _pass(self, positions: Sequence[int], clock: Clock | None, sign: str) -> Numbers:
        self._decimal, self._findings, self._further = sign, Findings(self.row_word), []
        moments = Moments(clock) if clock else None
        cells = CellReader(positions, self._form.no_value, sign, clock, salvage=self._reading.salvage)
        sieve = Sieve(self._form, self._findings)
        pieces: list[_Piece] = []
        try:
            for block in text_blocks(self.path, self.dialect):
                piece = None if sieve.waiting else self._fast(block, positions, clock, sign, moments)
                if piece is None:
                    sifted = sieve.sift(block.text, block.first_line, last_is_cut=block.cut)
                    line = np.array(sifted.line, dtype=np.int64)
                    columns = cells.columns(sifted.cells, line, self._findings, moments)
                    piece = _Piece(columns, line, sifted.headings, sifted.left_out)
                elif block.cut:
                    self._further.append(
                        "the last line is not ended: the file may be cut short, and its last number with it"
                    )
                pieces.append(piece)
            sieve.finish()
        except WrongLine as error:
            raise wrong_line(error, self._form, self.path, SEPARATORS[self._form.separator]) from None
        if self.dialect.zeros_at_end:
            self._further.append(
                f"the file ends in {self.dialect.zeros_at_end} zero byte(s): its end was not written"
            )
        if moments is not None and not moments.zone_is_stated:
            self._further.append("its dates and times state no zone and count as UTC")
        return self._joined(pieces, positions, moments)

    def _joined(self, pieces: list[_Piece], positions: Sequence[int], moments: Moments | None) -> Numbers:
        rows = [len(piece.line) for piece in pieces]
        if not sum(rows):
            raise BadInput("no numbers below the header row", file=self.path, place=self.header_place)
        starts = np.cumsum([0, *rows[:-1]]).tolist()
        line = np.concatenate([piece.line for piece in pieces])
        columns = {}
        for position in positions:  # one after the other: no more than one is there twice
            columns[position] = np.concatenate([piece.columns.pop(position) for piece in pieces])
        headings = [
            start + row for start, piece in zip(starts, pieces, strict=True) for row in piece.headings
        ]
        left_out = [
            start + row for start, piece in zip(starts, pieces, strict=True) for row in piece.left_out
        ]
        inside = [row for row in headings if 0 < row < len(line)]
        return Numbers(
            columns=columns,
            row=line,
            breaks=sorted({*inside, *(row for row in left_out if 0 < row < len(line))}),
            blocks=sorted(set(inside)),
            started=moments.started if moments else None,
        )

    def _fast(
        self,
        block: TextBlock,
        positions: Sequence[int],
        clock: Clock | None,
        sign: str,
        moments: Moments | None,
    ) -> _Piece | None:
        """Return a block's rows if all its lines are plain rows, else None."""
        text = block.text
        if '"' in text:
            if '""' in text:
                return None
            text = text.replace('"', "")
        if sign == self._form.separator or (lines := self._plain_lines(text.encode())) is None:
            return None
        frame = self._frame(text, positions, clock, sign)
        if frame is None or len(frame) != len(lines):
            return None
        columns: dict[int, Floats] = {}
        for position in positions:
            if clock is not None and moments is not None and position == clock.position:
                texts = frame[position].str.strip().tolist()
                columns[position], bad = moments.seconds(texts, self._form.no_value)
                if len(bad):
                    return None
            else:
                columns[position] = frame[position].to_numpy(dtype=np.float64)
                if np.isinf(columns[position]).any():
                    return None
        return _Piece(columns, lines + block.first_line)

    def _frame(
        self, text: str, positions: Sequence[int], clock: Clock | None, sign: str
    ) -> pd.DataFrame | None:
        """Return the columns of plain rows, None if a cell is no number."""
        numeric = [position for position in positions if clock is None or position != clock.position]
        options: dict[str, Any] = {
            "sep": self._form.separator,
            "header": None,
            "names": range(len(self.headers)),
            "usecols": list(positions),
            "dtype": {position: np.float64 if position in numeric else str for position in positions},
            "decimal": sign,
            "keep_default_na": False,
            "na_values": {position: sorted(self._form.no_value) for position in numeric},
            "skipinitialspace": True,
            "index_col": False,
            "quoting": csv.QUOTE_NONE,
        }
        try:
            frame: pd.DataFrame = pd.read_csv(io.StringIO(text), **options)
        except ValueError:  # pandas' ParserError is one, too
            return None
        return frame

    def _plain_lines(self, body: bytes) -> NDArray[np.int64] | None:
        """Return the offsets of the rows among some lines, None if one is neither a row nor blank."""
        text = np.frombuffer(body, dtype=np.uint8)
        ends = np.flatnonzero(text == ord("\n"))
        marks = np.flatnonzero(text == ord(self._form.separator))
        cells = np.diff(np.searchsorted(marks, ends), prepend=0) + 1
        odd = np.flatnonzero(cells != len(self.headers))
        starts = np.concatenate([[0], ends[:-1] + 1])
        if any(body[starts[i] : ends[i]].strip(b" ") for i in odd.tolist()):
            return None
        kept = np.ones(len(ends), dtype=bool)
        kept[odd] = False
        return np.flatnonzero(kept)
