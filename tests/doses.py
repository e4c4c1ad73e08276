"""The mark ``dose(n)``: of a test of many cases n always run, the others with ``--long``."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import TypeVar

import pytest

T = TypeVar("T")


def beyond(cases: Sequence[T], size: int) -> list[T]:
    """Return all but so many of the cases: those that are kept lie evenly from the first to the last."""
    kept = min(size, len(cases))
    always = {round(number * (len(cases) - 1) / max(kept - 1, 1)) for number in range(kept)}
    return [case for number, case in enumerate(cases) if number not in always]


def beyond_their_doses(items: list[pytest.Item]) -> list[pytest.Item]:
    """Return the cases that only ``--long`` runs, of all tests that carry the mark."""
    cases: dict[tuple[str, int], list[pytest.Item]] = defaultdict(list)
    for item in items:
        dose = item.get_closest_marker("dose")
        if dose and not item.get_closest_marker("long"):
            (size,) = dose.args
            cases[item.nodeid.partition("[")[0], size].append(item)
    return [item for (_, size), group in cases.items() for item in beyond(group, size)]
