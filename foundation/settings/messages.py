"""Turns pydantic's errors in a settings file into one plain message: place, problem, remedy."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from datetime import date
from typing import Any

from pydantic import BaseModel, ValidationError

from bufferstand.foundation.settings.allowed_values import (
    FindingPlace,
    alternatives,
    fields_by_key,
    find,
    tag_values,
)
from bufferstand.foundation.settings.wrong_key import Place, WrongKeyError

LONGEST_SHOWN = 60
"""Of a text that is wrong, so many characters are shown."""
NEAR = 0.5
"""How alike two keys must be for one to be meant by the other (difflib's ratio)."""

_WRONG = {
    "greater_than": "is too small",
    "greater_than_equal": "is too small",
    "less_than": "is too large",
    "less_than_equal": "is too large",
    "finite_number": "is no finite number",
    "int_from_float": "is no whole number",
    "literal_error": "is not known here",
    "string_pattern_mismatch": "does not have the form that is wanted here",
}
"""What is wrong with a value, by pydantic's name of the error."""

Finding = Mapping[str, Any]


class ValidationMessage:
    """One finding of a validation.

    Parameters
    ----------
    tried : sequence of (mapping, FindingPlace)
        What pydantic found for each type that was tried on one value. The one that led furthest was meant.
    within : tuple of str and int
        Where in the file the validated table lies, if it is not the file itself.
    """

    def __init__(
        self, tried: Sequence[tuple[Finding, FindingPlace]], within: tuple[str | int, ...] = ()
    ) -> None:
        self._finding, self._found = max(tried, key=lambda pair: len(pair[1].path))
        self.path = (*within, *self._found.path, *self._tag_at_fault(), *_key_at_fault(self._finding))

    @property
    def is_unknown_key(self) -> bool:
        """Whether it is a key that the table does not have."""
        return bool(self._finding["type"] == "extra_forbidden")

    @property
    def is_missing(self) -> bool:
        """Whether a key is not there."""
        return bool(self._finding["type"] == "missing")

    @property
    def meant(self) -> tuple[str | int, ...]:
        """The key that was probably meant by an unknown one; empty where none was."""
        near = nearest_key(str(self.path[-1]), self._known()) if self.is_unknown_key else ""
        return (*self.path[:-1], near) if near else ()

    def _known(self) -> list[str]:
        """Return the keys of the table in which it was found."""
        model = self._found.spot.model
        return [] if model is None else sorted(fields_by_key(model))

    def said(self) -> tuple[str, str]:
        """Return what is wrong and what to do."""
        kind, value = str(self._finding["type"]), self._finding.get("input")
        if kind == "extra_forbidden":
            return self._unknown_key()
        if kind in ("union_tag_invalid", "union_tag_not_found"):
            return self._unknown_tag()
        if kind == "value_error":
            return _own_words(str(self._finding["ctx"]["error"]), value)
        if kind == "missing" and not _lacks_entry(self._finding):
            return "this key is missing", f"add it: {self._wanted()}"
        return _wrong(kind, value), f"write {self._wanted()}"

    def _wanted(self) -> str:
        """Return what to write, tables with the heads under which they are written."""
        found = self._found
        spot = found.offered if found.offered is not None and found.path == found.choice else found.spot
        name = ".".join(key for key in found.path if isinstance(key, str))
        item = spot.item()
        if item is not None and (item.model is not None or item.tag):
            return f"one or more tables, each under [[{name}]]"
        under_a_head = spot.model is not None and isinstance(found.path[-1], str)
        return f"a table under [{name}]" if under_a_head else spot.words()

    def _unknown_key(self) -> tuple[str, str]:
        """Return what is said of a key that the table does not have: which kind has it, or what is alike."""
        key, found = str(self._found.path[-1]), self._found
        own = self._known()
        listed = f"known here: {', '.join(own)}"
        if found.tag:
            kind = ", ".join(tag_values(found.spot, found.tag))
            listed = f"keys of “{kind}”: {', '.join(own)}"
            if who := _who_has(key, found):
                return f"{found.tag} = “{kind}” has no key “{key}”", f"{who}; {listed}"
        near = nearest_key(key, own)
        return f"unknown key “{key}”", f"did you mean “{near}”?" if near else f"remove it; {listed}"

    def _tag_at_fault(self) -> tuple[str, ...]:
        """Return the key that names a kind, where it names one that is not there."""
        tag, given = self._found.spot.tag, self._finding.get("input")
        is_unknown = self._finding["type"] == "union_tag_invalid"
        return (tag,) if is_unknown and isinstance(given, dict) and tag in given else ()

    def _unknown_tag(self) -> tuple[str, str]:
        found = self._found
        tag = found.spot.tag
        known = [value for choice in found.spot.choices() for value in tag_values(choice, tag)]
        given = self._finding["input"]
        if not isinstance(given, dict) or tag not in given:
            return f"the key {tag} is missing", f"add {tag} = {alternatives(known)}"
        near = nearest_key(str(given[tag]), known)
        hint = f"; did you mean “{near}”?" if near else ""
        return f"{tag} = {shown(given[tag])} is not known", f"write {alternatives(known)}{hint}"


def findings(
    error: ValidationError, schema: type[BaseModel], within: tuple[str | int, ...] = ()
) -> list[ValidationMessage]:
    """Return all that a validation found; unknown keys first, since a key that is missing may be one of them.

    Parameters
    ----------
    error : ValidationError
        What pydantic found.
    schema : type
        Of what was validated.
    within : tuple of str and int
        Where in the file that lies, if it is not the file itself.
    """
    groups: dict[tuple[str | int, ...], list[tuple[Finding, FindingPlace]]] = {}
    for one in error.errors(include_url=False):
        found = find(schema, _location(one))
        # All types that were tried on one value are one finding.
        groups.setdefault(found.choice or found.path, []).append((one, found))
    said: list[ValidationMessage] = []
    for tried in groups.values():
        message = ValidationMessage(tried, within)
        # What is said of a list and of what lies in it has one reason.
        if not any(other.path[: len(message.path)] == message.path[: len(other.path)] for other in said):
            said.append(message)
    meant = {one.meant for one in said}
    said = [one for one in said if not (one.is_missing and one.path in meant)]
    return sorted(said, key=lambda one: not one.is_unknown_key)


def nearest_key(key: str, known: Sequence[str]) -> str:
    """Return the known key that was probably meant, empty if none is near: one of which only the unit is
    missing goes before one that is spelled alike.
    """
    begun = [one for one in known if one.startswith(f"{key}_")]
    near = begun or difflib.get_close_matches(key, known, n=1, cutoff=NEAR)
    return near[0] if near else ""


def _who_has(key: str, found: FindingPlace) -> str:
    """Return which tables of other kinds have a key, empty if none."""
    others = [kind for kind in found.kinds if kind.model is not None and kind.model is not found.spot.model]
    having = [kind for kind in others if kind.key(key) is not None]
    if len(having) == len(others) > 1:
        return "every other kind has it"
    names = [name for kind in having for name in tag_values(kind, found.tag)]
    return f"it is a key of {', '.join(names)}" if names else ""


def shown(value: object) -> str:
    """Return a value as a person calls it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        text = value if len(value) <= LONGEST_SHOWN else f"{value[:LONGEST_SHOWN]}…"
        return f"“{text}”"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)} entr{'y' if len(value) == 1 else 'ies'}"
    if isinstance(value, dict | BaseModel):
        return "a table"
    return value.isoformat() if isinstance(value, date) else repr(value)


def _lacks_entry(finding: Finding) -> bool:
    """Return whether a list is too short: pydantic calls the entry that is not there missing."""
    return finding["type"] == "missing" and isinstance(finding["loc"][-1], int)


def _location(finding: Finding) -> tuple[str | int, ...]:
    location: tuple[str | int, ...] = finding["loc"]
    return location[:-1] if _lacks_entry(finding) else location


def _own_words(text: str, value: object) -> tuple[str, str]:
    """Return a message of the house's own checks; “; ” divides what is wrong from what to do."""
    problem, _, remedy = text.partition("; ")
    if isinstance(value, dict | list | tuple | BaseModel):
        return problem, remedy
    return f"{problem} (got {shown(value)})", remedy


def _key_at_fault(finding: Finding) -> Place:
    """Return the key at fault where a check of ours on a whole table says it, and it is written there."""
    written, error = finding.get("input"), finding.get("ctx", {}).get("error")
    return error.place(written) if isinstance(error, WrongKeyError) and isinstance(written, dict) else ()


def _wrong(kind: str, value: object) -> str:
    """Return what is wrong with a value; of the wrong type or length it is just not possible."""
    if kind == "string_too_short":
        return "the text is empty"
    return f"{shown(value)} {_WRONG.get(kind, 'is not possible here')}"
