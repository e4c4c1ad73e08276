"""What other installed packages bring, by the group of their entry points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.metadata import entry_points
from typing import Any

from bufferstand.foundation.errors import BadInput


def installed_kinds(group: str, noun: str, is_kind: Callable[[Any], bool]) -> Iterator[Any]:
    """Yield what the entry points of a group name, by their names.

    Parameters
    ----------
    group : str
        E.g. ``bufferstand.guards``.
    noun : str
        What each must be, for messages: “guard”.
    is_kind : callable
        Whether it is one.

    Raises
    ------
    BadInput
        With the package, if one cannot be loaded or is none.
    """
    for point in sorted(entry_points(group=group), key=lambda one: one.name):
        package = "a package" if point.dist is None else point.dist.name
        try:
            kind = point.load()
        except Exception as error:  # whatever it is: the package's own code
            raise BadInput(
                f"{noun} “{point.name}” of {package} cannot be loaded: {error!r}",
                remedy="mend that package, or uninstall it",
            ) from error
        if not is_kind(kind):
            raise BadInput(
                f"{noun} “{point.name}” of {package} is no kind of {noun}",
                remedy="mend or uninstall that package",
            )
        yield kind
