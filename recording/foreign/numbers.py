"""Converts cells to numbers one by one, where they are no plain numbers or an error must be located."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.date_columns import DateColumns
from bufferstand.recording.foreign.heading import NUMBER
from bufferstand.recording.foreign.record import Findings, Floats, Header, ReadingOptions, TimeColumn

NOT_A_NUMBER = "cell(s) that are no number, taken as no value"
_INFINITE = ("inf", "infinity")


class BadCell(Exception):  # noqa: N818 - it names the fact
    """A cell that is neither a number nor no value: where it is, what it says, by which decimal sign."""

    def __init__(self, line: int, position: int, text: str, sign: str) -> None:
        super().__init__(line, position, text, sign)
        self.line, self.position, self.text, self.sign = line, position, text, sign

    def message(self, path: Path, headers: Sequence[Header], word: str = "line") -> BadInput:
        """Return the message for the user."""
        what = f"“{self.text[:40]}” is no number (decimal sign “{self.sign}”)"
        if _infinite(self.text, self.sign):
            what = "an infinite value"
        elif not self.sign:
            what = f"“{self.text[:40]}” is no date and time of the form that is stated"
        return BadInput(
            what,
            file=path,
            place=f"{word} {self.line}, column {self.position + 1} “{headers[self.position].text}”",
            remedy="mend it, or leave the cell empty if there is no value; or take such cells as no value: "
            "by “missing” in a mapping file, or --salvage",
        )


class CellReader:
    """Turns the cells of some columns into numbers.

    Parameters
    ----------
    positions : sequence of int
        The columns wanted.
    reading : Reading
        What cells say: no value; whether one that cannot be read is one of them.
    sign : str
        Decimal sign.
    clock : Clock or None
        The column that holds dates and times.
    """

    def __init__(
        self, positions: Sequence[int], reading: ReadingOptions, sign: str, clock: TimeColumn | None
    ) -> None:
        self._positions, self._sign, self._clock = positions, sign, clock
        self._no_value, self._no_numbers = reading.no_value, reading.no_value_numbers
        self._salvage = reading.salvage

    def columns(
        self,
        rows: Sequence[Sequence[str]],
        line: NDArray[np.int64],
        findings: Findings,
        moments: DateColumns | None,
    ) -> dict[int, Floats]:
        """Return the columns, shape (n,) each.

        Raises
        ------
        BadCell
            The first one, unless it is to count as no value; that is noted in ``findings``.
        """
        columns: dict[int, Floats] = {}
        bad: list[tuple[int, int]] = []
        for position in self._positions:
            texts = [cells[position] for cells in rows]
            if self._clock is not None and moments is not None and position == self._clock.position:
                columns[position], wrong = moments.seconds(texts, self._no_value)
                bad += [(int(row), position) for row in wrong]
            else:
                columns[position] = np.array([self._number(text) for text in texts], dtype=np.float64)
                wrong_rows = np.flatnonzero(np.isinf(columns[position]))
                bad += [(int(row), position) for row in wrong_rows]
                columns[position][wrong_rows] = np.nan
        for row, position in sorted(bad):
            if not self._salvage:
                is_time = self._clock is not None and position == self._clock.position
                text = rows[row][position]
                raise BadCell(int(line[row]), position, text, "" if is_time else self._sign)
            findings.note(NOT_A_NUMBER, int(line[row]))
        return columns

    def _number(self, text: str) -> float:
        """Return a cell's number; infinity for what is none, and for what is infinite."""
        if text in self._no_value:
            return math.nan
        if NUMBER[self._sign].fullmatch(text) is None:
            return math.inf
        number = float(text.replace(",", "."))
        return math.nan if number in self._no_numbers else number


def _infinite(text: str, sign: str) -> bool:
    if text.lower().lstrip("+-") in _INFINITE:
        return True
    form = NUMBER.get(sign)
    return form is not None and form.fullmatch(text) is not None
