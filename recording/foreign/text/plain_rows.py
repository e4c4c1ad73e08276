"""Reads text that consists of plain rows of values at once, by pandas; any other text is left to others."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bufferstand.recording.foreign.date_columns import DateColumns
from bufferstand.recording.foreign.record import Floats, ReadingOptions, TimeColumn
from bufferstand.recording.foreign.text.cell_splitting import QUOTE
from bufferstand.recording.foreign.text.row_filter import RowForm

_REMARK = re.compile(r"^[ \t]*#", re.MULTILINE)
_LINE_FEED, _SPACE = ord("\n"), ord(" ")


@dataclass(frozen=True)
class PlainRows:
    """Columns by position, the offset of each row's line, and the rows before which a blank line was."""

    columns: dict[int, Floats]
    lines: NDArray[np.int64]
    blank: Sequence[int]


class PlainReader:
    """Reads blocks of text that are plain rows.

    Parameters
    ----------
    form : Form
        What a row looks like.
    reading : Reading
        What cells say: no value.
    sign : str
        Decimal sign.
    positions : sequence of int
        The columns wanted.
    clock : Clock or None
        The one among them that holds dates and times.
    """

    def __init__(
        self,
        form: RowForm,
        reading: ReadingOptions,
        sign: str,
        positions: Sequence[int],
        clock: TimeColumn | None,
    ) -> None:
        self._form, self._sign, self._positions, self._clock = form, sign, positions, clock
        self._no_value = reading.no_value
        self._no_numbers = [*sorted(self._no_value), *map(repr, sorted(reading.no_value_numbers))]

    def read(self, text: str, moments: DateColumns | None) -> PlainRows | None:
        """Return the rows of some whole lines; None if one is no plain row."""
        plain = self._unquoted(text)
        if plain is None or self._sign == self._form.separator or ("#" in plain and _REMARK.search(plain)):
            return None
        found = self._lines(plain.encode())
        if found is None:
            return None
        lines, blank = found
        frame = self._frame(plain)
        if frame is None or len(frame) != len(lines):
            return None
        columns: dict[int, Floats] = {}
        for position in self._positions:
            if self._clock is not None and moments is not None and position == self._clock.position:
                texts = frame[position].str.strip().tolist()
                columns[position], bad = moments.seconds(texts, self._no_value)
                if len(bad):
                    return None
            else:
                columns[position] = frame[position].to_numpy(dtype=np.float64)
                if np.isinf(columns[position]).any():
                    return None
        return PlainRows(columns, lines, blank)

    def texts(self, text: str, position: int, indices: NDArray[np.int64]) -> list[str]:
        """Return some cells of one column of text that was read, by the index of their rows."""
        body = text.replace(QUOTE, "").encode()
        found, separator = self._lines(body), self._form.separator.encode()
        if found is None:  # text that was not read
            return []
        ends = np.flatnonzero(np.frombuffer(body, dtype=np.uint8) == _LINE_FEED)
        starts = np.concatenate([[0], ends[:-1] + 1])
        lines = found[0][indices]
        spans = zip(starts[lines].tolist(), ends[lines].tolist(), strict=True)
        return [body[start:end].split(separator)[position].strip().decode() for start, end in spans]

    def _unquoted(self, text: str) -> str | None:
        """Return text without the quotes around whole cells; None if there are others."""
        if QUOTE not in text:
            return text
        codes = np.frombuffer(text.encode("utf-32-le"), dtype=np.uint32)
        quotes = np.flatnonzero(codes == ord(QUOTE))
        if len(quotes) % 2:
            return None
        edges = np.flatnonzero((codes == ord(self._form.separator)) | (codes == _LINE_FEED))
        opened, closed = quotes[0::2], quotes[1::2]
        if (np.searchsorted(edges, opened) != np.searchsorted(edges, closed)).any():
            return None  # a separator or a line end in quotes
        is_edge = np.zeros(len(codes) + 1, dtype=bool)
        is_edge[edges + 1] = True
        is_edge[0] = True  # shifted by one: whether the character before is an edge
        if not (is_edge[opened].all() and is_edge[closed + 2].all()):
            return None
        return text.replace(QUOTE, "")

    def _frame(self, text: str) -> pd.DataFrame | None:
        """Return the columns of plain rows, None if a cell is no number."""
        of_time = None if self._clock is None else self._clock.position
        kinds = {position: str if position == of_time else np.float64 for position in self._positions}
        options: dict[str, Any] = {
            "sep": self._form.separator,
            "header": None,
            "names": range(len(self._form.headers)),
            "usecols": list(self._positions),
            "dtype": kinds,
            "decimal": self._sign,
            "keep_default_na": False,
            "na_values": {place: self._no_numbers for place, kind in kinds.items() if kind is not str},
            "skipinitialspace": True,
            "index_col": False,
            "quoting": csv.QUOTE_NONE,
        }
        try:
            frame: pd.DataFrame = pd.read_csv(io.StringIO(text), **options)
        except ValueError:  # pandas' ParserError is one, too
            return None
        return frame

    def _lines(self, body: bytes) -> tuple[NDArray[np.int64], list[int]] | None:
        """Return the offsets of rows and the rows behind blank lines, None if a line is neither."""
        text = np.frombuffer(body, dtype=np.uint8)
        ends = np.flatnonzero(text == _LINE_FEED)
        marks = np.flatnonzero(text == ord(self._form.separator))
        cells = np.diff(np.searchsorted(marks, ends), prepend=0) + 1
        odd = np.flatnonzero(cells != len(self._form.headers))
        starts = np.concatenate([[0], ends[:-1] + 1])
        if any(body[starts[i] : ends[i]].strip(b" ") for i in odd.tolist()):
            return None
        kept = np.ones(len(ends), dtype=bool)
        kept[odd] = False
        lines = np.flatnonzero(kept)
        return lines, np.searchsorted(lines, odd).tolist()
