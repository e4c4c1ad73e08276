"""Settings from TOML files: strict schemas, and messages that name file, line, key and remedy."""

from __future__ import annotations

import os
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.bounds import first_breach
from bufferstand.foundation.settings.file_kinds import mistaken_for
from bufferstand.foundation.settings.messages import findings
from bufferstand.foundation.settings.places import place_of
from bufferstand.foundation.settings.toml_text import LONGEST_SETTINGS, NotToml, toml_content


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

LONGEST_TEXT = 128 << 20
"""Bytes of a text file: an evaluation of a thousand runs has some 30 million."""

SchemaT = TypeVar("SchemaT", bound=BaseModel)


def refusal(
    error: ValidationError,
    schema: type[BaseModel],
    path: Path,
    text: str,
    within: tuple[str | int, ...] = (),
) -> BadInput:
    """Return what a validation found, as one message; or which kind of file it is, if it is another.

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
    if not within and (other := mistaken_for(schema.__name__, toml_content(text))):
        return BadInput(other, file=path, remedy="check the path")
    said = []
    for finding in findings(error, schema, within):
        problem, remedy = finding.said()
        said.append(BadInput(problem, file=path, place=place_of(finding.path, text), remedy=remedy))
    return said[0].with_more(said[1:])


def toml_document(text: str, path: Path) -> dict[str, Any]:
    """Return what a TOML text says; ``path`` is only named in messages.

    Raises
    ------
    BadInput
        If it is no TOML (:func:`bufferstand.foundation.settings.toml_text.toml_content`).
    """
    try:
        return toml_content(text)
    except NotToml as error:
        place = place_of(error.path, text) if error.path else ""
        raise BadInput(error.problem, file=path, place=place, remedy=error.remedy) from None


def parse_settings(text: str, schema: type[SchemaT], path: Path) -> SchemaT:
    """Return the settings that a TOML text holds; ``path`` is only named in messages.

    Raises
    ------
    BadInput
        If it is no TOML, or a key is unknown, missing, has a value that cannot be, or one outside its bounds.
    """
    try:
        settings = schema.model_validate(toml_document(text, path))
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
        raise BadInput(problem, file=path, place=place_of((*within, *breach.path), text), remedy=remedy)


def demand_named(named: Path, named_in: Path, key: tuple[str | int, ...]) -> Path:
    """Return the path of a file that another one names; refuse it at that key if it is not there.

    Parameters
    ----------
    named : Path
        The file.
    named_in : Path
        The settings file that names it.
    key : tuple of str and int
        The key that does.

    Raises
    ------
    BadInput
        If there is no such file.
    """
    if not os.path.exists(named):  # noqa: PTH110 - also of a name that no file can have
        place = place_of(key, read_text(named_in)) if named_in.is_file() else ".".join(map(str, key))
        raise BadInput(
            f"it names {named}, and there is no such file",
            file=named_in,
            place=place,
            remedy="mend the path, which starts from the folder of this file",
        )
    return named


def read_text(path: Path, longest: int = LONGEST_TEXT) -> str:
    """Return a text file's content.

    Parameters
    ----------
    path : Path
        The file.
    longest : int
        Bytes that it may have.

    Raises
    ------
    BadInput
        If it does not exist, cannot be read, is too long or is not UTF-8.
    """
    try:
        with path.open("rb") as stream:  # a device, or a file that grows, has no end
            content = stream.read(longest + 1)
        if len(content) > longest:
            raise BadInput(f"longer than {longest} bytes", file=path, remedy="check the path")
        text = content.decode("utf-8-sig")  # Windows' editors put a mark before the first line
        return text.replace("\r\n", "\n").replace("\r", "\n")
    except FileNotFoundError:
        raise BadInput("no such file", file=path, remedy="check the path") from None
    except UnicodeDecodeError as error:
        raise BadInput(f"not UTF-8 text (byte {error.start})", file=path, remedy="save it as UTF-8") from None
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path) from None
    except ValueError:  # a NUL in it
        raise BadInput("no file can have this name", file=repr(str(path)), remedy="check the path") from None


def load_settings(path: Path, schema: type[SchemaT]) -> SchemaT:
    """Read a TOML file into its schema.

    Raises
    ------
    BadInput
        As :func:`read_text` and :func:`parse_settings`.
    """
    return parse_settings(read_text(path, LONGEST_SETTINGS), schema, path)


def load_shipped_or_own(
    name: str, schema: type[SchemaT], *, folder: Path, shipped: Path, what: str, place: str = ""
) -> SchemaT:
    """Read a file by the name of a shipped one, or one of the user's own.

    Parameters
    ----------
    name : str
        A name without ending, or a path that ends in ``.toml``.
    schema : type
    folder : Path
        Where a relative path starts from.
    shipped : Path
        Folder of the shipped ones.
    what : str
        Says in a message what there is none of: it has ``{name}`` for the name.
    place : str
        The key that names it, for that message.

    Raises
    ------
    BadInput
        If there is none, or it breaks its schema.
    """
    if name.endswith(".toml"):
        return load_settings(folder / name, schema)
    path = shipped / f"{name}.toml"
    if not os.path.isfile(path):  # noqa: PTH113 - also of a name that no file can have
        names = ", ".join(shipped_names(shipped))
        raise BadInput(
            what.format(name=name),
            place=place,
            remedy=f"shipped: {names}; a file of your own must end in .toml",
        )
    return load_settings(path, schema)


def shipped_names(shipped: Path) -> tuple[str, ...]:
    """Return the names of the files in a folder of shipped ones."""
    return tuple(sorted(path.stem for path in shipped.glob("*.toml")))
