"""Where a key stands in a TOML text, for messages."""

from __future__ import annotations

import re
from collections.abc import Mapping

LONGEST_HEAD = 1000
"""Of a line, so many characters are looked at for the key that it begins with."""
_HEADER = re.compile(r"^\s*\[(\[)?\s*([A-Za-z0-9_.\"' -]+?)\s*\]?\]\s*(#.*)?$")
_KEY = re.compile(r"^\s*([A-Za-z0-9_.\"'-]+)\s*=")


def _lines_of_keys(text: str) -> dict[tuple[str | int, ...], int]:
    """Map each table and key path of a TOML text to its line (from 1)."""
    lines: dict[tuple[str | int, ...], int] = {}
    counts: dict[tuple[str | int, ...], int] = {}
    table: tuple[str | int, ...] = ()
    for number, whole_line in enumerate(text.splitlines(), start=1):
        line = whole_line[:LONGEST_HEAD]
        if header := _HEADER.match(line):
            table = ()
            parts = [part.strip(" \"'") for part in header[2].split(".")]
            for position, part in enumerate(parts):
                table = (*table, part)
                last = position == len(parts) - 1
                if header[1] and last:
                    counts[table] = counts.get(table, -1) + 1
                    table = (*table, counts[table])
                elif table in counts:
                    table = (*table, counts[table])
            lines.setdefault(table, number)
        elif key := _KEY.match(line):
            parts = [part.strip(" \"'") for part in key[1].split(".")]
            lines.setdefault((*table, *parts), number)
    return lines


def _line_of(
    path: tuple[str | int, ...], lines: Mapping[tuple[str | int, ...], int]
) -> tuple[int | None, int]:
    """Return the line of the closest enclosing key or table, and how much of the path has lines."""
    prefixes = {known[:length] for known in lines for length in range(1, len(known) + 1)}
    length, best = 0, None
    while length < len(path) and path[: length + 1] in prefixes:
        length += 1
        best = lines.get(path[:length], best)
    return best, length


def _without_single_entries(
    path: tuple[str | int, ...], lines: Mapping[tuple[str | int, ...], int]
) -> tuple[str | int, ...]:
    """Return the path of a place as it is written where a list of one entry is written as a table."""
    written: tuple[str | int, ...] = ()
    for part in path:
        entry = (*written, part)
        if part == 0 and isinstance(part, int) and any(_is_below(known, written) for known in lines):
            continue
        written = entry
    return written


def _is_below(known: tuple[str | int, ...], table: tuple[str | int, ...]) -> bool:
    """Return whether a line is one of a key of a table, and not of an entry of a list."""
    return (
        len(known) > len(table)
        and known[: len(table)] == table
        and isinstance(known[len(table)], str)
        and bool(table)
    )


def place_of(path: tuple[str | int, ...], text: str) -> str:
    """Return where a key stands in a TOML text, e.g. ``line 12: limits.force_trip_kN``, and which entry of a
    list, if the line does not say; the key alone if it is not written there.
    """
    lines = _lines_of_keys(text)
    path = _without_single_entries(path, lines)
    line, length = _line_of(path, lines)
    key = ".".join(str(part) for part in path if not isinstance(part, int)) or "(file)"
    entries = [str(part + 1) for part in path[length:] if isinstance(part, int)]
    entry = f" (entry {', '.join(entries)})" if entries else ""
    return f"line {line}: {key}{entry}" if line else f"{key}{entry}"
