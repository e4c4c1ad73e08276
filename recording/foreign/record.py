"""The common result of all readers of foreign records: headers, and numbers on their time bases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from math import isfinite, nan
from pathlib import Path
from typing import Any, Protocol
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MISSING = ("", "NaN", "nan", "NAN")
"""Cells that say: no value."""


@dataclass(frozen=True)
class Header:
    """A column as the record names it.

    Parameters
    ----------
    text : str
        Its header, maybe with the unit in brackets.
    group : str
        Group of channels that it belongs to, where a record has several.
    unit, unit_from : str
        Unit that is stated apart from the header, and where; empty if none is.
    """

    text: str
    group: str = ""
    unit: str = ""
    unit_from: str = ""

    @property
    def full(self) -> str:
        """Get the header with its group before it."""
        return f"{self.group}/{self.text}" if self.group else self.text


@dataclass(frozen=True)
class TimeColumn:
    """A time column that holds dates and times: its position, ``strptime`` format (None: ISO 8601), zone."""

    position: int
    format: str | None = None
    zone: ZoneInfo | None = None


@dataclass(frozen=True)
class Numbers:
    """Columns that share one time base.

    Parameters
    ----------
    columns : mapping of int to NDArray[float64]
        By position among the headers; NaN where there is no value; shape (n,) each.
    row : NDArray[int64]
        Number (from 1) of each row in the file, as the record counts them; shape (n,).
    time_s : NDArray[float64], optional
        Time [s] that the record keeps apart from its columns (waveform, master channel); shape (n,).
    time_from : str
        What that is.
    breaks : sequence of int
        Rows before which the record was interrupted, whatever the time says.
    blocks : sequence of int
        Rows before which a heading stood: here a record of its own may begin.
    started : datetime, optional
        When its time was 0.
    """

    columns: Mapping[int, Floats]
    row: NDArray[np.int64]
    time_s: Floats | None = None
    time_from: str = ""
    breaks: Sequence[int] = ()
    blocks: Sequence[int] = ()
    started: datetime | None = None


@dataclass(frozen=True)
class ReadingOptions:
    """How to read a record, as far as the user says it; what is left out is found out.

    Parameters
    ----------
    expected : sequence of str
        Headers that the user names: the header row holds them.
    encoding, separator, decimal : str, optional
        Of a text file.
    header_line, units_line, first_line : int, optional
        Lines (rows of a sheet), from 1; header_line 0: there is none.
    missing : sequence of str
        Cells that mean: no value; besides those of ``MISSING``. One that is a number stands for that number
        in any way of writing.
    sheet : str, optional
        Of a workbook.
    groups : sequence of str
        Groups of channels to read.
    block : int, optional
        Which one (from 1), where a text file holds several records one after the other.
    salvage : bool
        Keep what is sound: a cell that cannot be read is no value, a line that cannot be read is left out.
    """

    expected: Sequence[str] = ()
    encoding: str | None = None
    separator: str | None = None
    decimal: str | None = None
    header_line: int | None = None
    units_line: int | None = None
    first_line: int | None = None
    missing: Sequence[str] = ()
    sheet: str | None = None
    groups: Sequence[str] = ()
    block: int | None = None
    salvage: bool = False

    @property
    def no_value(self) -> frozenset[str]:
        """Get the cells that mean: no value."""
        return frozenset((*MISSING, *self.missing))

    @property
    def no_value_numbers(self) -> frozenset[float]:
        """Get the numbers among them: −9999 is meant however many digits it is written with."""
        return frozenset(number for text in self.missing if isfinite(number := _number(text)))


def _number(text: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return nan


class ForeignRecord(Protocol):
    """A record of another make, opened; its numbers are read when it is known which are wanted."""

    path: Path
    headers: tuple[Header, ...]
    header_place: str
    """Where the headers stand, for messages."""
    row_word: str
    """What a row is called in messages: ``line``, ``row``, ``sample``."""

    def where(self, position: int) -> str:
        """Return where a column's header stands, for messages."""
        ...

    def read(self, positions: Sequence[int], clock: TimeColumn | None) -> list[Numbers]:
        """Return the numbers of some columns, one item for each time base.

        Raises
        ------
        BadInput
            If one cannot be read, naming its place.
        """
        ...

    def facts(self) -> dict[str, Any]:
        """Return how the file is written, as far as it was found out when it was read."""
        ...

    def findings(self) -> list[str]:
        """Return what is odd about the file as a whole."""
        ...


@dataclass
class Findings:
    """What reading found odd: each sentence with how often, and where it was first."""

    row_word: str
    _seen: dict[str, list[int]] = field(default_factory=dict)

    def note(self, what: str, row: int) -> None:
        """Note one occurrence in a row (from 1)."""
        self._seen.setdefault(what, []).append(row)

    def count(self, what: str) -> int:
        """Return how often something was noted."""
        return len(self._seen.get(what, ()))

    def texts(self) -> list[str]:
        """Return the sentences, in the order in which they were first noted."""
        return [
            f"{len(rows)} {what}, the first in {self.row_word} {rows[0]}" for what, rows in self._seen.items()
        ]
