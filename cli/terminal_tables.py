"""Tables on the terminal: numbers are never broken, whatever the width."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from textwrap import wrap
from typing import TYPE_CHECKING

import click

from bufferstand.foundation import plain

if TYPE_CHECKING:
    from rich.console import Console

_BETWEEN = 2
"""Spaces between two columns."""
_UNLIMITED = 200
"""Characters a line where the reader is no terminal."""
_TEXT = 24
"""A column of words is broken between them, into lines of no less than this."""


@dataclass(frozen=True)
class _Column:
    heading: str
    side: str
    cells: tuple[str, ...]

    @property
    def whole(self) -> int:
        """Width in which nothing is broken."""
        return max(map(len, (*self.heading.split("\n"), *self.cells)))

    @property
    def least(self) -> int:
        """Width in which no number is broken, and words only between them."""
        headed = max(map(len, self.heading.split()), default=0)
        longest = max(map(len, self.cells), default=0)
        if self.side == "left":
            words = (len(word) for cell in self.cells for word in cell.split())
            longest = min(longest, max((_TEXT, *words)))
        return max(headed, longest)

    def narrow(self, width: int) -> _Column:
        """Return it with a heading of several lines."""
        lines = [part for line in self.heading.split("\n") for part in wrap(line, max(width, 1))]
        return replace(self, heading="\n".join(lines))


def show_table(columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[str]], *, title: str = "") -> None:
    """Print a table on standard output.

    On a terminal that is too narrow for it, it is printed in parts, each with the first column.

    Parameters
    ----------
    columns : sequence of (heading, side)
        Side is ``left`` (words, broken between them where there is no room), ``right`` (numbers), or
        ``whole`` for a left column that is not broken, either.
    rows : sequence of sequence of str
        Cells.
    title : str
        Above it.
    """
    from rich.console import Console  # noqa: PLC0415 - only where a table is shown

    terminal = Console()
    width = terminal.width if terminal.is_terminal else _UNLIMITED
    cells = [[plain(cell).replace("\n", " ") for cell in row] for row in rows]
    table = [
        _Column(heading, side, tuple(row[place] for row in cells))
        for place, (heading, side) in enumerate(columns)
    ]
    fits = sum(column.whole + _BETWEEN for column in table) - _BETWEEN <= width
    text = io.StringIO()  # rich ends the process with status 1 where a reader has gone
    console = Console(
        file=text, force_terminal=terminal.is_terminal, width=width, highlight=False, markup=False
    )
    for number, part in enumerate([table] if fits or not terminal.is_terminal else _parts(table, width)):
        if number:
            text.write("\n")
        _print(console, part, plain(title) if number == 0 else "")
    click.echo(text.getvalue(), nl=False)


def _parts(table: Sequence[_Column], width: int) -> Iterator[list[_Column]]:
    """Yield columns that fit side by side, each time behind the first, which says what a row is of."""
    first, *others = table
    begins = min(first.least, width // 2)
    most = width - begins - _BETWEEN
    part, taken = [first.narrow(begins)], begins
    for column in others:
        needs = min(column.least, most)
        if len(part) > 1 and taken + _BETWEEN + needs > width:
            yield _level(part)
            part, taken = [first.narrow(begins)], begins
        part.append(column.narrow(needs))
        taken += _BETWEEN + needs
    yield _level(part)


def _level(part: Sequence[_Column]) -> list[_Column]:
    """Return columns whose headings end in one line."""
    lines = max(column.heading.count("\n") for column in part)
    return [
        replace(column, heading="\n" * (lines - column.heading.count("\n")) + column.heading)
        for column in part
    ]


def _print(console: Console, columns: Sequence[_Column], title: str) -> None:
    from rich.table import Table  # noqa: PLC0415 - only where a table is shown

    table = Table(title=title or None, title_justify="left", header_style="bold", pad_edge=False, box=None)
    for column in columns:
        table.add_column(
            column.heading,
            justify="right" if column.side == "right" else "left",
            overflow="fold",
            no_wrap=column.side == "whole",
            min_width=min(column.least, console.width // 2),
        )
    for row in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*row)
    console.print(table)
