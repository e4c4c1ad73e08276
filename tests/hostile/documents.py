"""Documents with odd values in their places."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

ODD: tuple[Any, ...] = (
    None, True, "a", "", -1, 0, 10**30, 1e300, 5e-324, -1.5, [], [1], {}, {"a": 1}, "a" * 5000, "\x1b[31m",
)  # fmt: skip


def places(content: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place in a document."""
    yield path
    parts = content.items() if isinstance(content, dict) else ()
    for key, inner in enumerate(content) if isinstance(content, list) else parts:
        yield from places(inner, (*path, key))


def changed(content: Any, path: tuple[Any, ...], value: Any) -> Any:
    """Return a document with another value at a place."""
    if not path:
        return value
    content = copy.deepcopy(content)
    here = content
    for part in path[:-1]:
        here = here[part]
    here[path[-1]] = value
    return content
