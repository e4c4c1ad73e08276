"""A small module for the tests of the tool: what it does is held by one good and one weak test."""

from __future__ import annotations

MOST = 3
"""So many count."""


def clipped(number: int) -> int:
    """Return a number that is no greater than allowed."""
    if number > MOST:
        return MOST
    return number


def noted(number: int, notes: list[int]) -> int:
    """Note a number and return the next."""
    notes.append(number)
    return number + 1
