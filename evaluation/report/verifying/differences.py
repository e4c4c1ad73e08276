"""Where two documents differ."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

ROUNDING = 1e-9
"""Numbers that differ by a smaller share are the same: another processor adds up in another order."""
RESIDUE = 1e-14
"""What is smaller is left of a sum that should be zero, in whatever unit: no figure of an evaluation is."""
_ABSENT = "not there"
_LONGEST = 60


def differences(stated: Any, made: Any, place: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield where two documents of JSON differ, with what stands in each.

    Parameters
    ----------
    stated, made
        JSON content.
    place : str
        Where they stand, for the place of what differs.

    Yields
    ------
    (str, str, str)
        Place (``runs.A-1.cycles.0.damping``), and the two as text.
    """
    if isinstance(stated, Mapping) and isinstance(made, Mapping):
        for key in dict.fromkeys((*stated, *made)):
            below = f"{place}.{key}" if place else str(key)
            if key in stated and key in made:
                yield from differences(stated[key], made[key], below)
            else:
                yield below, _text(stated.get(key, _ABSENT)), _text(made.get(key, _ABSENT))
    elif isinstance(stated, list) and isinstance(made, list) and len(stated) == len(made):
        for position, (one, other) in enumerate(zip(stated, made, strict=True)):
            yield from differences(one, other, f"{place}.{position}")
    elif not _same(stated, made):
        yield place, _text(stated), _text(made)


def _same(stated: Any, made: Any) -> bool:
    numbers = (isinstance(one, int | float) and not isinstance(one, bool) for one in (stated, made))
    if all(numbers):
        return math.isclose(stated, made, rel_tol=ROUNDING, abs_tol=RESIDUE)
    return type(stated) is type(made) and bool(stated == made)


def _text(value: Any) -> str:
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, Mapping):
        return "a table"
    text = "null" if value is None else str(value)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "…"
