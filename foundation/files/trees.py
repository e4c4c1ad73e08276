"""What a document that somebody else wrote may be, before anything is made of it: bounded in every way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

DEEPEST = 32
"""Tables and lists within one another; a campaign's have six."""
MOST_VALUES = 5_000_000
"""Values of a JSON document; an evaluation of a run of 1,000 cycles has some 30,000."""
LARGEST_WHOLE = 2**63
"""Whole numbers are of 64 bits, as TOML says; a larger one cannot be calculated with as a number."""

Path = tuple[str | int, ...]
"""Keys, and positions in lists (from 0)."""


@dataclass(frozen=True)
class OutOfForm:
    """What no document may hold: where, what is wrong, what to do."""

    path: Path
    problem: str
    remedy: str


def out_of_form(
    content: Any, most_values: int = MOST_VALUES, *, finite: bool = True, largest: float = math.inf
) -> OutOfForm | None:
    """Return the first thing in a document that is out of bounds; None where all is well.

    Parameters
    ----------
    content : object
        What a reader of JSON or TOML gives.
    most_values : int
        Values, tables and lists that it may hold.
    finite : bool
        Whether infinite numbers and NaN are out of form, as in JSON.
    largest : float
        Greatest amount of a number.
    """
    waiting: list[tuple[Path, Any]] = [((), content)]
    count = 0
    while waiting:
        path, value = waiting.pop()
        count += 1
        if count > most_values:
            return OutOfForm((), f"more than {most_values} values", "this is no file of bufferstand's")
        if isinstance(value, dict | list):
            if len(path) >= DEEPEST:
                return OutOfForm(path[:3], *too_deep())
            parts = value.items() if isinstance(value, dict) else enumerate(value)
            waiting.extend((((*path, part), inner) for part, inner in reversed(list(parts))))
        elif isinstance(value, bool | str):
            continue
        elif isinstance(value, int):
            if not -LARGEST_WHOLE <= value < LARGEST_WHOLE:
                return OutOfForm(path, "a whole number of more than 64 bits", "write a smaller number")
        elif isinstance(value, float):
            if finite and not math.isfinite(value):
                return OutOfForm(path, f"{value} is no finite number", "write a number")
            if abs(value) > largest:
                return OutOfForm(path, f"{value:g} is too large", f"write a number up to {largest:g}")
    return None


def too_deep() -> tuple[str, str]:
    """Return what is said of a document whose tables and lists lie too deep within one another."""
    return f"more than {DEEPEST} tables and lists within one another", "write it flatter"


TOO_MANY_DIGITS = ("a number of more digits than any number here has", "write fewer digits")
"""What is said of a whole number that Python does not even read (more than 4,300 digits)."""
