"""Least and greatest value of a key that somebody writes, declared beside the key with the reason.

The bounds hold for files (:func:`bufferstand.foundation.settings.loading.parse_settings`): a record that was
made earlier is read as it is, and code may build a schema with any number."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, get_args, get_origin

import annotated_types as at
from pydantic import BaseModel

from bufferstand.foundation.settings.allowed_values import (
    OPEN_TABLES,
    SchemaPlace,
    Within,
    fields_by_key,
    spot_of,
)

Path = tuple[str | int, ...]
"""Keys, and positions in lists (from 0)."""


@dataclass(frozen=True)
class OutOfBounds:
    """A value of a file that lies outside its bounds: where, which value, which bounds."""

    path: Path
    value: float
    within: Within

    def said(self) -> tuple[str, str]:
        """Return what is wrong and what to do."""
        below = self.value < self.within.low
        bound = self.within.low if below else self.within.high
        problem = f"{self.value!r} is too {'small' if below else 'large'}: its bound is {bound:g}"
        return problem, f"write {self.within.range_text()}: {self.within.why}"


def first_breach(settings: BaseModel) -> OutOfBounds | None:
    """Return the first number in checked settings that lies outside its bounds, None if there is none."""
    return next(_breaches(SchemaPlace(type(settings)), settings, (), ()), None)


def _breaches(spot: SchemaPlace, value: Any, path: Path, outer: tuple[Within, ...]) -> Iterator[OutOfBounds]:
    if isinstance(value, BaseModel):
        for key, name, inner in _spots_of(type(value)):
            yield from _breaches(inner, getattr(value, name), (*path, key), ())
        return
    withins = (*outer, *spot.withins)
    if isinstance(value, Mapping):
        for key, entry in value.items():
            yield from _breaches(spot.key(key) or SchemaPlace(object), entry, (*path, key), withins)
    elif isinstance(value, tuple | list):
        for at_index, entry in enumerate(value):
            yield from _breaches(_entry(spot, at_index), entry, (*path, at_index), withins)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        for within in withins:
            if not within.low <= value <= within.high:
                yield OutOfBounds(path, value, within)


@cache
def _spots_of(model: type[BaseModel]) -> tuple[tuple[str, str, SchemaPlace], ...]:
    """Return of each field of a schema its key, its name in code, and what may stand there."""
    own = SchemaPlace(model)
    names = {id(info): name for name, info in model.model_fields.items()}
    found = ((key, names[id(info)], own.key(key)) for key, info in fields_by_key(model).items())
    return tuple((key, name, inner) for key, name, inner in found if inner is not None)


def _entry(spot: SchemaPlace, position: int) -> SchemaPlace:
    """Return the place of an entry of a list, of which each may be of its own type."""
    for choice in spot.choices():
        if get_origin(choice.annotation) in (tuple, list):
            parts = [part for part in get_args(choice.annotation) if part is not ...]
            return spot_of(parts[min(position, len(parts) - 1)])
    return SchemaPlace(object)


@dataclass(frozen=True)
class NumericKey:
    """A number that a settings file may hold, as its schema describes it.

    Parameters
    ----------
    path : tuple of str
        Keys from the top of the file; ``[]`` for the entries of a list, ``[key]`` for those of a
        table of the user's own keys, ``kind=…`` for the table of one kind.
    owner : type
        Schema of the table that has the key.
    name : str
        The key.
    integer : bool
        Whether it is a whole number.
    low, high : float
        Bounds; infinite where there is none.
    low_open, high_open : bool
        Whether the bound itself is not allowed.
    why : str
        The reason of the bounds, where one is stated.
    """

    path: tuple[str, ...]
    owner: type[BaseModel]
    name: str
    integer: bool
    low: float
    high: float
    low_open: bool
    high_open: bool
    why: str

    @property
    def dotted(self) -> str:
        """Its place in words of the file, e.g. ``limits.temperature_stop_C``."""
        return ".".join(part for part in self.path if not part.startswith(("[", "kind=")))


def numeric_keys(schema: type[BaseModel]) -> tuple[NumericKey, ...]:
    """Return every number that a file of a schema may hold, from the schema itself."""
    return tuple(_keys(SchemaPlace(schema), (), (), (), None))


def _keys(
    spot: SchemaPlace,
    path: tuple[str, ...],
    outer: tuple[Any, ...],
    inside: tuple[type[BaseModel], ...],
    owner: type[BaseModel] | None,
) -> Iterator[NumericKey]:
    choices = spot.choices()
    kinds = [choice for choice in choices if choice.model is not None]
    for choice in choices:
        bounds = (*outer, *spot.bounds, *(choice.bounds if choice is not spot else ()))
        if (model := choice.model) is not None:
            if model in inside:
                continue
            named = (*path, f"kind={_kind(choice, spot.tag)}") if len(kinds) > 1 else path
            for key in fields_by_key(model):
                if (inner := choice.key(key)) is not None:
                    yield from _keys(inner, (*named, key), (), (*inside, model), model)
        elif get_origin(choice.annotation) in (tuple, list):
            parts = [part for part in get_args(choice.annotation) if part is not ...]
            for position, part in enumerate(parts):
                mark = "[]" if len(parts) == 1 else f"[{position}]"
                yield from _keys(spot_of(part), (*path, mark), bounds, inside, owner)
        elif get_origin(choice.annotation) in OPEN_TABLES:
            if (inner := choice.key("")) is not None:
                yield from _keys(inner, (*path, "[key]"), bounds, inside, owner)
        elif choice.annotation in (int, float) and owner is not None:
            yield _key(path, owner, choice.annotation is int, bounds)


def _kind(choice: SchemaPlace, tag: str) -> str:
    if not tag:
        return "" if choice.model is None else choice.model.__name__
    place = choice.key(tag)
    return "" if place is None else str(get_args(place.annotation)[0])


def _key(path: tuple[str, ...], owner: type[BaseModel], integer: bool, bounds: tuple[Any, ...]) -> NumericKey:
    low, high, low_open, high_open, why = -math.inf, math.inf, False, False, ""
    for one in bounds:
        lower, upper, lower_open, upper_open = _ends(one)
        if lower is not None and (lower > low or (lower == low and lower_open)):
            low, low_open = lower, lower_open
        if upper is not None and (upper < high or (upper == high and upper_open)):
            high, high_open = upper, upper_open
        why = one.why if isinstance(one, Within) else why
    name = next(part for part in reversed(path) if not part.startswith(("[", "kind=")))
    return NumericKey(path, owner, name, integer, low, high, low_open, high_open, why)


def _ends(bound: Any) -> tuple[float | None, float | None, bool, bool]:
    """Return what one statement of a schema bounds: lower, upper, and whether each is open."""
    if isinstance(bound, Within):
        return bound.low, bound.high, False, False
    lower = {at.Gt: "gt", at.Ge: "ge"}.get(type(bound))
    upper = {at.Lt: "lt", at.Le: "le"}.get(type(bound))
    return (
        None if lower is None else float(getattr(bound, lower)),
        None if upper is None else float(getattr(bound, upper)),
        lower == "gt",
        upper == "lt",
    )
