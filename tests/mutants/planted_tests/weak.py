"""A test of the planted module that looks at too little."""

from __future__ import annotations

from tests.mutants.planted import clipped, noted


def test_small_numbers_stay() -> None:
    assert clipped(2) == 2
    assert noted(4, []) > 4
