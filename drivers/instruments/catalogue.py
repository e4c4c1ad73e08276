"""Every kind of instrument there is: those in folders below ``drivers``, and those of other packages."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Generic, TypeVar, cast, get_args

from bufferstand.drivers.instruments.kind import TAGS, InstrumentKind, InstrumentSite, SignalKind, Table
from bufferstand.drivers.instruments.thermometer_kind import SensorEntry, ThermometerKind
from bufferstand.drivers.instruments.wire_address import WireAddress
from bufferstand.drivers.interfaces import Sensor
from bufferstand.foundation import Clock, installed_kinds
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings

GROUP = "bufferstand.instruments"
"""Entry points of this group name an :class:`InstrumentKind` each."""
_DRIVERS = __package__.rpartition(".")[0]
FOLDERS = (f"{_DRIVERS}.amplifiers", f"{_DRIVERS}.thermometers")
"""Each package in these has a module ``kind``, and is a kind."""

Kind = InstrumentKind[Any]
KindT_co = TypeVar("KindT_co", bound=Kind, covariant=True)


@cache
def kinds() -> tuple[Kind, ...]:
    """Return every kind, our own first, by their folders and names.

    Raises
    ------
    BadInput
        If an installed package's kind cannot be had: a stand file that needs it could not be read.
    TypeError
        If two kinds of a list have the same name, or one lacks what every kind or its entry has.
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
class _Entry(Generic[KindT_co]):
    """An entry of one of a stand file's lists of instruments, and the kind that it is of.

    Parameters
    ----------
    stream : str
        What it is called (:func:`stream_name`).
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
    def kind(self) -> KindT_co:
        """What it is."""
        return cast("KindT_co", kind_of(self.settings))

    def wire(self, folder: Path | None = None) -> WireAddress:
        """Return where it is reached, relative paths from the stand file's folder or another."""
        return self.kind.wire(self.settings, folder or self.folder)


@dataclass(frozen=True)
class Instrument(_Entry[SignalKind[Any]]):
    """An amplifier or sensor of a stand; its stream is what its samples are called."""

    @property
    def channel(self) -> Channel:
        """What it measures."""
        found: Channel = self.settings.channel
        return found

    def driver(self, clock: Clock) -> Sensor:
        """Return its driver, not started yet."""
        return self.kind.driver(self.settings, InstrumentSite(self.folder, clock, self.stream))


@dataclass(frozen=True)
class Thermometers(_Entry[ThermometerKind[Any]]):
    """A device of thermometers; its stream is what its wire is called, a sensor's stream has its own name."""

    @property
    def sensors(self) -> tuple[SensorEntry, ...]:
        """Its sensors."""
        return tuple(self.settings.sensor)

    def drivers(self, clock: Clock) -> tuple[Sensor, ...]:
        """Return the driver of each sensor, not started yet."""
        return self.kind.drivers(self.settings, InstrumentSite(self.folder, clock, self.stream))


def stream_name(table: Table, number: int) -> str:
    """Return what an entry is called: the first as its list, then numbered from 2.

    Of an amplifier or sensor that is its stream; of thermometers their wire: ``temperature_2`` is a sensor.
    """
    name = "thermometers" if table == "temperature" else table
    return name if number == 0 else f"{name}_{number + 1}"


def _demand_whole(kind: Kind) -> None:
    """Refuse a kind that leaves something out, by name."""
    for stated in kind.stated:
        if not hasattr(kind, stated):
            raise TypeError(f"instrument “{kind.name}” ({kind}) does not state its {stated}")
    fields = kind.settings.model_fields
    for key in (TAGS[kind.table], *kind.keys):
        if key not in fields:
            raise TypeError(f"the settings of instrument “{kind.name}” ({kind}) have no key {key}")
    if get_args(fields[TAGS[kind.table]].annotation) != (kind.name,):
        raise TypeError(f"{TAGS[kind.table]} of {kind.settings} must be Literal[{kind.name!r}]")


def _in_folder() -> Iterator[Kind]:
    for folder in FOLDERS:
        package = import_module(folder)
        for name in sorted(one.name for one in pkgutil.iter_modules(package.__path__) if one.ispkg):
            kind = import_module(f"{folder}.{name}.kind").KIND
            yield from kind if isinstance(kind, tuple) else (kind,)


def _installed() -> Iterator[Kind]:
    return installed_kinds(GROUP, "instrument", lambda kind: isinstance(kind, SignalKind | ThermometerKind))
