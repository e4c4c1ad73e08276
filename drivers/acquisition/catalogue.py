"""Every kind of acquisition device there is: those in folders here, and those of other packages."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import get_args

from bufferstand.drivers.acquisition.kind import AcquisitionKind, AcquisitionSettings, Kind
from bufferstand.foundation import installed_kinds

GROUP = "bufferstand.acquisition"
"""Entry points of this group name an :class:`AcquisitionKind` each."""


@cache
def acquisition_kinds() -> tuple[Kind, ...]:
    """Return every kind, our own first, by their names.

    Raises
    ------
    BadInput
        If an installed package's kind cannot be had: a stand file that needs it could not be read.
    TypeError
        If two kinds have the same name, or one lacks what every kind has.
    """
    found: dict[str, Kind] = {}
    for kind in (*_in_folder(), *_installed()):
        for stated in ("name", "settings", "sources"):
            if not hasattr(kind, stated):
                raise TypeError(f"acquisition kind {kind} does not state its {stated}")
        if get_args(kind.settings.model_fields["kind"].annotation) != (kind.name,):
            raise TypeError(f"kind of {kind.settings} must be Literal[{kind.name!r}]")
        if (other := found.setdefault(kind.name, kind)) is not kind:
            raise TypeError(f"two kinds of [[acquisition]] are called {kind.name}: {other} and {kind}")
    return tuple(found.values())


def acquisition_kind_of(settings: AcquisitionSettings) -> Kind:
    """Return the kind whose entry of a stand file this is."""
    return next(kind for kind in acquisition_kinds() if type(settings) is kind.settings)


def _in_folder() -> Iterator[Kind]:
    package = import_module(__package__)
    for name in sorted(one.name for one in pkgutil.iter_modules(package.__path__) if one.ispkg):
        yield import_module(f"{__package__}.{name}.kind").KIND


def _installed() -> Iterator[Kind]:
    return installed_kinds(GROUP, "acquisition device", lambda kind: isinstance(kind, AcquisitionKind))
