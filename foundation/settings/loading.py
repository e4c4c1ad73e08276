"""Settings from TOML files: strict schemas, and messages that name file, line, key and remedy."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Annotated, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.bounds import first_breach
from bufferstand.foundation.settings.messages import ValidationMessage


class Settings(BaseModel):
    """Base of every schema: strict, frozen, and an unknown key is an error."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


def _as_datetime(value: object) -> object:
    if isinstance(value, str):
        try:
            value = datetime.fromisoformat(value)
        except ValueError:
            raise ValueError("not a date and time; write it as 2026-03-05T14:02:11Z") from None
    if isinstance(value, datetime) and value.tzinfo is None:
        value = value.replace(tzinfo=UTC)
    return value


def _as_date(value: object) -> object:
    try:
        return date.fromisoformat(value) if isinstance(value, str) else value
    except ValueError:
        raise ValueError("not a date; write it as 2026-03-05") from None


Moment = Annotated[datetime, BeforeValidator(_as_datetime)]
"""A date and time: ISO 8601 text or a TOML date-time; without a zone it is taken as UTC."""
Day = Annotated[date, BeforeValidator(_as_date)]
"""A date: ISO 8601 text or a TOML date."""
Numbers = Annotated[tuple[float, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]
"""A TOML array of numbers."""

SchemaT = TypeVar("SchemaT", bound=BaseModel)

_HEADER = re.compile(r"^\s*\[(\[)?\s*([A-Za-z0-9_.\"' -]+?)\s*\]?\]\s*(#.*)?$")
_KEY = re.compile(r"^\s*([A-Za-z0-9_.\"'-]+)\s*=")


def _lines_of_keys(text: str) -> dict[tuple[str | int, ...], int]:
    """Map each table and key path of a TOML text to its line (from 1)."""
    lines: dict[tuple[str | int, ...], int] = {}
    counts: dict[tuple[str | int, ...], int] = {}
    table: tuple[str | int, ...] = ()
    for number, line in enumerate(text.splitlines(), start=1):
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


def _place(path: tuple[str | int, ...], text: str) -> str:
    """Return where it is: the line, the key, and which entry of a list, if the line does not say."""
    lines = _lines_of_keys(text)
    path = _without_single_entries(path, lines)
    line, length = _line_of(path, lines)
    key = ".".join(str(part) for part in path if not isinstance(part, int)) or "(file)"
    entries = [str(part + 1) for part in path[length:] if isinstance(part, int)]
    entry = f" (entry {', '.join(entries)})" if entries else ""
    return f"line {line}: {key}{entry}" if line else f"{key}{entry}"


def refusal(
    error: ValidationError,
    schema: type[BaseModel],
    path: Path,
    text: str,
    within: tuple[str | int, ...] = (),
) -> BadInput:
    """Return what a validation found, as one message: the first finding; the others are counted.

    Parameters
    ----------
    error : ValidationError
        What pydantic found.
    schema : type
        Of what was validated.
    path : Path
        The file, for the message.
    text : str
        Its text, for the lines.
    within : tuple of str and int
        The table that was validated, if it was not the whole file.
    """
    complaint = ValidationMessage(error, schema, within)
    problem, remedy = complaint.said()
    if complaint.others:
        problem += f" [and {complaint.others} more in this file]"
    return BadInput(problem, file=path, place=_place(complaint.path, text), remedy=remedy)


def parse_settings(text: str, schema: type[SchemaT], path: Path) -> SchemaT:
    """Return the settings that a TOML text holds; ``path`` is only named in messages.

    Raises
    ------
    BadInput
        If it is no TOML, or a key is unknown, missing, has a value that cannot be, or one outside its bounds.
    """
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput(f"not valid TOML: {error}", file=path, remedy="mend the syntax at that line") from None
    try:
        settings = schema.model_validate(content)
    except ValidationError as error:
        raise refusal(error, schema, path, text) from None
    demand_within(settings, path, text)
    return settings


def demand_within(settings: BaseModel, path: Path, text: str, within: tuple[str | int, ...] = ()) -> None:
    """Refuse a number outside the bounds that its key has in files.

    Parameters
    ----------
    settings : BaseModel
        What the file holds.
    path, text, within
        As of :func:`refusal`.

    Raises
    ------
    BadInput
        With place, value, bound and its reason.
    """
    if (breach := first_breach(settings)) is not None:
        problem, remedy = breach.said()
        raise BadInput(problem, file=path, place=_place((*within, *breach.path), text), remedy=remedy)


def place_of(path: tuple[str | int, ...], text: str) -> str:
    """Return where a key stands in a TOML text, e.g. ``line 12: limits.force_trip_kN``; the key alone if it
    is not written there.
    """
    return _place(path, text)


def read_text(path: Path) -> str:
    """Return a text file's content.

    Raises
    ------
    BadInput
        If it does not exist, cannot be read or is not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig")  # Windows' editors put a mark before the first line
    except FileNotFoundError:
        raise BadInput("no such file", file=path, remedy="check the path") from None
    except UnicodeDecodeError as error:
        raise BadInput(f"not UTF-8 text (byte {error.start})", file=path, remedy="save it as UTF-8") from None
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path) from None


def load_settings(path: Path, schema: type[SchemaT]) -> SchemaT:
    """Read a TOML file into its schema.

    Raises
    ------
    BadInput
        As :func:`read_text` and :func:`parse_settings`.
    """
    return parse_settings(read_text(path), schema, path)
