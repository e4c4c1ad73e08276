"""Tests of the planted module that notice its mutants; only the tool runs them: others must not import it."""

from __future__ import annotations

from tests.mutants.planted import clipped, noted


def test_what_is_too_great_is_clipped() -> None:
    assert [clipped(number) for number in (2, 3, 4, 5)] == [2, 3, 3, 3]


def test_a_number_is_noted() -> None:
    notes: list[int] = []
    assert noted(4, notes) == 5
    assert notes == [4]
