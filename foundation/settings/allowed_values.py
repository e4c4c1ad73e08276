"""The values that a place of a settings file allows, in words, from its schema."""

from __future__ import annotations

import types
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import annotated_types as at
from pydantic import BaseModel
from pydantic.fields import FieldInfo

_UNIONS = (Union, types.UnionType)
OPEN_TABLES = (dict, Mapping)
"""Tables whose keys are the user's own."""
_ONE = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text in quotes",
    datetime: "a date and time such as 2026-03-05T14:02:11Z",
    date: "a date such as 2026-03-05",
}
_MANY = {int: "whole numbers", float: "numbers", str: "texts in quotes"}
_COUNT = {1: "one", 2: "two", 3: "three"}


@dataclass(frozen=True)
class Within:
    """Least and greatest value of a number in a file that somebody writes, and the reason, as ``Annotated``
    metadata of the key; of a list's entries where it stands at the list.
    """

    low: float
    high: float
    why: str

    def range_text(self) -> str:
        """Return what to write, e.g. “a number from 0.5 to 20”."""
        return f"a number from {self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class SchemaPlace:
    """A place in a schema.

    Parameters
    ----------
    annotation : Any
        The type of what may stand there, without ``Annotated`` and without None.
    bounds : tuple
        Limits of value and length, as the schema states them.
    form : str
        The schema's own words for a text of a certain form.
    tag : str
        The key whose value decides between tables of several kinds; empty where none does.
    """

    annotation: Any
    bounds: tuple[Any, ...] = ()
    form: str = ""
    tag: str = ""

    def choices(self) -> tuple[SchemaPlace, ...]:
        """Return what it can be, each as a place of its own; itself where there is no choice."""
        if get_origin(self.annotation) not in _UNIONS:
            return (self,)
        return tuple(
            choice
            for part in get_args(self.annotation)
            if part is not type(None)
            for choice in spot_of(part).choices()
        )

    @property
    def withins(self) -> tuple[Within, ...]:
        """The bounds of files that are stated here."""
        return tuple(bound for bound in self.bounds if isinstance(bound, Within))

    @property
    def model(self) -> type[BaseModel] | None:
        """Return the schema of a table; None for anything else."""
        found = self.annotation
        return found if isinstance(found, type) and issubclass(found, BaseModel) else None

    def key(self, name: str) -> SchemaPlace | None:
        """Return the place of a key in a table; None where the schema has no such key."""
        if self.model is None:
            values = get_args(self.annotation)
            return spot_of(values[1]) if get_origin(self.annotation) in OPEN_TABLES else None
        found = fields_by_key(self.model).get(name)
        return None if found is None else _simple(found.annotation, _flat([*found.metadata, found]))

    def item(self) -> SchemaPlace | None:
        """Return the place of an entry of a list; None for anything else."""
        if get_origin(self.annotation) not in (tuple, list):
            return None
        return spot_of(get_args(self.annotation)[0])

    def words(self) -> str:
        """Return what to write there, e.g. “a number greater than 0, at most 20”."""
        choices = self.choices()
        if len(choices) > 1 and not self.tag:
            each = [
                word
                for choice in choices
                for word in (
                    _quoted(get_args(choice.annotation))
                    if get_origin(choice.annotation) is Literal
                    else [choice.words()]
                )
            ]
            return _or(list(dict.fromkeys(each)))
        kind = self.annotation
        if get_origin(kind) is Literal:
            return alternatives(get_args(kind))
        if get_origin(kind) in (tuple, list):
            return self._list_words()
        if self.model is not None or self.tag or get_origin(kind) in OPEN_TABLES:
            return "a table of keys"
        if kind is str:
            return self.form or ("a text that is not empty" if self.bounds else _ONE[str])
        return " ".join(part for part in (_ONE.get(kind, "another value"), _bounds(self.bounds)) if part)

    def _list_words(self) -> str:
        parts = get_args(self.annotation)
        if parts[-1] is not ... and get_origin(self.annotation) is tuple:
            count = _COUNT.get(len(parts), str(len(parts)))
            return f"{count} {_MANY.get(parts[0], 'values')} in brackets, such as [1.0, 2.0]"
        item = spot_of(parts[0])
        least = next((bound.min_length for bound in self.bounds if isinstance(bound, at.MinLen)), 0)
        some = f"a list of {_COUNT.get(least, str(least))} or more" if least else "a list of"
        if item.model is not None or item.tag:
            return f"{some} tables"
        if get_origin(item.annotation) is tuple:
            return f"{some} pairs of numbers, such as [[0.0, 1.0], [2.0, 3.0]]"
        return " ".join(
            part for part in (some, _MANY.get(item.annotation, "values"), _bounds(item.bounds)) if part
        )


@dataclass(frozen=True)
class FindingPlace:
    """Where a finding lies.

    Parameters
    ----------
    path : tuple of str and int
        Keys and positions (from 0), as they are written in the file.
    spot : Spot
        What may stand there; of an unknown key, the table that does not have it.
    choice : tuple of str and int or None
        The place at which several types were tried, of which this finding is about one.
    offered : Spot or None
        All of those types.
    kinds : tuple of Spot
        The tables of all kinds between which a key of this table decides.
    tag : str
        That key.
    """

    path: tuple[str | int, ...]
    spot: SchemaPlace
    choice: tuple[str | int, ...] | None = None
    offered: SchemaPlace | None = None
    kinds: tuple[SchemaPlace, ...] = field(default=())
    tag: str = ""


def find(schema: type[BaseModel], location: Sequence[str | int]) -> FindingPlace:
    """Return where a location of pydantic's lies; the names that it puts in for types and tags are left out.

    Parameters
    ----------
    schema : type
        Of the whole file.
    location : sequence of str and int
        As pydantic gives it.
    """
    found = FindingPlace((), SchemaPlace(schema))
    for part in location:
        choices = found.spot.choices()
        if len(choices) > 1:  # pydantic names the one that it tried, where nobody has written anything
            found = _chosen(found, choices, str(part))
            continue
        spot = found.spot.item() if isinstance(part, int) else found.spot.key(part)
        kept = found if spot is None else FindingPlace((), spot, found.choice, found.offered)
        found = FindingPlace((*found.path, part), kept.spot, kept.choice, kept.offered, kept.kinds, kept.tag)
        if spot is None:
            break
    return found


def spot_of(annotation: Any) -> SchemaPlace:
    """Return the place that an annotation describes."""
    return _simple(annotation, [])


def fields_by_key(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return the fields of a schema by the keys that users write."""
    return {info.alias or name: info for name, info in model.model_fields.items()}


def tag_values(spot: SchemaPlace, tag: str) -> tuple[str, ...]:
    """Return the values of the deciding key that a table of one kind has."""
    place = spot.key(tag)
    return () if place is None else tuple(str(value) for value in get_args(place.annotation))


def alternatives(values: Sequence[object]) -> str:
    """Return e.g. “a”, “b” or “c”."""
    return _or(_quoted(values))


def _quoted(values: Sequence[object]) -> list[str]:
    return [f"“{value}”" if isinstance(value, str) else str(value) for value in values]


def _or(words: Sequence[str]) -> str:
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else last


def _chosen(found: FindingPlace, choices: Sequence[SchemaPlace], label: str) -> FindingPlace:
    """Return the place under the one of several types that pydantic calls ``label``."""
    for choice in choices:
        if choice.model is not None and (
            label == choice.model.__name__ or label in tag_values(choice, found.spot.tag)
        ):
            return FindingPlace(
                found.path, choice, found.choice, found.offered, tuple(choices), found.spot.tag
            )  # of several kinds
    lists = [choice for choice in choices if choice.item() is not None]
    spot = lists[0] if lists and label.startswith(("tuple", "list")) else SchemaPlace(object)
    return FindingPlace(found.path, spot, found.path, found.spot)


def _simple(annotation: Any, metadata: list[Any]) -> SchemaPlace:
    """Return a place without ``Annotated`` and without None, with what was said there."""
    while True:
        if get_origin(annotation) is Annotated:
            metadata = [*metadata, *_flat(annotation.__metadata__)]
            annotation = annotation.__origin__
            continue
        parts = [part for part in get_args(annotation) if part is not type(None)]
        if get_origin(annotation) in _UNIONS and len(parts) == 1:
            annotation = parts[0]
            continue
        break
    infos = [one for one in metadata if isinstance(one, FieldInfo)]
    bounds = tuple(
        one for one in metadata if isinstance(one, at.Gt | at.Ge | at.Lt | at.Le | at.MinLen | Within)
    )
    form = next((one.description for one in infos if one.description), "")
    tag = next((one.discriminator for one in infos if isinstance(one.discriminator, str)), "")
    return SchemaPlace(annotation, bounds, form, tag)


def _flat(metadata: Sequence[Any]) -> list[Any]:
    """Return metadata with what a nested ``Field(…)`` says among it."""
    return [
        inner
        for one in metadata
        for inner in ((one, *one.metadata) if isinstance(one, FieldInfo) else (one,))
    ]


def _bounds(bounds: Sequence[Any]) -> str:
    """Return limits of a value in words, with the reason if one is stated; empty where there are none."""
    if within := next((bound for bound in bounds if isinstance(bound, Within)), None):
        return f"from {within.low:g} to {within.high:g}: {within.why}"
    low = next((bound for bound in bounds if isinstance(bound, at.Gt | at.Ge)), None)
    high = next((bound for bound in bounds if isinstance(bound, at.Lt | at.Le)), None)
    if isinstance(low, at.Ge) and isinstance(high, at.Le):
        return f"from {low.ge} to {high.le}"
    said = []
    if isinstance(low, at.Gt):
        said.append(f"greater than {low.gt}")
    elif isinstance(low, at.Ge):
        said.append(f"of {low.ge} or more")
    if isinstance(high, at.Lt):
        said.append(f"less than {high.lt}")
    elif isinstance(high, at.Le):
        said.append(f"at most {high.le}")
    return " and ".join(said)
