"""Reading the program's own JSON back: every value is of its type before anything is made of it."""

from __future__ import annotations

import json
from collections.abc import Hashable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files.json_text import json_object
from bufferstand.foundation.files.trees import out_of_form

LARGEST = 1e15
"""No number that is kept of a campaign is larger: seconds, joules, counts."""
_LONGEST = 40
"""Characters of a wrong value that are shown."""

T = TypeVar("T")


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
    if (wrong := out_of_form(content, largest=LARGEST)) is not None:
        key = ".".join(str(part) for part in wrong.path)
        raise BadInput(f"{key}: {wrong.problem}", file=file, place=place, remedy=remedy)
    try:
        found: T = _adapter(kind).validate_json(json.dumps(content), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"]) or "it"
        said = str(first["msg"]).replace("Input should be", "it should be")
        given = "" if first["type"] == "missing" else f" = {_shown(first['input'])}"
        raise BadInput(f"{key}{given}: {said}", file=file, place=place, remedy=remedy) from None
    return found


@cache
def _adapter(kind: Hashable) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _shown(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
