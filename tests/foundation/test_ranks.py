"""Median and quantiles are numpy's own, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.foundation.numbers.quantiles import median, quantile, sorted_quantile

SHARES = (0.0, 0.001, 0.02, 0.2, 0.5, 0.75, 0.9, 0.98, 0.999, 1.0)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 10, 11, 99, 1000, 20_001])
@pytest.mark.parametrize("digits", [1, 12])
def test_they_are_numpys(size: int, digits: int) -> None:
    random = np.random.default_rng(size)
    for _ in range(10):
        values = np.round(random.standard_normal(size), digits)
        assert median(values) == np.median(values)
        for share in SHARES:
            assert quantile(values, share) == np.quantile(values, share)
            assert sorted_quantile(np.sort(values), share) == np.quantile(values, share)


def test_of_whole_numbers_and_lists() -> None:
    assert median([3.0, 1.0, 2.0, 9.0]) == 2.5
    assert median(np.array([7, 2, 4, 1])) == 3.0
    assert quantile(np.array([1, 2, 3, 4]), 0.25) == np.quantile([1, 2, 3, 4], 0.25)


@pytest.mark.parametrize("values", [[], [np.nan], [1.0, np.nan, 2.0], [np.nan, 1.0, 2.0, 3.0, 4.0]])
def test_what_is_no_number_has_none(values: list[float]) -> None:
    column = np.array(values)
    assert np.isnan(median(column))
    assert all(np.isnan(quantile(column, share)) for share in SHARES)
    assert column.size == 0 or np.isnan(sorted_quantile(np.sort(column), 0.2))


def test_the_column_stays_as_it_was() -> None:
    values = np.array([3.0, 1.0, 2.0])
    median(values)
    quantile(values, 0.2)
    assert values.tolist() == [3.0, 1.0, 2.0]
