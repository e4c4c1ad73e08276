"""Whole contents in a language: every text of plain data, whatever its shape."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

from bufferstand.evaluation.wording.language import Language
from bufferstand.evaluation.wording.texts import Worded

_Plain = TypeVar("_Plain")


def spoken(value: _Plain, language: Language) -> _Plain:
    """Return plain data with its texts in a language.

    Parameters
    ----------
    value : dataclass, tuple, str or anything else
        Dataclasses and tuples are gone through; what is neither they nor a text stays what it is. Plain
        texts of a dataclass with ``as_given`` stay as they are.
    language : Language
        The language.

    Returns
    -------
    the same type
        The same object where nothing in it is to be said otherwise.
    """
    if language.is_plain:
        return value
    said: Any = _said(value, language)
    return said  # type: ignore[no-any-return]


def _said(value: Any, language: Language, *, given: bool = False) -> Any:
    if isinstance(value, str):
        return value if given and not isinstance(value, Worded) else language.say(value)
    if isinstance(value, tuple):
        parts = tuple(_said(part, language, given=given) for part in value)
        return value if all(new is old for new, old in zip(parts, value, strict=True)) else parts
    if is_dataclass(value) and not isinstance(value, type):
        given = given or getattr(value, "as_given", False)
        changed = {}
        for one in fields(value):
            old = getattr(value, one.name)
            if (new := _said(old, language, given=given)) is not old:
                changed[one.name] = new
        if getattr(value, "tone", None) == "number" and hasattr(value, "text"):
            changed["text"] = language.numeral(language.say(value.text))
        return replace(value, **changed) if changed else value
    return value
