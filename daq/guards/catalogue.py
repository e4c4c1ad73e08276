"""Every kind of guard there is: those of ``kinds/``, and those that other packages bring."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from bufferstand.daq.guards.guard import Guard
from bufferstand.foundation import BadInput, installed_kinds
from bufferstand.foundation.settings import Settings, demand_within, nearest_key, place_of, read_text, refusal
from bufferstand.protocols.campaign_file import GuardTable

GROUP = "bufferstand.guards"
"""Entry points of this group name a subclass of :class:`bufferstand.daq.guards.guard.Guard` each."""
FOLDER = f"{__package__}.kinds"
"""Every module of this package holds kinds."""

Kind = type[Guard[Any]]


@cache
def kinds() -> tuple[Kind, ...]:
    """Return every kind, those of ``kinds/`` first, by their names within each.

    Raises
    ------
    BadInput
        If an installed package's guard cannot be had: without it nobody would guard what it does.
    TypeError
        If two kinds have the same name, or a table of its own has one of ``[guards]``.
    """
    found: dict[str, Kind] = {}
    for kind in (*_in_folder(), *_installed()):
        if found.setdefault(kind.kind, kind) is not kind:
            raise TypeError(f"two guards are called {kind.kind}: {found[kind.kind]} and {kind}")
        if isinstance(kind.settings, type) and kind.kind in GuardTable.model_fields:
            raise TypeError(
                f"[guards] has a key {kind.kind} already: {kind} needs another name for its table"
            )
    return tuple(found.values())


def _in_folder() -> Iterator[Kind]:
    """Yield the kinds of :data:`FOLDER`."""
    package = import_module(FOLDER)
    for name in sorted(one.name for one in pkgutil.iter_modules(package.__path__)):
        module = import_module(f"{FOLDER}.{name}")
        for value in vars(module).values():
            if isinstance(value, type) and issubclass(value, Guard) and value.__module__ == module.__name__:
                yield value


def _installed() -> Iterator[Kind]:
    return installed_kinds(GROUP, "guard", lambda kind: isinstance(kind, type) and issubclass(kind, Guard))


def demand_own_tables(table: GuardTable, path: Path) -> None:
    """Refuse tables ``[guards.KIND]`` that no guard takes, and settings in them that cannot be.

    Parameters
    ----------
    table : GuardTable
        ``[guards]`` of a campaign file.
    path : Path
        That file.

    Raises
    ------
    BadInput
        With file, line, key and what to do.
    """
    schemas = {kind.kind: kind.settings for kind in kinds() if isinstance(kind.settings, type)}
    for name, content in table.own.items():
        text = read_text(path)
        schema: type[Settings] | None = schemas.get(name)
        if schema is None:
            known = ", ".join(f"[guards.{one}]" for one in ("action", *schemas))
            near = nearest_key(name, ("action", *GuardTable.model_fields, *schemas))
            raise BadInput(
                f"no guard is called “{name}”",
                file=path,
                place=place_of(("guards", name), text),
                remedy=f"did you mean “{near}”?"
                if near
                else f"remove it, or install the package that brings this guard; there is {known}",
            )
        place: tuple[str | int, ...] = ("guards", name)
        try:
            settings = schema.model_validate(content)
        except ValidationError as error:
            raise refusal(error, schema, path, text, place) from None
        demand_within(settings, path, text, place)
