"""Postpones Python's garbage collection while a run is evaluated."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def collecting_later() -> Iterator[None]:
    """Put off the search for unreachable cycles of objects.

    Ten thousand cycles are fifty thousand small objects that live on. Searching them again and again while
    they come up costs a tenth of the evaluation, and there is nothing to find.
    """
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
