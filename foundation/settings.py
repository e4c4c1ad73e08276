"""Settings from TOML files: strict schemas, and messages that name file, line, key and remedy."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Mapping, Sequence
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from foundation.errors import BadInput


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


def _line_of(location: tuple[str | int, ...], lines: dict[tuple[str | int, ...], int]) -> int | None:
    """Return the line of the closest enclosing key; pydantic's union tags are skipped."""
    prefixes = {path[:length] for path in lines for length in range(1, len(path) + 1)}
    kept: tuple[str | int, ...] = ()
    best: int | None = None
    for part in location:
        if (*kept, part) in prefixes:
            kept = (*kept, part)
            best = lines.get(kept, best)
    return best


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    """Return every schema that an annotation (union, list, optional …) can stand for."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in getattr(annotation, "__args__", ()) for model in _models_in(part)]


def _known_keys(schema: type[BaseModel], location: tuple[str | int, ...]) -> list[str]:
    """Return the keys that the schema knows in the table of an unknown one."""
    models = [schema]
    for part in location[:-1]:
        inner = [
            model
            for outer in models
            if part in outer.model_fields
            for model in _models_in(outer.model_fields[str(part)].annotation)
        ]
        models = inner or models  # a position in a list or a union's tag leads no deeper
    return sorted({key for model in models for key in model.model_fields})


_WORDS_OF_TYPE = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "string_type": "a text",
    "bool_type": "true or false",
}


def _alternatives(
    findings: Sequence[Mapping[str, Any]], location: tuple[str | int, ...], known_keys: Sequence[str]
) -> str:
    """Return what a key may be, where pydantic tried several types on it and none fits; else nothing.

    Each alternative is a finding of its own, at the key's place and one part more: the type's name.
    """
    if isinstance(location[-1], int) or location[-1] in known_keys:
        return ""
    key = location[:-1]
    tried = [f for f in findings if tuple(f["loc"])[: len(key)] == key and len(f["loc"]) == len(location)]
    if len(tried) < 2 or any(f["input"] is not tried[0]["input"] for f in tried):
        return ""
    words: list[str] = []
    for finding in tried:
        if finding["type"] == "literal_error":
            words += str(finding["ctx"]["expected"]).replace(" or ", ", ").split(", ")
        else:
            expected = finding["msg"].removeprefix("Input should be ")
            words.append(_WORDS_OF_TYPE.get(finding["type"], expected))
    *others, last = dict.fromkeys(words)
    return f"must be {', '.join(others)} or {last}" if others else f"must be {last}"


def _explain(error: ValidationError, schema: type[BaseModel], path: Path, text: str) -> BadInput:
    """Turn the first finding into one message; the others are counted."""
    lines = _lines_of_keys(text)
    findings = error.errors(include_url=False)
    first = next((f for f in findings if f["type"] == "extra_forbidden"), findings[0])
    location = tuple(first["loc"])
    line = _line_of(location, lines)
    key = ".".join(str(part) for part in location if not isinstance(part, int)) or "(file)"
    remedy = ""
    if first["type"] == "extra_forbidden":
        problem = f"unknown key “{location[-1]}”"
        near = difflib.get_close_matches(str(location[-1]), _known_keys(schema, location), n=1, cutoff=0.5)
        remedy = (
            f"did you mean “{near[0]}”?" if near else "remove it, or see the docs for the keys of this table"
        )
    elif first["type"] == "missing":
        problem = "this key is missing"
        remedy = "add it"
    elif location[-1:] and (alternatives := _alternatives(findings, location, _known_keys(schema, location))):
        problem = f"{alternatives} (got {first['input']!r})"
        key = ".".join(str(part) for part in location[:-1] if not isinstance(part, int))
        findings = [f for f in findings if tuple(f["loc"])[: len(location) - 1] != location[:-1]] + [first]
    else:
        shown = "" if isinstance(first.get("input"), dict | list) else f" (got {first.get('input')!r})"
        problem = first["msg"].removeprefix("Value error, ") + shown
    if len(findings) > 1:
        problem += f" [and {len(findings) - 1} more in this file]"
    place = f"line {line}: {key}" if line else key
    return BadInput(problem, file=path, place=place, remedy=remedy)


def parse_settings(text: str, schema: type[SchemaT], path: Path) -> SchemaT:
    """Return the settings that a TOML text holds; ``path`` is only named in messages.

    Raises
    ------
    BadInput
        If it is no TOML, or a key is unknown, missing or has a value that cannot be.
    """
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput(f"not valid TOML: {error}", file=path, remedy="mend the syntax at that line") from None
    try:
        return schema.model_validate(content)
    except ValidationError as error:
        raise _explain(error, schema, path, text) from None


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
