"""The study itself: ten thousand imperfect records by `pytest --long`."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt

import pytest

from . import study
from .judgement import Judgement

RECORDS, JOBS = 10_000, 2


def demand(judgements: list[Judgement]) -> None:
    """Demand no falsehood in any record, and figures within U as often as they should be."""
    false = [f"{j.number} {j.kinds}: {f}" for j in judgements for f in j.falsehoods]
    assert not false, "\n".join(false[:40])
    beyond = sum(f[0] == "beyond U" for j in judgements for f in j.findings)
    chance = sum(j.chance for j in judgements)
    assert beyond <= chance + 3.0 * sqrt(chance) + 3.0, f"{beyond} verdicts beyond U, {chance:.2f} expected"
    outside = list(outside_of_range(judgements))
    assert not outside, "\n".join(outside)


def outside_of_range(judgements: Iterable[Judgement]) -> Iterable[str]:
    """Name the figures that are not within U in 93 to 97 % of the records.

    From that many records a share has a scatter of its own: three standard deviations of it are given.
    """
    for name, (count, within, _) in study.coverage(judgements).items():
        slack = 3.0 * 100.0 * sqrt(0.95 * 0.05 / count)
        too_wide = within > 97.0 + slack and name.endswith("half_width_95")
        if within < 93.0 - slack or too_wide:
            yield f"{name}: {within:.1f} % of {count}"


@pytest.mark.long
def test_ten_thousand_imperfect_records() -> None:
    judgements = study.many(range(RECORDS), JOBS)
    print(study.tables(judgements))
    demand(judgements)
