"""Reading the program's own JSON back: every value is of its type before anything is made of it."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files.json_text import json_object
from bufferstand.foundation.files.trees import out_of_form

if TYPE_CHECKING:  # loaded when something is read: a command's help does without
    from pydantic import TypeAdapter

LARGEST = 1e15
"""No number that is kept of a campaign is larger: seconds, joules, counts."""
_LONGEST = 40
"""Characters of a wrong value that are shown."""

T = TypeVar("T")


class MistypedError(ValueError):
    """A value of a document is not what it must be; the text says which, and what it should be."""


def typed_json(kind: type[T], text: str | bytes, file: Path, *, place: str = "", remedy: str = "") -> T:
    """Return what a JSON text of a file says, as a dataclass or another type with annotations.

    Parameters
    ----------
    kind : type
        What it is: lists become tuples, objects dataclasses, as its annotations say; nothing else is changed.
    text : str or bytes
        The JSON.
    file, place, remedy : Path, str, str
        For the message.

    Raises
    ------
    BadInput
        If it is no JSON object (:func:`bufferstand.foundation.files.json_text.json_object`), or a value in
        it is missing or of another type.
    """
    content = json_object(text, file, place=place, remedy=remedy)
    return typed(kind, content, file, place=place, remedy=remedy)


def typed(kind: type[T], content: Any, file: Path, *, place: str = "", remedy: str = "") -> T:
    """Return what a JSON document says (:func:`typed_json`), once it was read.

    Raises
    ------
    BadInput
        As :func:`typed_json`.
    """
    try:
        return of_type(kind, content)
    except MistypedError as error:
        raise BadInput(str(error), file=file, place=place, remedy=remedy) from None


def of_type(kind: type[T], content: Any, largest: float = LARGEST) -> T:
    """Return a JSON document as a dataclass or another type with annotations.

    Parameters
    ----------
    kind : type
        As of :func:`typed_json`.
    content : object
        What a reader of JSON gives.
    largest : float
        Greatest amount of a number.

    Raises
    ------
    MistypedError
        If a value in it is missing, of another type, or a number that is too large.
    """
    from pydantic import ValidationError  # noqa: PLC0415 - as above

    if (wrong := out_of_form(content, largest=largest)) is not None:
        raise MistypedError(f"{'.'.join(map(str, wrong.path))}: {wrong.problem}")
    try:
        found: T = _adapter(cast("Any", kind)).validate_json(json.dumps(content), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"]) or "it"
        said = str(first["msg"]).replace("Input should be", "it should be")
        given = "" if first["type"] == "missing" else f" = {_shown(first['input'])}"
        raise MistypedError(f"{key}{given}: {said}") from None
    return found


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    from pydantic import TypeAdapter  # noqa: PLC0415 - as above

    return TypeAdapter(kind)


def _shown(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
