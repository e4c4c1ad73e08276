"""The face of a room: a package's ``__init__`` that offers names and loads each when it is first used.

So a face costs nothing until something of it is used, and what one name needs (scipy, a web server) is not
loaded for another.
"""

from __future__ import annotations

import ast
import importlib
import sys
from collections.abc import Callable, Mapping
from pathlib import Path


def loaded_when_used(package: str, file: str) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` (PEP 562) of a package whose ``__init__`` says what it offers.

    Parameters
    ----------
    package, file : str
        ``__name__`` and ``__file__`` of the package. What it offers are the imports in its block
        ``if TYPE_CHECKING:``, where type checkers and import-linter see them, too.
    """
    homes = _imports_of(file)

    def get(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        found: object = getattr(importlib.import_module(homes[name]), name)
        setattr(sys.modules[package], name, found)
        return found

    return get, lambda: sorted({*vars(sys.modules[package]), *homes})


def _imports_of(file: str) -> Mapping[str, str]:
    """Return the module of each name that is imported for type checkers."""
    return {
        alias.name: str(line.module)
        for block in ast.parse(Path(file).read_text(encoding="utf-8")).body
        if isinstance(block, ast.If) and isinstance(block.test, ast.Name) and block.test.id == "TYPE_CHECKING"
        for line in block.body
        if isinstance(line, ast.ImportFrom)
        for alias in line.names
    }
