"""Every kind of controller there is: those in folders below this one, and those of other packages."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from functools import cache
from importlib import import_module

from bufferstand.drivers.controllers.kind import ControllerKind
from bufferstand.foundation import installed_kinds

GROUP = "bufferstand.controllers"
"""Entry points of this group name a :class:`ControllerKind` each."""
REGISTERS = "registers"
"""The kind that a stand file means without saying so."""
_STATED = ("name", "title", "settings", "profile", "sources", "confirmed")


@cache
def controller_kinds() -> tuple[ControllerKind, ...]:
    """Return every kind, our own first, by their folders.

    Raises
    ------
    BadInput
        If an installed package's kind cannot be had.
    TypeError
        If two have the same name, or one leaves something out.
    """
    found: dict[str, ControllerKind] = {}
    for kind in (*_in_folder(), *_installed()):
        for stated in _STATED:
            if not hasattr(kind, stated):
                raise TypeError(f"controller {kind} does not state its {stated}")
        if found.setdefault(kind.name, kind) is not kind:
            raise TypeError(f"two kinds of controller are called {kind.name}: {found[kind.name]} and {kind}")
    return tuple(found.values())


def controller_kind(name: str) -> ControllerKind:
    """Return the kind of a name that a stand file was checked to have."""
    return next(kind for kind in controller_kinds() if kind.name == name)


def _in_folder() -> Iterator[ControllerKind]:
    package = import_module(__package__)
    for name in sorted(one.name for one in pkgutil.iter_modules(package.__path__) if one.ispkg):
        yield import_module(f"{__package__}.{name}.kind").KIND


def _installed() -> Iterator[ControllerKind]:
    return installed_kinds(GROUP, "controller", lambda kind: isinstance(kind, ControllerKind))
