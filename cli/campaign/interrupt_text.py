"""The message of an interrupt before anything has moved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

NOT_MOVED = "nothing was moved"


@contextmanager
def nothing_moved() -> Iterator[None]:
    """Let an interrupt in here say so, unless it says more already.

    Raises
    ------
    KeyboardInterrupt
        With what is told of the stand.
    """
    try:
        yield
    except KeyboardInterrupt as interrupt:
        raise KeyboardInterrupt(str(interrupt) or NOT_MOVED) from None
