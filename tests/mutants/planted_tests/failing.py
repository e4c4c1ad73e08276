"""A test that fails without any mutant."""

from __future__ import annotations

from tests.mutants.planted import clipped


def test_it_asks_for_what_is_not_so() -> None:
    assert clipped(1) == 2
