"""Every kind of instrument there is: those below ``drivers/amplifiers``, and those of other packages."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

from bufferstand.drivers.instruments.kind import TAGS, InstrumentKind, InstrumentSite, Table
from bufferstand.drivers.interfaces import Sensor
from bufferstand.foundation import Clock, installed_kinds
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings

GROUP = "bufferstand.instruments"
"""Entry points of this group name an :class:`InstrumentKind` each."""
FOLDER = f"{__package__.rpartition('.')[0]}.amplifiers"
"""Each package in this one that has a module ``kind`` is a kind."""

Kind = InstrumentKind[Any]


@cache
def kinds() -> tuple[Kind, ...]:
    """Return every kind, our own first, by their names within each.

    Raises
    ------
    BadInput
        If an installed package's kind cannot be had: a stand file that needs it could not be read.
    TypeError
        If two kinds of a list have the same name, or a schema lacks what every entry has.
    """
    found: dict[tuple[str, str], Kind] = {}
    for kind in (*_in_folder(), *_installed()):
        _demand_whole(kind)
        if (other := found.setdefault((kind.table, kind.name), kind)) is not kind:
            raise TypeError(f"two kinds of [[{kind.table}]] are called {kind.name}: {other} and {kind}")
    return tuple(found.values())


def kind_of(settings: Settings) -> Kind:
    """Return the kind whose entry of a stand file this is."""
    return next(kind for kind in kinds() if type(settings) is kind.settings)


@dataclass(frozen=True)
class Instrument:
    """An instrument of a stand: an entry of its file, and the kind that it is of.

    Parameters
    ----------
    stream : str
        What its samples are called.
    place : tuple of str and int
        Of its table in the stand file.
    settings : Settings
        That table.
    folder : Path
        Of the stand file.
    """

    stream: str
    place: tuple[str | int, ...]
    settings: Any
    folder: Path

    @property
    def kind(self) -> Kind:
        """What it is."""
        return kind_of(self.settings)

    @property
    def channel(self) -> Channel:
        """What it measures."""
        found: Channel = self.settings.channel
        return found

    def driver(self, clock: Clock) -> Sensor:
        """Return its driver, not started yet."""
        return self.kind.driver(self.settings, InstrumentSite(self.folder, clock, self.stream))


def stream_name(table: Table, number: int) -> str:
    """Return what the samples of an entry are called: of the first as its list, then numbered from 2."""
    return table if number == 0 else f"{table}_{number + 1}"


def _demand_whole(kind: Kind) -> None:
    """Refuse a kind that leaves something out, by name."""
    fields = kind.settings.model_fields
    for key in (TAGS[kind.table], "rate_Hz", "channel"):
        if key not in fields:
            raise TypeError(f"the settings of instrument “{kind.name}” ({kind}) have no key {key}")
    if get_args(fields[TAGS[kind.table]].annotation) != (kind.name,):
        raise TypeError(f"{TAGS[kind.table]} of {kind.settings} must be Literal[{kind.name!r}]")


def _in_folder() -> Iterator[Kind]:
    package = import_module(FOLDER)
    for name in sorted(one.name for one in pkgutil.iter_modules(package.__path__) if one.ispkg):
        kind = import_module(f"{FOLDER}.{name}.kind").KIND
        yield from kind if isinstance(kind, tuple) else (kind,)


def _installed() -> Iterator[Kind]:
    return installed_kinds(GROUP, "instrument", lambda kind: isinstance(kind, InstrumentKind))
