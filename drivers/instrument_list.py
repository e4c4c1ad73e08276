"""What can be connected without writing code: kinds of device, shipped maps, and what each is made from."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bufferstand.drivers.acquisition import acquisition_kinds
from bufferstand.drivers.acquisition.modbus_io import load_description, shipped_descriptions
from bufferstand.drivers.amplifiers.ascii_line import load_line_description, shipped_line_descriptions
from bufferstand.drivers.controllers import controller_kinds
from bufferstand.drivers.controllers.rmc import program_text
from bufferstand.drivers.instruments import kinds
from bufferstand.drivers.register_maps import SHIPPED, load_amplifier_map, load_profile
from bufferstand.foundation import BadInput

PROGRAMS = {"rmc": program_text}
"""Kinds whose device needs a program of the laboratory, and its text."""


@dataclass(frozen=True)
class KnownInstrument:
    """A kind of device, or a shipped description of one.

    Parameters
    ----------
    table : str
        Where a stand file names it: ``controller``, ``acquisition``, ``amplifier``, ``sensor``,
        ``temperature``; ``description`` of Modbus I/O, ``line`` of an amplifier, ``profile`` and ``map``
        for descriptions.
    name : str
        What it writes there.
    title : str
        What it is.
    sources : tuple of str
        Documents, with edition and pages.
    confirmed : bool
        Whether it was confirmed on hardware.
    """

    table: str
    name: str
    title: str
    sources: tuple[str, ...]
    confirmed: bool


def known_instruments() -> tuple[KnownInstrument, ...]:
    """Return every kind and every shipped description, in the order of a stand file.

    Raises
    ------
    BadInput
        If an installed package's kind cannot be had.
    """
    return (*_controllers(), *_acquisition(), *_beside(), *_descriptions())


def lab_program(name: str) -> str:
    """Return the program that a laboratory loads into a device of a kind.

    Raises
    ------
    BadInput
        If that kind needs none.
    """
    if name not in PROGRAMS:
        raise BadInput(
            f"no program is shipped for “{name}”", remedy=f"there is one for {', '.join(PROGRAMS)}"
        )
    return PROGRAMS[name]()


def _controllers() -> Iterator[KnownInstrument]:
    for kind in controller_kinds():
        yield KnownInstrument("controller", kind.name, kind.title, kind.sources, kind.confirmed)


def _acquisition() -> Iterator[KnownInstrument]:
    for kind in acquisition_kinds():
        yield KnownInstrument("acquisition", kind.name, _first_line(type(kind)), kind.sources, kind.confirmed)


def _beside() -> Iterator[KnownInstrument]:
    for kind in kinds():
        yield KnownInstrument(kind.table, kind.name, _first_line(type(kind)), kind.sources, kind.confirmed)


def _descriptions() -> Iterator[KnownInstrument]:
    """Yield the descriptions and register maps that are shipped: addresses as data."""
    for name in shipped_descriptions():
        found = load_description(name, Path())
        sources = tuple(one.sentence for one in found.source)
        yield KnownInstrument("description", name, found.title, sources, found.confirmed)
    for name in shipped_line_descriptions():
        spoken = load_line_description(name, Path())
        sources = tuple(one.sentence for one in spoken.source)
        yield KnownInstrument("line", name, spoken.title, sources, spoken.confirmed)
    for path in sorted(SHIPPED.glob("*.toml")):
        facts = load_profile(path.stem).facts
        yield KnownInstrument("profile", path.stem, facts.description, (f"edition {facts.edition}",), False)
    for path in sorted((SHIPPED.parent / "amplifier_maps").glob("*.toml")):
        edition = load_amplifier_map(path.stem, Path()).edition
        yield KnownInstrument("map", path.stem, _comment(path), (f"edition {edition}",), False)


def _comment(path: Path) -> str:
    """Return the first sentence of the comment with which a description begins."""
    lines = path.read_text(encoding="utf-8").splitlines()
    text = " ".join(line.lstrip("# ") for line in lines if line.startswith("#"))
    return text.partition(":")[0].partition(". ")[0]


def _first_line(kind: type) -> str:
    return (inspect.getdoc(kind) or "").partition("\n")[0].rstrip(".")
